#include "core/robdef/model/names.hpp"

#include <catch2/catch.hpp>

using namespace rr;

TEST_CASE("a qualified name splits at its last dot", "[robdef]") {
  CHECK(split_qualified("com.x.Pose").service == "com.x");
  CHECK(split_qualified("com.x.Pose").name == "Pose");
  CHECK(split_qualified("Pose").service.empty());
  CHECK(split_qualified("Pose").name == "Pose");
}
