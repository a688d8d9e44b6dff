#include "core/types/value_size.hpp"

#include <catch2/catch.hpp>

using namespace rr;

TEST_CASE("a value takes what it holds, wherever that is") {
  const auto beside = [](const Value& value) { return held_bytes(value) - sizeof(Value); };
  CHECK(beside(Value()) == 0);
  CHECK(beside(Value(1.5)) == 0);
  CHECK(beside(Value(std::string_view("text"))) == 4);
  CHECK(beside(Value(std::vector<double>(100))) == 800);
  const Value numbers(std::vector<std::uint8_t>(5000));
  CHECK(beside(Value(MultiDimArray{{50, 100}, *numbers.get_if<Array>()})) == 5000);
  CHECK(beside(Value(NamedArray{"com.x.Point", *numbers.get_if<Array>()})) == 5000);
  const Structure pose{"com.x.Pose", {{"data", numbers}, {"none", Value()}}};
  const auto one = beside(Value(pose));
  CHECK(one > 5000 + 2 * sizeof(Value));
  CHECK(one < 5500);
  CHECK(beside(Value(PodArray{"com.x.Pose", {pose, pose}})) == 2 * one);
  CHECK(beside(Value(List{{Value(pose), numbers}})) == one + 5000 + 2 * sizeof(Value));
  CHECK(beside(Value(MapInt32{{{1, numbers}, {2, Value()}}})) > 5000 + 2 * sizeof(Value));
  CHECK(beside(Value(MapString{{{std::string(100, 'x'), numbers}}})) > 5100);
}
