// Default values: service definitions spec, section 5.4.
#include <catch2/catch.hpp>

#include "core/types/pack.hpp"
#include "test/core/types/fixture.hpp"
#include "test/core/types/show_result.hpp"

using namespace rr;
using namespace rr::test;

namespace {

Value default_of(std::string_view field) {
  return default_value(field_type("test.types.every", field), test_types());
}

}  // namespace

TEST_CASE("defaults are zeros, empty or null") {
  CHECK(default_of("d") == Value(0.0));
  CHECK(default_of("u8") == Value(std::uint8_t{0}));
  CHECK(default_of("cs") == Value(CSingle()));
  CHECK(default_of("b") == Value(false));
  CHECK(default_of("m") == Value(std::int32_t{0}));
  CHECK(default_of("text") == Value(""));
  CHECK(default_of("ds") == Value(std::vector<double>{}));
  CHECK(default_of("m3") == Value(std::vector<std::int32_t>{}));
  CHECK(default_of("f3") == Value(std::vector<std::int32_t>{0, 0, 0}));
  CHECK(default_of("grid") == MultiDimArray{{1, 0}, Array::empty(DataType::double_t)});
  CHECK(default_of("grid23") == MultiDimArray{{2, 3}, Array::take(std::vector<std::int16_t>(6))});
  for (const auto* field : {"p3", "p3s", "p3_by_number", "p3_by_name", "any", "texts"}) {
    INFO(field);
    CHECK(default_of(field).is_null());
  }
}

TEST_CASE("default pods and named arrays are all zero") {
  const Structure zero{"", {{"id", std::int16_t{0}}, {"value", 0.0f}}};
  CHECK(default_of("p") == PodArray{"test.types.point", {zero}, {}, true});
  CHECK(default_of("p2") == PodArray{"test.types.point", {zero, zero}});
  CHECK(default_of("ps") == PodArray{"test.types.point", {}});
  CHECK(default_of("pgrid") == PodArray{"test.types.point", {}, {1, 0}, false, true});
  CHECK(default_of("pgrid21") == PodArray{"test.types.point", {zero, zero}, {2, 1}, false, true});
  CHECK(default_of("t") == NamedArray{"test.types.transform", Array::take(std::vector<double>(7)), {}, true});
  CHECK(default_of("vs") == NamedArray{"test.types.vec3", Array::empty(DataType::double_t)});
}

TEST_CASE("every default packs") {
  for (const auto& member : test_types().find_entity("test.types.every")->members) {
    INFO(member.name);
    const auto value = default_value(member.type, test_types());
    const auto read = round_trip(value, member.type);
    REQUIRE((read ? "" : read.error().message) == "");
    CHECK(*read == value);
  }
}

TEST_CASE("sizes beyond all memory give null") {
  TypeRegistry types;
  REQUIRE(types.add({"service test.huge\nstdver 0.10\n"
                     "namedarray n\nfield double[2147483647] x\nend\n"
                     "pod a\nfield double[4000] x\nend\n"
                     "pod b\nfield a[4000] x\nend\n"
                     "pod c\nfield b[4000] x\nend\n"
                     "struct s\nfield double[2147483647] x\nfield double[2147483647,2147483647,2147483647] y\n"
                     "field n z\nfield c w\nfield c[2147483647] v\nfield a u\nend\n"},
                    RobdefMode::strict));
  for (const auto& member : types.find_entity("test.huge.s")->members) {
    INFO(member.name);
    CHECK(default_value(member.type, types).is_null() == (member.name != "u"));
  }
}
