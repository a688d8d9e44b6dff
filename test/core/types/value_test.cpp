#include "core/types/value.hpp"

#include <catch2/catch.hpp>

#include "test/core/types/show_result.hpp"

using namespace rr;

TEST_CASE("a scalar compares by type and bytes") {
  CHECK(Scalar::of(std::int32_t{5}) == Scalar::of(std::int32_t{5}));
  CHECK_FALSE(Scalar::of(std::int32_t{5}) == Scalar::of(std::uint32_t{5}));
  CHECK_FALSE(Scalar::of(1.0) == Scalar::of(2.0));
  CHECK(Scalar::of(CDouble(1, -2)).bytes().size() == 16);
}

TEST_CASE("bools read from bytes become 0 or 1") {
  const std::uint8_t bytes[] = {0, 2, 255};
  CHECK(Scalar::from_bytes(DataType::bool_t, ByteSpan(bytes).subspan(1)) == Scalar::of(true));
  const auto array = Array::copy(DataType::bool_t, bytes);
  CHECK(array.bytes()[0] == 0);
  CHECK(array.bytes()[1] == 1);
  CHECK(array.bytes()[2] == 1);
}

TEST_CASE("an array takes a vector over without copying, and copies share the payload") {
  std::vector<double> items{1, 2, 3};
  const auto* data = items.data();
  const auto array = Array::take(std::move(items));
  CHECK(array.items<double>().data() == data);
  CHECK(array.size() == 3);
  const auto other = array;
  CHECK(other.items<double>().data() == data);
  CHECK(array.items<float>().empty());
}

TEST_CASE("an array of bools is made from std::vector<bool>") {
  const Value value(std::vector<bool>{true, false});
  const auto items = value.to_items<bool>();
  REQUIRE(items);
  CHECK(items->size() == 2);
  CHECK((*items)[0]);
  CHECK_FALSE((*items)[1]);
}

TEST_CASE("an array copies bytes of any alignment to an aligned payload") {
  std::vector<std::uint8_t> bytes(1 + 16);
  const double numbers[] = {1.5, -2.5};
  std::memcpy(bytes.data() + 1, numbers, 16);
  const auto array = Array::copy(DataType::double_t, ByteSpan(bytes).subspan(1));
  CHECK(reinterpret_cast<std::uintptr_t>(array.bytes().data()) % alignof(double) == 0);
  CHECK(array == Array::take(std::vector<double>{1.5, -2.5}));
  CHECK(Array::empty(DataType::double_t) == Array::copy(DataType::double_t, {}));
  CHECK_FALSE(Array::empty(DataType::double_t) == Array::empty(DataType::single_t));
}

TEST_CASE("maps are equal whatever the order of their items") {
  const MapString left{{{"a", 1.0}, {"b", 2.0}}};
  CHECK(left == MapString{{{"b", 2.0}, {"a", 1.0}}});
  CHECK_FALSE(left == MapString{{{"b", 1.0}, {"a", 2.0}}});
  CHECK_FALSE(left == MapString{{{"a", 1.0}}});
  CHECK(MapInt32{{{1, "x"}, {-1, "y"}}} == MapInt32{{{-1, "y"}, {1, "x"}}});
  REQUIRE(left.find("b"));
  CHECK(*left.find("b") == Value(2.0));
  CHECK_FALSE(left.find("c"));
}

TEST_CASE("structures compare by name, fields and their order") {
  const Structure left{"a.S", {{"x", 1.0}, {"y", "t"}}};
  CHECK(left == Structure{"a.S", {{"x", 1.0}, {"y", "t"}}});
  CHECK_FALSE(left == Structure{"a.T", {{"x", 1.0}, {"y", "t"}}});
  CHECK_FALSE(left == Structure{"a.S", {{"x", 1.0}, {"y", {}}}});
  REQUIRE(left.find("y"));
  CHECK(*left.find("y") == Value("t"));
}

TEST_CASE("a number is read as any type that holds it") {
  CHECK(Value(std::int32_t{5}).to<std::uint8_t>().value() == 5);
  CHECK(Value(std::int32_t{5}).to<double>().value() == 5.0);
  CHECK(Value(std::vector<std::int16_t>{-3}).to<std::int64_t>().value() == -3);
  CHECK(Value(2.0).to<CDouble>().value() == CDouble(2, 0));
  CHECK(Value(true).to<bool>().value());

  const auto too_large = Value(std::int32_t{300}).to<std::uint8_t>();
  REQUIRE_FALSE(too_large);
  CHECK(too_large.error().code == ErrorCode::out_of_range);
  CHECK(too_large.error().message == "int32 300 does not fit uint8");

  const auto fraction = Value(1.5).to<std::int32_t>();
  REQUIRE_FALSE(fraction);
  CHECK(fraction.error().code == ErrorCode::data_type_mismatch);
  CHECK(fraction.error().message == "found double 1.5, expected int32");

  CHECK(Value(std::vector<double>{1, 2}).to<double>().error().message == "found double[], expected double");
  CHECK(Value().to<double>().error().message == "found null, expected double");
}

TEST_CASE("text and items are read as they are") {
  CHECK(Value("abc").to_text().value() == "abc");
  CHECK(Value(1.0).to_text().error().code == ErrorCode::data_type_mismatch);
  CHECK(Value(7.5).to_items<double>().value()[0] == 7.5);
  CHECK(Value(7.5).to_items<float>().error().message == "found double, expected single[]");
}

TEST_CASE("a value names its type") {
  CHECK(Value().type_text() == "null");
  CHECK(Value(std::uint64_t{1}).type_text() == "uint64");
  CHECK(Value(std::vector<float>{1}).type_text() == "single[]");
  CHECK(Value(MultiDimArray{{1, 1}, Array::take(std::vector<float>{1})}).type_text() == "single[*]");
  CHECK(Value("x").type_text() == "string");
  CHECK(Value(Structure{"a.S", {}}).type_text() == "a.S");
  CHECK(Value(PodArray{"a.P", {}, {}, true}).type_text() == "a.P");
  CHECK(Value(NamedArray{"a.N", {}}).type_text() == "a.N[]");
  CHECK(Value(List{}).type_text() == "list");
  CHECK(Value(MapInt32{}).type_text() == "map{int32}");
  CHECK(Value(MapString{}).type_text() == "map{string}");
}
