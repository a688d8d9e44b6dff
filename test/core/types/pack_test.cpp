// What pack() takes, converts and refuses. Bytes are the business of pack_vectors_test and round_trip_test.
#include "core/types/pack.hpp"

#include <catch2/catch.hpp>

#include "test/core/types/fixture.hpp"
#include "test/core/types/show_result.hpp"

using namespace rr;
using namespace rr::test;

namespace {

const TypeDefinition& every(std::string_view field) {
  return field_type("test.types.every", field);
}

Value point3(double x, double y, double z) {
  return Structure{"test.types.point3", {{"x", x}, {"y", y}, {"z", z}}};
}
Structure point(std::int32_t id, double value) {
  return {"", {{"id", id}, {"value", value}}};
}
Array doubles(std::vector<double> items) {
  return Array::take(std::move(items));
}

/// `text` goes on where "pack 'value" ends: "[1].x (test.types.point3): is missing".
void check_refused(const Value& value, const TypeDefinition& type, ErrorCode code, const std::string& text) {
  const auto error = pack_error(value, type);
  CHECK(error.message == "pack 'value" + std::string(text).insert(text.find_first_of(": "), "'"));
  CHECK(static_cast<int>(error.code) == static_cast<int>(code));
}

/// Packs and gives the message, for a look at the elements.
/// A packed value; it is kept, because the message borrows from it.
struct Packed {
  Packed(Value given, const TypeDefinition& type) : value(std::move(given)) {
    message.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
    const auto packed = pack(message, "value", value, type, test_types());
    if (!packed) FAIL(packed.error().message);
  }
  const MessageElement& element() const { return message.elements.at(0); }
  Value value;
  Message message;
};

}  // namespace

TEST_CASE("numbers convert to the declared type where they fit") {
  CHECK(round_trip(std::int32_t{5}, every("i16")).value() == Value(std::int16_t{5}));
  CHECK(round_trip(std::int32_t{5}, every("u8")).value() == Value(std::uint8_t{5}));
  CHECK(round_trip(std::int32_t{5}, every("d")).value() == Value(5.0));
  CHECK(round_trip(5.0, every("i64")).value() == Value(std::int64_t{5}));
  CHECK(round_trip(0.5, every("cd")).value() == Value(CDouble(0.5, 0)));
  CHECK(round_trip(std::uint8_t{1}, every("m")).value() == Value(std::int32_t{1}));
  CHECK(round_trip(std::int32_t{-7}, every("m")).value() == Value(std::int32_t{-7}));
}

TEST_CASE("numbers that do not fit are refused") {
  check_refused(std::int32_t{300}, every("u8"), ErrorCode::out_of_range, ": int32 300 does not fit uint8");
  check_refused(std::int64_t{1} << 40, every("m"), ErrorCode::out_of_range, ": int64 1099511627776 does not fit int32");
  check_refused(1.5, every("i32"), ErrorCode::data_type_mismatch, ": found double 1.5, expected int32");
  check_refused(true, every("i32"), ErrorCode::data_type_mismatch, ": found bool true, expected int32");
  check_refused(std::int32_t{1}, every("b"), ErrorCode::data_type_mismatch, ": found int32 1, expected bool");
  check_refused("5", every("i32"), ErrorCode::data_type_mismatch, ": found string, expected int32");
  check_refused(std::vector<double>{1}, every("d"), ErrorCode::data_type_mismatch, ": found double[], expected double");
}

TEST_CASE("null is for structures, lists, maps and varvalues") {
  for (const auto* field : {"p3", "p3s", "p3_by_number", "p3_by_name", "any", "anys", "ps_list"}) {
    INFO(field);
    CHECK(Packed({}, every(field)).element().type == DataType::void_t);
    CHECK(round_trip({}, every(field)).value().is_null());
  }
  check_refused({}, every("d"), ErrorCode::null_value, ": is null, expected double");
  check_refused({}, every("m"), ErrorCode::null_value, ": is null, expected int32");
  check_refused({}, every("text"), ErrorCode::null_value, ": is null, expected string");
  check_refused({}, every("f3"), ErrorCode::null_value, ": is null, expected int32[3]");
  check_refused({}, every("grid"), ErrorCode::null_value, ": is null, expected double[*]");
  check_refused({}, every("p"), ErrorCode::null_value, ": is null, expected point");
  check_refused({}, every("ps"), ErrorCode::null_value, ": is null, expected point[]");
  check_refused({}, every("vs"), ErrorCode::null_value, ": is null, expected vec3[]");
  check_refused(List{{Value("a"), {}}}, every("texts"), ErrorCode::null_value, "[1]: is null, expected string");
}

TEST_CASE("arrays have the declared item type and length") {
  CHECK(round_trip(std::vector<std::int32_t>{1, 2, 3}, every("f3")));
  CHECK(round_trip(std::vector<std::int32_t>{}, every("m3")));
  check_refused(std::vector<std::int32_t>{1, 2}, every("f3"), ErrorCode::data_type_error,
                ": has 2, expected 3 (int32[3])");
  check_refused(std::vector<std::int32_t>{1, 2, 3, 4}, every("m3"), ErrorCode::data_type_error,
                ": has 4, expected at most 3 (int32[3-])");
  check_refused(std::vector<std::int32_t>{1}, every("ds"), ErrorCode::data_type_mismatch,
                ": found int32[], expected double[]");
  check_refused(1.0, every("ds"), ErrorCode::data_type_mismatch, ": found double, expected double[]");
  const Packed empty(std::vector<std::int32_t>{}, every("ds"));
  CHECK(empty.element().type == DataType::double_t);
  CHECK(empty.element().count == 0);
  CHECK(round_trip(Array(), every("ds")).value() == Value(Array::empty(DataType::double_t)));
}

TEST_CASE("multi-dim arrays have dims that match") {
  CHECK(round_trip(MultiDimArray{{3, 1}, doubles({1, 2, 3})}, every("grid")));
  CHECK(round_trip(MultiDimArray{{2, 3}, Array::take(std::vector<std::int16_t>(6))}, every("grid23")));
  check_refused(MultiDimArray{{2, 2}, doubles({1, 2, 3})}, every("grid"), ErrorCode::data_type_error,
                ": dims [2,2] do not match 3 items");
  check_refused(MultiDimArray{{0x80000000, 0x80000000, 4}, doubles({})}, every("grid"), ErrorCode::data_type_error,
                ": dims [2147483648,2147483648,4] do not match 0 items");
  check_refused(MultiDimArray{{3, 2}, Array::take(std::vector<std::int16_t>(6))}, every("grid23"),
                ErrorCode::data_type_error, ": has dims [3,2], expected int16[2,3]");
  check_refused(MultiDimArray{{1}, doubles({1})}, every("grid23"), ErrorCode::data_type_mismatch,
                ": found double[*], expected int16[2,3]");
  check_refused(doubles({1}), every("grid"), ErrorCode::data_type_mismatch, ": found double[], expected double[*]");
}

TEST_CASE("structures give all fields, in any order, and no others") {
  const auto& type = every("p3");
  CHECK(round_trip(Structure{"", {{"z", 3.0}, {"x", 1.0}, {"y", std::int32_t{2}}}}, type).value() == point3(1, 2, 3));
  const Packed packed(Structure{"", {{"z", 3.0}, {"x", 1.0}, {"y", 2.0}}}, type);
  CHECK(packed.message.elements[1].name == "x");
  CHECK(packed.message.elements[3].name == "z");

  check_refused(Structure{"", {{"x", 1.0}, {"y", 2.0}}}, type, ErrorCode::data_type_error,
                ".z (test.types.point3): is missing, expected double");
  check_refused(Structure{"", {{"x", 1.0}, {"y", 2.0}, {"zz", 3.0}}}, type, ErrorCode::data_type_error,
                ".z (test.types.point3): is missing, expected double");
  check_refused(Structure{"", {{"x", 1.0}, {"y", 2.0}, {"z", 3.0}, {"w", 4.0}}}, type, ErrorCode::data_type_error,
                ".w (test.types.point3): is not a field of the type");
  check_refused(Structure{"", {{"x", 1.0}, {"y", 2.0}, {"z", 3.0}, {"x", 4.0}}}, type, ErrorCode::data_type_error,
                ".x (test.types.point3): is there twice");
  check_refused(Structure{"test.types.tree", {}}, type, ErrorCode::data_type_error,
                ": found type 'test.types.tree', expected test.types.point3");
  check_refused(List{}, type, ErrorCode::data_type_mismatch, ": found list, expected point3");
  check_refused(List{{point3(1, 2, 3), Structure{"", {{"x", "1"}, {"y", 2.0}, {"z", 3.0}}}}}, every("p3s"),
                ErrorCode::data_type_mismatch, "[1].x (test.types.point3): found string, expected double");
}

TEST_CASE("a path leads through lists and maps") {
  check_refused(MapInt32{{{-3, Value(1.0)}}}, every("p3_by_number"), ErrorCode::data_type_mismatch,
                "[-3]: found double, expected point3");
  check_refused(MapString{{{"k", point3(1, 2, 3)}, {"l", Value(1.0)}}}, every("p3_by_name"),
                ErrorCode::data_type_mismatch, "['l']: found double, expected point3");
  check_refused(MapString{}, every("p3_by_number"), ErrorCode::data_type_mismatch,
                ": found map{string}, expected map{int32}");
  check_refused(MapInt32{}, every("p3_by_name"), ErrorCode::data_type_mismatch,
                ": found map{int32}, expected map{string}");
  check_refused(MapInt32{}, every("p3s"), ErrorCode::data_type_mismatch, ": found map{int32}, expected list");
}

TEST_CASE("maps are written in ascending order of keys, each once") {
  const Packed numbers(MapInt32{{{5, 1.0}, {-7, 2.0}, {0, 3.0}}}, every("ds_by_number"));
  CHECK(numbers.message.elements[1].number == -7);
  CHECK(numbers.message.elements[2].number == 0);
  CHECK(numbers.message.elements[3].number == 5);
  const Packed texts(MapString{{{"\xc3\xa4", {}}, {"b", {}}, {"a", {}}}}, every("p3_by_name"));
  CHECK(texts.message.elements[1].name == "a");
  CHECK(texts.message.elements[2].name == "b");
  CHECK(texts.message.elements[3].name == "\xc3\xa4");
  check_refused(MapInt32{{{5, 1.0}, {5, 2.0}}}, every("ds_by_number"), ErrorCode::data_type_error,
                "[5]: the key is there twice");
  check_refused(MapString{{{"b", {}}, {"a", {}}, {"b", {}}}}, every("p3_by_name"), ErrorCode::data_type_error,
                "['b']: the key is there twice");
}

TEST_CASE("pods are packed as declared") {
  const PodArray two{"test.types.point", {point(1, 1), point(2, 2)}};
  CHECK(round_trip(two, every("ps")));
  CHECK(round_trip(two, every("p2")));
  CHECK(round_trip(point(1, 1), every("p")).value().get_if<PodArray>()->is_scalar);
  CHECK(round_trip(PodArray{"", {point(1, 1)}, {}, true}, every("p")));
  check_refused(two, every("p"), ErrorCode::data_type_error, ": has 2, expected 1 (point)");
  check_refused(PodArray{"", {point(1, 1)}}, every("p2"), ErrorCode::data_type_error, ": has 1, expected 2 (point[2])");
  check_refused(PodArray{"", std::vector<Structure>(3, point(1, 1))}, every("pm"), ErrorCode::data_type_error,
                ": has 3, expected at most 2 (point[2-])");
  check_refused(two, every("pgrid"), ErrorCode::data_type_mismatch, ": found test.types.point[], expected point[*]");
  check_refused(PodArray{"", {point(1, 1)}, {2, 2}, false, true}, every("pgrid"), ErrorCode::data_type_error,
                ": has 1 with dims [2,2], expected point[*]");
  check_refused(PodArray{"", {point(1, 1), point(1, 1)}, {1, 2}, false, true}, every("pgrid21"),
                ErrorCode::data_type_error, ": has 2 with dims [1,2], expected point[2,1]");
  check_refused(PodArray{"", {point(1, 1), {"", {{"id", 1.0}}}}}, every("ps"), ErrorCode::data_type_error,
                "[1].value (test.types.point): is missing, expected single");
  check_refused(PodArray{"", {point(100000, 1)}}, every("ps"), ErrorCode::out_of_range,
                "[0].id (test.types.point): int32 100000 does not fit int16");
  check_refused(PodArray{"test.types.shape", {}}, every("ps"), ErrorCode::data_type_error,
                ": found type 'test.types.shape', expected test.types.point");
  check_refused(point(1, 1), every("ps"), ErrorCode::data_type_mismatch, ": found unnamed structure, expected point[]");
}

TEST_CASE("fields of pods are packed as declared") {
  auto shape = *default_value(every("sh"), test_types()).get_if<PodArray>();
  const auto set = [&](std::string_view name, Value value) {
    for (auto& field : shape.items[0].fields)
      if (field.name == name) field.value = std::move(value);
  };
  SECTION("a fixed array") {
    set("f2", doubles({1}));
    check_refused(shape, every("sh"), ErrorCode::data_type_error,
                  "[0].f2 (test.types.shape): has 1, expected 2 (double[2])");
  }
  SECTION("a multi-dim array") {
    set("grid", MultiDimArray{{3, 2}, Array::take(std::vector<std::int16_t>(6))});
    check_refused(shape, every("sh"), ErrorCode::data_type_error,
                  "[0].grid (test.types.shape): has dims [3,2], expected int16[2,3]");
  }
  SECTION("a multi-dim array whose dims are right but not its length") {
    set("grid", MultiDimArray{{2, 3}, Array::take(std::vector<std::int16_t>(5))});
    check_refused(shape, every("sh"), ErrorCode::data_type_error,
                  "[0].grid (test.types.shape): has 5, expected 6 (int16[2,3])");
  }
  SECTION("a multi-dim array of named arrays") {
    set("vgrid", NamedArray{"", doubles({1, 2, 3}), {1, 1}, false, true});
    check_refused(shape, every("sh"), ErrorCode::data_type_error,
                  "[0].vgrid (test.types.shape): has 1 with dims [1,1], expected vec3[1,2]");
  }
}

TEST_CASE("named arrays are packed as declared") {
  CHECK(round_trip(NamedArray{"", doubles({1, 2, 3})}, every("v")).value() ==
        NamedArray{"test.types.vec3", doubles({1, 2, 3}), {}, true});
  CHECK(round_trip(NamedArray{"test.types.transform", doubles({1, 2, 3, 4, 5, 6, 7})}, every("t")));
  CHECK(round_trip(NamedArray{"", Array::take(std::vector<bool>{true, false, true})}, every("fl")));
  const Packed empty(NamedArray{}, every("vs"));
  CHECK(empty.message.elements[1].type == DataType::double_t);
  check_refused(NamedArray{"", doubles({1, 2, 3, 4})}, every("v"), ErrorCode::data_type_error,
                ": has 4 numbers, expected a multiple of 3");
  check_refused(NamedArray{"", doubles({1, 2, 3, 4, 5, 6})}, every("v"), ErrorCode::data_type_error,
                ": has 2, expected 1 (vec3)");
  check_refused(NamedArray{"", Array::take(std::vector<float>{1, 2, 3})}, every("v"), ErrorCode::data_type_mismatch,
                ": found single numbers, expected double");
  check_refused(NamedArray{"", doubles({1, 2, 3}), {2}, false, true}, every("vgrid"), ErrorCode::data_type_error,
                ": has 1 with dims [2], expected vec3[*]");
  check_refused(NamedArray{"test.types.transform", doubles({1, 2, 3})}, every("v"), ErrorCode::data_type_error,
                ": found type 'test.types.transform', expected test.types.vec3");
  check_refused(doubles({1, 2, 3}), every("v"), ErrorCode::data_type_mismatch, ": found double[], expected vec3");
}

TEST_CASE("a varvalue decides its own type") {
  const auto& any = every("any");
  CHECK(round_trip(1.5, any).value() == Value(std::vector<double>{1.5}));
  CHECK(round_trip("text", any).value() == Value("text"));
  CHECK(round_trip(point3(1, 2, 3), any).value() == point3(1, 2, 3));
  CHECK(round_trip(Structure{"test.types.point", point(1, 2).fields}, any).value() ==
        PodArray{"test.types.point", {{"", {{"id", std::int16_t{1}}, {"value", 2.0f}}}}});
  CHECK(round_trip(List{{Value("a"), Value(List{}), Value()}}, any).value() ==
        List{{Value("a"), Value(List{}), Value()}});
  check_refused(point3(1, 2, 3).get_if<Structure>()->fields.empty() ? Value() : Value(Structure{"", {}}), any,
                ErrorCode::data_type_error, ": type '' is not known");
  check_refused(Structure{"test.types.other", {}}, any, ErrorCode::data_type_error,
                ": type 'test.types.other' is not known");
  check_refused(Structure{"test.types.vec3", {}}, any, ErrorCode::data_type_mismatch,
                ": test.types.vec3 is another kind of type than the value");
  check_refused(PodArray{"test.types.point3", {}}, any, ErrorCode::data_type_mismatch,
                ": test.types.point3 is another kind of type than the value");
  check_refused(Array(), any, ErrorCode::data_type_error, ": array without a number type");
  check_refused(Scalar{DataType::list_t}, any, ErrorCode::data_type_error, ": number without a number type");
  check_refused(MapString{{{"k", List{{NamedArray{"test.types.vec3", doubles({1})}}}}}}, any,
                ErrorCode::data_type_error, "['k'][0]: has 1 numbers, expected a multiple of 3");
}

TEST_CASE("nesting is limited to what a decoder accepts") {
  const auto nested = [](int levels) {
    Value value("innermost");
    for (int i = 1; i < levels; ++i) {
      List list;
      list.items.push_back(std::move(value));
      value = std::move(list);
    }
    return value;
  };
  CHECK(round_trip(nested(128), every("any")).value() == nested(128));
  const auto error = pack_error(nested(129), every("any"));
  CHECK(error.code == ErrorCode::data_type_error);
  CHECK(error.message.find("nested deeper than 128 levels") != std::string::npos);
}

TEST_CASE("types that no value has are refused") {
  check_refused(1.0, type_of(DataType::varobject_t), ErrorCode::data_type_error,
                ": varobject is not the type of a value");
  auto unknown = type_of(DataType::structure_t);
  unknown.qualified_name = "test.types.other";
  check_refused(Structure{}, unknown, ErrorCode::data_type_error, ": type 'test.types.other' is not known");
}

TEST_CASE("an element is keyed by name or by number") {
  Message message;
  message.begin_entry(EntryType::pipe_packet, "svc", "p1", 0);
  REQUIRE(pack(message, 7, Value(1.0), every("d"), test_types()));
  REQUIRE(pack_varvalue(message, "packet", Value("x"), test_types()));
  CHECK(message.elements[0].key_kind == KeyKind::number);
  CHECK(message.elements[0].number == 7);
  CHECK(message.elements[1].name == "packet");
  const auto error = pack(message, 8, Value("x"), every("d"), test_types());
  REQUIRE_FALSE(error);
  CHECK(error.error().message == "pack '[8]': found string, expected double");
}

TEST_CASE("payloads that an encoder references outlive the value") {
  EncodedMessage encoded;
  Bytes expected;
  {
    Message message;
    message.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
    auto value = std::make_unique<Value>(MapString{{
        {"array", Value(std::vector<double>(1000, 1.5))},
        {"dims", Value(MultiDimArray{std::vector<std::uint32_t>(2000, 1), doubles({1})})},
        {"text", Value(std::string(10000, 'x'))},
    }});
    REQUIRE(pack(message, "value", *value, every("any"), test_types()));
    REQUIRE(encode(message, {}, encoded));
    expected = encoded.to_bytes();
    value.reset();
  }
  CHECK(encoded.slices().size() > 3);
  CHECK(encoded.to_bytes() == expected);
}
