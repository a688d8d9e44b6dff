// What unpack() accepts and refuses: spec section 9, rules 6..11.
#include <catch2/catch.hpp>

#include "core/types/pack.hpp"
#include "test/core/types/fixture.hpp"
#include "test/core/types/show_result.hpp"

using namespace rr;
using namespace rr::test;

namespace {

const TypeDefinition& every(std::string_view field) {
  return field_type("test.types.every", field);
}

/// A message under construction whose first element is the value.
class Wire : public Message {
 public:
  Wire() { begin_entry(EntryType::property_get_res, "svc", "d1", 5); }
  template <class T>
  Wire& number(std::string_view name, std::vector<T> items) {
    add(name, data_type_of<T>(), static_cast<std::uint32_t>(items.size()), bytes_of(items));
    return *this;
  }
  template <class T>
  Wire& number(std::int32_t key, std::vector<T> items) {
    add_numbered(key, data_type_of<T>(), static_cast<std::uint32_t>(items.size()), bytes_of(items));
    return *this;
  }
  Wire& text(std::string_view name, std::string_view content) {
    add_text(name, content);
    return *this;
  }
  Wire& null(std::string_view name) {
    add(name, DataType::void_t, 0, {});
    return *this;
  }
  Wire& open(std::string_view name, DataType type, std::string_view type_name = {}) {
    begin_nested(name, type, type_name);
    return *this;
  }
  Wire& open(std::int32_t key, DataType type, std::string_view type_name = {}) {
    begin_nested_numbered(key, type, type_name);
    return *this;
  }
  Wire& close() {
    end_nested();
    return *this;
  }
  Result<Value> as(const TypeDefinition& type) const { return unpack(*this, elements.at(0), type, test_types()); }

 private:
  template <class T>
  ByteSpan bytes_of(const std::vector<T>& items) {
    if constexpr (std::is_same_v<T, bool>) {
      return store(ByteSpan(Bytes(items.begin(), items.end())));
    } else {
      return store(ByteSpan(reinterpret_cast<const std::uint8_t*>(items.data()), items.size() * sizeof(T)));
    }
  }
};

/// `text` goes on where "unpack 'value" ends: "[1].x (test.types.point3): is missing".
void check_refused(const Wire& wire, const TypeDefinition& type, ErrorCode code, const std::string& text) {
  const auto value = wire.as(type);
  REQUIRE_FALSE(value);
  CHECK(value.error().message == "unpack 'value" + std::string(text).insert(text.find_first_of(": "), "'"));
  CHECK(static_cast<int>(value.error().code) == static_cast<int>(code));
}

using Doubles = std::vector<double>;
using Int32s = std::vector<std::int32_t>;
using Uint32s = std::vector<std::uint32_t>;

}  // namespace

TEST_CASE("void where a value must be: NullValue, for string and single pods and named arrays DataTypeError") {
  for (const auto* field : {"p3", "p3s", "p3_by_number", "p3_by_name", "any", "anys"}) {
    INFO(field);
    CHECK(Wire().null("value").as(every(field)).value().is_null());
  }
  const auto code_of = [](const char* field) { return Wire().null("value").as(every(field)).error().code; };
  for (const auto* field : {"d", "b", "m", "ds", "f3", "grid", "grid23", "ps", "p2", "pgrid", "vs", "vgrid"}) {
    INFO(field);
    CHECK(code_of(field) == ErrorCode::null_value);
  }
  for (const auto* field : {"text", "p", "v"}) {
    INFO(field);
    CHECK(code_of(field) == ErrorCode::data_type_error);
  }
  check_refused(Wire().null("value"), every("f3"), ErrorCode::null_value, ": is null, expected int32[3]");
}

TEST_CASE("another element type is a DataTypeMismatch") {
  const auto mismatch = ErrorCode::data_type_mismatch;
  check_refused(Wire().number<std::int32_t>("value", {1, 2}), every("d"), mismatch,
                ": found int32[2], expected double");
  check_refused(Wire().text("value", "x"), every("d"), mismatch, ": found string, expected double");
  check_refused(Wire().number<double>("value", {1}), every("m"), mismatch, ": found double[1], expected mode");
  check_refused(Wire().number<double>("value", {1}), every("text"), mismatch, ": found double[1], expected string");
  check_refused(Wire().number<float>("value", {1}), every("ds"), mismatch, ": found single[1], expected double[]");
  check_refused(Wire().number<double>("value", {1}), every("grid"), mismatch, ": found double[1], expected double[*]");
  check_refused(Wire().number<double>("value", {1}), every("texts"), mismatch, ": found double[1], expected list");
  check_refused(Wire().open("value", DataType::list_t), every("ds_by_number"), mismatch,
                ": found list, expected vector");
  check_refused(Wire().open("value", DataType::map_int32_t), every("blobs"), mismatch,
                ": found vector, expected dictionary");
  check_refused(Wire().open("value", DataType::pod_array_t, "test.types.point"), every("p3"), mismatch,
                ": found pod_array 'test.types.point', expected point3");
  check_refused(Wire().open("value", DataType::structure_t, "test.types.point"), every("p"), mismatch,
                ": found structure 'test.types.point', expected point");
  check_refused(Wire().open("value", DataType::pod_array_t, "test.types.point"), every("pgrid"), mismatch,
                ": found pod_array 'test.types.point', expected point[*]");
  check_refused(Wire().open("value", DataType::namedarray_multidimarray_t, "test.types.vec3"), every("vs"), mismatch,
                ": found namedarray_multidimarray 'test.types.vec3', expected vec3[]");
}

TEST_CASE("scalars take the first item and need one") {
  CHECK(Wire().number<double>("value", {1, 2, 3}).as(every("d")).value() == Value(1.0));
  CHECK(Wire().number<std::int32_t>("value", {77}).as(every("m")).value() == Value(std::int32_t{77}));
  check_refused(Wire().number<double>("value", {}), every("d"), ErrorCode::out_of_range, ": is empty, expected double");
  check_refused(Wire().number<std::int32_t>("value", {}), every("m"), ErrorCode::out_of_range,
                ": is empty, expected mode");
}

TEST_CASE("a bool byte above 1 is true") {
  Wire wire;
  const std::uint8_t bytes[] = {7, 0};
  wire.add("value", DataType::bool_t, 2, bytes);
  CHECK(wire.as(every("b")).value() == Value(true));
  CHECK(wire.as(every("bs")).value() == Value(std::vector<bool>{true, false}));
}

TEST_CASE("text is not checked for UTF-8") {
  CHECK(Wire().text("value", "\xff\xfe").as(every("text")).value() == Value("\xff\xfe"));
}

TEST_CASE("lengths are those that the type declares") {
  check_refused(Wire().number<std::int32_t>("value", {1, 2}), every("f3"), ErrorCode::data_type_error,
                ": has 2, expected 3 (int32[3])");
  check_refused(Wire().number<std::int32_t>("value", {1, 2, 3, 4}), every("m3"), ErrorCode::data_type_error,
                ": has 4, expected at most 3 (int32[3-])");
  CHECK(Wire().number<std::int32_t>("value", {}).as(every("m3")));
}

TEST_CASE("multi-dim arrays match their dims") {
  const auto multidim = [](Uint32s dims, Doubles items) {
    Wire wire;
    wire.open("value", DataType::multidimarray_t).number("dims", std::move(dims)).number("array", std::move(items));
    return wire;
  };
  CHECK(multidim({2, 1}, {1, 2}).as(every("grid")).value() == MultiDimArray{{2, 1}, Array::take(Doubles{1, 2})});
  CHECK(multidim({}, {1}).as(every("grid")));
  check_refused(multidim({2, 2}, {1, 2}), every("grid"), ErrorCode::data_type_error,
                ": dims [2,2] do not match 2 items");
  check_refused(multidim({0x80000000, 0x80000000, 4}, {}), every("grid"), ErrorCode::data_type_error,
                ": dims [2147483648,2147483648,4] do not match 0 items");
  check_refused(multidim({1}, {1}), every("grid23"), ErrorCode::data_type_mismatch,
                ".array: found double[1], expected int16[]");
  check_refused(Wire().open("value", DataType::multidimarray_t).number("array", Doubles{}), every("grid"),
                ErrorCode::message_element_not_found, ".dims: is missing");
  check_refused(Wire().open("value", DataType::multidimarray_t).number("dims", Uint32s{}), every("grid"),
                ErrorCode::message_element_not_found, ".array: is missing");
  check_refused(Wire().open("value", DataType::multidimarray_t).number("dims", Int32s{1}).number("array", Doubles{1}),
                every("grid"), ErrorCode::data_type_mismatch, ".dims: found int32[1], expected uint32[]");
  Wire turned;
  turned.open("value", DataType::multidimarray_t)
      .number("dims", Uint32s{3, 2})
      .number("array", std::vector<std::int16_t>(6));
  check_refused(turned, every("grid23"), ErrorCode::data_type_error, ": has dims [3,2], expected int16[2,3]");
}

TEST_CASE("fields are found by name, the first of a name, among others") {
  const Value expected = Structure{"test.types.point3", {{"x", 1.0}, {"y", 2.0}, {"z", 3.0}}};
  SECTION("in another order, with unknown ones") {
    Wire wire;
    wire.open("value", DataType::structure_t, "test.types.point3")
        .text("note", "unknown")
        .number("z", Doubles{3})
        .number(5, Doubles{9})
        .number("x", Doubles{1})
        .number("y", Doubles{2});
    CHECK(wire.as(every("p3")).value() == expected);
  }
  SECTION("a repeated one after the first") {
    Wire wire;
    wire.open("value", DataType::structure_t, "test.types.point3")
        .number("x", Doubles{1})
        .number("x", Doubles{9})
        .number("y", Doubles{2})
        .number("z", Doubles{3})
        .number("y", Doubles{9});
    CHECK(wire.as(every("p3")).value() == expected);
  }
  SECTION("a repeated one before the place where it is expected") {
    Wire wire;
    wire.open("value", DataType::structure_t, "test.types.point3")
        .number("y", Doubles{2})
        .number("x", Doubles{1})
        .number("y", Doubles{9})
        .number("z", Doubles{3});
    CHECK(wire.as(every("p3")).value() == expected);
  }
}

TEST_CASE("eight thousand fields in reverse order are found") {
  std::string text = "service test.many\nstdver 0.10\nstruct S\n";
  std::vector<std::string> names;
  for (int i = 0; i < 8000; ++i) {
    names.push_back("f" + std::to_string(i));
    text += "field uint8 " + names.back() + "\n";
  }
  TypeRegistry types;
  REQUIRE(types.add({text + "end\n"}, RobdefMode::strict));
  Wire wire;
  wire.open("value", DataType::structure_t, "test.many.S");
  for (auto name = names.rbegin(); name != names.rend(); ++name) wire.number(*name, std::vector<std::uint8_t>{1});
  auto type = type_of(DataType::structure_t);
  type.name = type.qualified_name = "test.many.S";
  const auto value = unpack(wire, wire.elements[0], type, types);
  REQUIRE(value);
  CHECK(value->get_if<Structure>()->fields.size() == 8000);
}

TEST_CASE("a missing field is named") {
  Wire wire;
  wire.open("value", DataType::structure_t, "test.types.point3").number("x", Doubles{1}).number("z", Doubles{3});
  check_refused(wire, every("p3"), ErrorCode::message_element_not_found,
                ".y (test.types.point3): is missing, expected double");
  check_refused(Wire().open("value", DataType::structure_t, "test.types.tree"), every("p3"), ErrorCode::data_type_error,
                ": found type 'test.types.tree', expected test.types.point3");
}

TEST_CASE("lists are numbered from 0") {
  CHECK(Wire().open("value", DataType::list_t).text("0", "a").text("1", "b").as(every("texts")).value() ==
        List{{Value("a"), Value("b")}});
  check_refused(Wire().open("value", DataType::list_t).text("0", "a").text("2", "b"), every("texts"),
                ErrorCode::data_type_error, "[1]: has the key 2, expected 1");
  check_refused(Wire().open("value", DataType::list_t).text("first", "a"), every("texts"), ErrorCode::data_type_error,
                "[0]: has the key 'first', expected an int32");
  check_refused(Wire().open("value", DataType::list_t).text("0", "a").number("1", Doubles{1}), every("texts"),
                ErrorCode::data_type_mismatch, "[1]: found double[1], expected string");
  check_refused(Wire().open("value", DataType::list_t).text("0", "a").null("1"), every("texts"),
                ErrorCode::data_type_error, "[1]: is null, expected string");
}

TEST_CASE("maps have unique keys and are read in ascending order") {
  const auto& by_number = every("ds_by_number");
  Wire wire;
  wire.open("value", DataType::map_int32_t)
      .number("7", Doubles{7})
      .number(-1, Doubles{-1})
      .number("-2147483648", Doubles{0});
  const auto value = wire.as(by_number);
  REQUIRE(value);
  const auto& items = value->get_if<MapInt32>()->items;
  REQUIRE(items.size() == 3);
  CHECK(items[0].first == -2147483647 - 1);
  CHECK(items[1].first == -1);
  CHECK(items[2].first == 7);

  check_refused(Wire().open("value", DataType::map_int32_t).number("7", Doubles{1}).number(7, Doubles{1}), by_number,
                ErrorCode::data_type_error, "[7]: the key is there twice");
  for (const auto* key : {"", "+1", " 1", "1 ", "1.0", "2147483648", "x"}) {
    INFO(key);
    CHECK(Wire().open("value", DataType::map_int32_t).number(key, Doubles{1}).as(by_number).error().code ==
          ErrorCode::data_type_error);
  }
  check_refused(Wire().open("value", DataType::map_string_t).null("b").null("a").null("b"), every("p3_by_name"),
                ErrorCode::data_type_error, "['b']: the key is there twice");
  check_refused(Wire().open("value", DataType::map_string_t).number(1, Doubles{1}), every("p3_by_name"),
                ErrorCode::data_type_error, ": has an element without a name, expected string keys");
}

TEST_CASE("an element without name and number is no list or map item") {
  Wire wire;
  wire.open("value", DataType::map_int32_t).number(1, Doubles{1});
  wire.elements[1].key_kind = KeyKind::none;
  check_refused(wire, every("ds_by_number"), ErrorCode::data_type_error, ": has the key '', expected an int32");
}

TEST_CASE("pods are numbered from 0 and typed") {
  const auto pods = [](std::int32_t first_key, std::string_view type_name = "test.types.point") {
    Wire wire;
    wire.open("value", DataType::pod_array_t, type_name);
    wire.open(first_key, DataType::pod_t)
        .number("value", std::vector<float>{1})
        .number("id", std::vector<std::int16_t>{2})
        .close();
    return wire;
  };
  CHECK(pods(0).as(every("p")).value() ==
        PodArray{"test.types.point", {{"", {{"id", std::int16_t{2}}, {"value", 1.0f}}}}, {}, true});
  CHECK(pods(0).as(every("ps")));
  check_refused(pods(1), every("ps"), ErrorCode::data_type_error, "[0]: has the key 1, expected 0");
  check_refused(pods(0, "test.types.shape"), every("ps"), ErrorCode::data_type_error,
                ": found type 'test.types.shape', expected test.types.point");
  check_refused(pods(0), every("p2"), ErrorCode::data_type_error, ": has 1, expected 2 (point[2])");
  check_refused(Wire().open("value", DataType::pod_array_t, "test.types.point"), every("p"), ErrorCode::data_type_error,
                ": has 0, expected 1 (point)");
  check_refused(Wire().open("value", DataType::pod_array_t, "test.types.point").number(0, Doubles{1}), every("ps"),
                ErrorCode::data_type_mismatch, "[0]: found double[1], expected pod");
  check_refused(Wire().open("value", DataType::pod_array_t, "test.types.point").open(0, DataType::pod_t), every("ps"),
                ErrorCode::message_element_not_found, "[0].id (test.types.point): is missing, expected int16");
}

TEST_CASE("multi-dim pods and named arrays check dims and the inner type name") {
  const auto grid = [](Uint32s dims, std::string_view inner) {
    Wire wire;
    wire.open("value", DataType::namedarray_multidimarray_t, "test.types.vec3").number("dims", std::move(dims));
    wire.open("array", DataType::namedarray_array_t, inner).number("array", Doubles{1, 2, 3, 4, 5, 6});
    return wire;
  };
  CHECK(grid({2, 1}, "test.types.vec3").as(every("vgrid")));
  CHECK(grid({1, 2}, "test.types.vec3").as(every("vgrid12")));
  check_refused(grid({2, 1}, "test.types.vec3"), every("vgrid12"), ErrorCode::data_type_error,
                ": has dims [2,1], expected vec3[1,2]");
  check_refused(grid({2, 2}, "test.types.vec3"), every("vgrid"), ErrorCode::data_type_error,
                ": dims [2,2] do not match 2 items");
  check_refused(grid({2, 1}, "test.types.transform"), every("vgrid"), ErrorCode::data_type_error,
                ": found type 'test.types.transform', expected test.types.vec3");
  Wire pods;
  pods.open("value", DataType::pod_multidimarray_t, "test.types.point").number("dims", Uint32s{1});
  pods.open("array", DataType::pod_array_t, "test.types.point");
  check_refused(pods, every("pgrid"), ErrorCode::data_type_error, ": dims [1] do not match 0 items");
}

TEST_CASE("named arrays hold a multiple of their numbers") {
  const auto named = [](Doubles items) {
    Wire wire;
    wire.open("value", DataType::namedarray_array_t, "test.types.vec3").number("array", std::move(items));
    return wire;
  };
  CHECK(named({1, 2, 3}).as(every("v")).value() ==
        NamedArray{"test.types.vec3", Array::take(Doubles{1, 2, 3}), {}, true});
  check_refused(named({1, 2, 3, 4}), every("vs"), ErrorCode::data_type_error,
                ": has 4 numbers, expected a multiple of 3");
  check_refused(named({1, 2, 3, 4, 5, 6}), every("v"), ErrorCode::data_type_error, ": has 2, expected 1 (vec3)");
  check_refused(named({}), every("v2"), ErrorCode::data_type_error, ": has 0, expected 2 (vec3[2])");
  check_refused(Wire().open("value", DataType::namedarray_array_t, "test.types.vec3"), every("v"),
                ErrorCode::message_element_not_found, ".array: is missing");
  check_refused(Wire()
                    .open("value", DataType::namedarray_array_t, "test.types.vec3")
                    .number("array", std::vector<float>{1, 2, 3}),
                every("v"), ErrorCode::data_type_mismatch, ".array: found single[3], expected double[]");
}

TEST_CASE("a varvalue is what its element is") {
  const auto& any = every("any");
  CHECK(Wire().number<double>("value", {1}).as(any).value() == Value(Doubles{1}));
  CHECK(Wire().number<double>("value", {}).as(any).value() == Value(Doubles{}));
  CHECK(Wire().text("value", "x").as(any).value() == Value("x"));
  check_refused(Wire().open("value", DataType::structure_t, "test.types.other"), any, ErrorCode::data_type_error,
                ": type 'test.types.other' is not known");
  check_refused(Wire().open("value", DataType::structure_t, "test.types.point"), any, ErrorCode::data_type_mismatch,
                ": found structure 'test.types.point', expected the kind of type that 'test.types.point' is");
  check_refused(Wire().open("value", DataType::pod_t), any, ErrorCode::data_type_mismatch,
                ": found pod, expected a value; a pod stands only in a pod array");
  check_refused(Wire().open("value", DataType::multidimarray_t).number("dims", Uint32s{0}).text("array", ""), any,
                ErrorCode::data_type_mismatch, ".array: found string, expected numbers");
  TypeRegistry no_types;
  Wire plain;
  plain.open("value", DataType::list_t).number(0, Int32s{4});
  CHECK(unpack_varvalue(plain, plain.elements[0], no_types).value() == List{{Value(Int32s{4})}});
}

TEST_CASE("no value: a void type reads anything") {
  const auto nothing = type_of(DataType::void_t);
  CHECK(Wire().number<std::int32_t>("value", {0}).as(nothing).value().is_null());
  CHECK(Wire().null("value").as(nothing).value().is_null());
  check_refused(Wire().number<double>("value", {0}), type_of(DataType::object_t), ErrorCode::data_type_error,
                ": object is not the type of a value");
}

TEST_CASE("names from a peer are quoted and cut in messages") {
  const std::string long_name(5000, 'n');
  Wire wire;
  wire.open("value", DataType::map_string_t).number(long_name, Doubles{1});
  const auto error = wire.as(every("p3_by_name")).error();
  CHECK(error.message.size() < 200);
  Wire type;
  type.open("value", DataType::structure_t, long_name);
  CHECK(type.as(every("p3")).error().message.size() < 200);
}
