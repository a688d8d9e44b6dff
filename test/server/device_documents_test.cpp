// Documents about a device whose services bring definitions of one name that differ.
#include "server/http/endpoints/device_documents.hpp"

#include <catch2/catch.hpp>
#include <memory>

using namespace rrgate;
using Catch::Matchers::Contains;

namespace {

std::unique_ptr<rr::TypeRegistry> registry(const std::vector<std::string>& texts) {
  auto types = std::make_unique<rr::TypeRegistry>();
  REQUIRE(types->add(texts, rr::RobdefMode::compat).has_value());
  return types;
}

std::string light(const std::string& name) {
  return "service test.light\nstdver 0.10\nstruct " + name + "\n    field double red\nend\n";
}

std::string lamp(const std::string& name, const std::string& colour) {
  return "service test." + name + "\nstdver 0.10\nimport test.light\nobject Lamp\n    property test.light." + colour +
         " colour\nend\n";
}

struct Lamps {
  std::unique_ptr<rr::TypeRegistry> first = registry({light("Colour"), lamp("desk", "Colour")});
  std::unique_ptr<rr::TypeRegistry> same = registry({light("Colour"), lamp("floor", "Colour")});
  std::unique_ptr<rr::TypeRegistry> different = registry({light("Shade"), lamp("floor", "Shade")});
  DescribedService desk = {"desk", "test.desk.Lamp", first.get()};
  DescribedService alike = {"floor", "test.floor.Lamp", same.get()};
  DescribedService other = {"floor", "test.floor.Lamp", different.get()};
};

}  // namespace

TEST_CASE("a service fits into the documents of a device where it means the same by every name") {
  const Lamps lamps;
  CHECK(fits_beside(lamps.desk, {}));
  CHECK(fits_beside(lamps.alike, {lamps.desk}));
  CHECK_FALSE(fits_beside(lamps.other, {lamps.desk}));
  CHECK_FALSE(fits_beside(lamps.other, {lamps.alike, lamps.desk}));
}

TEST_CASE("types of services that fit beside each other are told, and why there are none of others") {
  const Lamps lamps;
  const auto told = device_document("types.d.ts", "d", "/d", {lamps.desk, lamps.alike}, {});
  CHECK(told.status == 200);
  REQUIRE(told.body);
  CHECK_THAT(*told.body, Contains("export interface Colour {"));
  const auto refused = device_document("types.d.ts", "d", "/d", {lamps.desk, lamps.other}, {});
  CHECK(refused.status == 503);
  REQUIRE(refused.body);
  CHECK_THAT(*refused.body, Contains("do not fit together") && Contains("Shade"));
}
