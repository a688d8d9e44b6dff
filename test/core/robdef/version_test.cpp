#include <catch2/catch.hpp>

#include "core/robdef/model/service_definition.hpp"

namespace rr::test {

TEST_CASE("versions are two to four numbers", "[robdef]") {
  CHECK(*parse_version("0.10") == Version{0, 10, 0, 0});
  CHECK(*parse_version("0.9.2") == Version{0, 9, 2, 0});
  CHECK(*parse_version("1.2.8.1") == Version{1, 2, 8, 1});
  CHECK(*parse_version("0.09") == Version{0, 9, 0, 0});
  CHECK(*parse_version("4294967295.0") == Version{4294967295u, 0, 0, 0});
  for (const auto* text :
       {"", "1", "1.", ".1", "1.2.3.4.5", "1.2.3.4.", "1..2", "a.b", "1.2 ", "-1.0", "4294967296.0", "0.0x1"}) {
    INFO(text);
    REQUIRE(parse_version(text).has_error());
    CHECK(parse_version(text).error().code == ErrorCode::service_definition_error);
  }
}

TEST_CASE("versions compare number by number and print without trailing zeros", "[robdef]") {
  CHECK(*parse_version("0.10") > *parse_version("0.9.2"));
  CHECK(*parse_version("0.9.2") > *parse_version("0.9.1"));
  CHECK(Version{}.is_unspecified());
  CHECK(format_version({0, 10, 0, 0}) == "0.10");
  CHECK(format_version({0, 9, 2, 0}) == "0.9.2");
  CHECK(format_version({1, 0, 0, 7}) == "1.0.0.7");
}

}  // namespace rr::test
