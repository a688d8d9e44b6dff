// Values as Robot Raconteur 1.2.8 packed them: unpacked, looked at, packed again to the same bytes.
#include <catch2/catch.hpp>

#include "core/types/pack.hpp"
#include "test/core/types/fixture.hpp"
#include "test/core/types/show_result.hpp"
#include "test/support/golden.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// The declared type behind a vector, by the stem of its name ("pack_pod_point_array_3_v2").
TypeDefinition type_behind(const std::string& name) {
  const auto begins = [&name](std::string_view start) { return name.rfind(start, 0) == 0; };
  const std::string service = "experimental.vectors.";
  if (begins("pack_struct_inner")) return named_type(service + "inner");
  if (begins("pack_struct_outer")) return named_type(service + "outer");
  if (begins("pack_pod_multidim")) return named_type(service + "point", ArrayKind::multidim);
  if (begins("pack_pod_point_array")) return named_type(service + "point", ArrayKind::variable);
  if (begins("pack_pod_point")) return named_type(service + "point");
  if (begins("pack_pod_nested_array")) return named_type(service + "nested", ArrayKind::variable);
  if (begins("pack_pod_nested")) return named_type(service + "nested");
  if (begins("pack_named_vec3_array")) return named_type(service + "vec3", ArrayKind::variable);
  if (begins("pack_named_vec3")) return named_type(service + "vec3");
  if (begins("pack_named_transform_array")) return named_type(service + "transform", ArrayKind::variable);
  if (begins("pack_named_transform")) return named_type(service + "transform");
  if (begins("pack_named_uint8")) return named_type(service + "bytes6", ArrayKind::variable);
  if (begins("pack_named_multidim")) return named_type(service + "vec3", ArrayKind::multidim);
  if (begins("pack_varvalue")) return type_of(DataType::varvalue_t);
  if (begins("pack_multidim_int16")) return type_of(DataType::int16_t, ArrayKind::multidim);
  if (begins("pack_multidim_cdouble")) return type_of(DataType::cdouble_t, ArrayKind::multidim);
  if (begins("pack_multidim_bool")) return type_of(DataType::bool_t, ArrayKind::multidim);
  if (begins("pack_multidim_double")) return type_of(DataType::double_t, ArrayKind::multidim);
  throw std::runtime_error("no type for vector " + name);
}

struct Vector {
  std::string name;
  std::uint16_t version;
  Bytes bytes;
};

const std::vector<Vector>& pack_vectors() {
  static const auto vectors = [] {
    std::vector<Vector> list;
    for (const auto& vector : read_golden_json("messages/messages.json"))
      if (vector["name"].get<std::string>().rfind("pack_", 0) == 0)
        list.push_back({vector["name"], vector["version"], from_hex(vector["hex"].get<std::string>())});
    return list;
  }();
  return vectors;
}

Value unpack_vector(const std::string& name) {
  for (const auto& vector : pack_vectors())
    if (vector.name == name) {
      auto value = unpack_message(vector.bytes, type_behind(name));
      if (!value) throw std::runtime_error(value.error().message);
      return *value;
    }
  throw std::runtime_error("no vector " + name);
}

}  // namespace

TEST_CASE("every packed vector unpacks and packs to the same bytes") {
  const auto& vectors = pack_vectors();
  REQUIRE(vectors.size() == 52);
  for (const auto& vector : vectors) {
    INFO(vector.name);
    const auto type = type_behind(vector.name);
    const auto value = unpack_message(vector.bytes, type);
    REQUIRE((value ? "" : value.error().message) == "");
    const auto bytes = pack_message(*value, type, vector.version);
    REQUIRE((bytes ? "" : bytes.error().message) == "");
    CHECK(to_hex(*bytes) == to_hex(vector.bytes));
  }
}

TEST_CASE("every packed vector unpacks as varvalue, too, and packs to the same bytes") {
  const auto type = type_of(DataType::varvalue_t);
  for (const auto& vector : pack_vectors()) {
    INFO(vector.name);
    const auto value = unpack_message(vector.bytes, type);
    REQUIRE((value ? "" : value.error().message) == "");
    const auto bytes = pack_message(*value, type, vector.version);
    REQUIRE((bytes ? "" : bytes.error().message) == "");
    CHECK(to_hex(*bytes) == to_hex(vector.bytes));
  }
}

TEST_CASE("both message versions carry the same value") {
  for (const auto& vector : pack_vectors()) {
    if (vector.version != 4) continue;
    INFO(vector.name);
    const auto other = vector.name.substr(0, vector.name.size() - 1) + "2";
    CHECK(unpack_vector(vector.name) == unpack_vector(other));
  }
}

TEST_CASE("the structure vector holds what was packed") {
  const auto value = unpack_vector("pack_struct_outer_full_v4");
  const auto* outer = value.get_if<Structure>();
  REQUIRE(outer);
  CHECK(outer->type_name == "experimental.vectors.outer");
  REQUIRE(outer->fields.size() == 19);
  const auto inner = [](double a, const char* s) {
    return Value(Structure{"experimental.vectors.inner", {{"a", a}, {"s", s}}});
  };
  CHECK(*outer->find("first") == inner(1.5, "first"));
  CHECK(outer->find("missing")->is_null());
  CHECK(*outer->find("items") == List{{inner(2, "two"), {}}});
  CHECK(*outer->find("by_number") == MapInt32{{{-1, inner(-1, "minus")}, {1000, inner(1000, "")}}});
  CHECK(*outer->find("by_name") == MapString{{{"k", inner(3, "three")}}});
  CHECK(*outer->find("any") == inner(9, "any"));
  CHECK(outer->find("nothing")->is_null());
  CHECK(*outer->find("fixed") == std::vector<std::int32_t>{1, 2, 3});
  CHECK(*outer->find("upto") == std::vector<std::int32_t>{9});
  CHECK(*outer->find("grid") == MultiDimArray{{2, 2, 1}, Array::take(std::vector<double>{1, 2, 3, 4})});
  CHECK(*outer->find("m") == Value(std::int32_t{-1}));
  const auto doubles = [](std::vector<double> items) { return Array::take(std::move(items)); };
  CHECK(*outer->find("t") ==
        NamedArray{"experimental.vectors.transform", doubles({0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5}), {}, true});
  CHECK(*outer->find("vs") == NamedArray{"experimental.vectors.vec3", doubles({1, 2, 3, 4, 5, 6})});
  CHECK(*outer->find("vgrid") ==
        NamedArray{"experimental.vectors.vec3", doubles({1, 1, 1, 2, 2, 2}), {1, 2}, false, true});
  const auto point = [](std::int16_t id, float item) { return Structure{"", {{"id", id}, {"value", item}}}; };
  CHECK(*outer->find("p") == PodArray{"experimental.vectors.point", {point(7, 7.5f)}, {}, true});
  CHECK(*outer->find("ps") == PodArray{"experimental.vectors.point", {point(1, 1), point(2, 2)}});
  CHECK(*outer->find("pgrid") ==
        PodArray{"experimental.vectors.point", {point(3, 3), point(4, 4)}, {2, 1}, false, true});
  CHECK(*outer->find("names") == List{{Value("n\xc3\xa4me")}});
  CHECK(*outer->find("ok") == Value(true));
}

TEST_CASE("the pod vector gives multi-dim fields their declared dims") {
  const auto value = unpack_vector("pack_pod_nested_mixed_v2");
  const auto* pods = value.get_if<PodArray>();
  REQUIRE(pods);
  CHECK(pods->is_scalar);
  REQUIRE(pods->items.size() == 1);
  const auto& pod = pods->items[0];
  CHECK(*pod.find("matrix") == MultiDimArray{{2, 2}, Array::take(std::vector<double>{1.25, 2.25, 3.25, 4.25})});
  CHECK(*pod.find("m5") == std::vector<std::uint8_t>{0, 1, 2, 3, 4});
  const auto* grid = pod.find("grid")->get_if<PodArray>();
  REQUIRE(grid);
  CHECK(grid->is_multidim);
  CHECK(grid->dims == std::vector<std::uint32_t>{2, 1});
  CHECK(*grid->items[1].find("id") == Value(std::int16_t{-2}));
  CHECK(pod.find("one")->get_if<PodArray>()->is_scalar);
  CHECK(pod.find("upto")->get_if<PodArray>()->items.size() == 1);
  CHECK(pod.find("vm")->get_if<NamedArray>()->array.size() == 6);
}
