// C++ types of generated code <-> Value, where the peer's definition is another one.
#include <catch2/catch.hpp>

#include "node/values/typed_value.hpp"
#include "test__words.hpp"

using namespace rr;
using namespace test::words;
using Catch::Matchers::Contains;

TEST_CASE("typed values refuse what is of another type, and name the field") {
  CHECK_THROWS_AS(unpack_value<double>(Value("text")), Exception);
  CHECK_THROWS_AS(unpack_value<std::string>(Value(1.0)), Exception);
  CHECK_THROWS_AS(unpack_value<std::vector<double>>(Value(std::vector<std::int32_t>{1})), Exception);
  CHECK_THROWS_WITH((unpack_value<std::array<double, 3>>(Value(std::vector<double>{1, 2}))), Contains("array of 3"));
  CHECK_THROWS_AS(unpack_value<MultiDim<double>>(Value(std::vector<double>{1})), Exception);
  CHECK_THROWS_AS(unpack_value<Nullable<std::vector<double>>>(Value(1.0)), Exception);
  CHECK_THROWS_AS((unpack_value<Nullable<std::map<std::string, double>>>(Value(MapInt32{}))), Exception);
  CHECK_THROWS_AS(unpack_value<Nullable<more::Shared>>(Value(1.0)), Exception);
  CHECK_THROWS_AS(unpack_value<template_>(Value(PodArray{})), Exception);
  CHECK_THROWS_AS(unpack_value<template_>(Value()), Exception);
  const NamedArray short_one{"test.words.union", Array::take(std::vector<double>{1, 2}), {}, true};
  CHECK_THROWS_AS(unpack_value<union_>(Value(short_one)), Exception);
  const NamedArray other_numbers{"test.words.union", Array::take(std::vector<float>{1, 2, 3, 4, 5, 6}), {}, true};
  CHECK_THROWS_AS(unpack_value<union_>(Value(other_numbers)), Exception);

  const Structure empty{"test.words.more.Shared", {}};
  CHECK_THROWS_WITH(unpack_value<Nullable<more::Shared>>(Value(empty)), Contains("field 'number' is missing"));
  const Structure wrong{"test.words.more.Shared", {{"number", "five"}}};
  CHECK_THROWS_WITH(unpack_value<Nullable<more::Shared>>(Value(wrong)), Contains("field 'number': "));
}

TEST_CASE("a nullable value is a value: copies are of their own") {
  Nullable<more::Shared> one = more::Shared{1};
  auto two = one;
  two->number = 2;
  CHECK(one->number == 1);
  CHECK_FALSE(one == two);
  one = two;
  CHECK(one == two);
  CHECK_FALSE(one == Nullable<more::Shared>());
  CHECK(Nullable<more::Shared>(nullptr) == Nullable<more::Shared>());
}

TEST_CASE("arrays are handed over without a copy") {
  std::vector<double> numbers(1000);
  const void* payload = numbers.data();
  const Value value = pack_value(std::move(numbers));
  CHECK(static_cast<const void*>(value.get_if<Array>()->bytes().data()) == payload);
  switch_ structure;
  structure.complex_array.resize(1000);
  payload = structure.complex_array.data();
  const Value packed = pack_value(Nullable<switch_>(std::move(structure)));
  const auto* items = packed.get_if<Structure>()->find("complex_array")->get_if<Array>();
  CHECK(static_cast<const void*>(items->bytes().data()) == payload);
}
