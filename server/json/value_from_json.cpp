#include "server/json/value_from_json.hpp"

#include <algorithm>

#include "core/support/whole_number.hpp"
#include "core/types/multidim.hpp"
#include "core/types/type_text.hpp"
#include "server/json/numbers_from_json.hpp"

namespace rr {

namespace {

class FromJson : public NumbersFromJson {
 public:
  FromJson(const TypeRegistry& types, const JsonForm& form) : types_(types), form_(form) {}

  bool read(const FieldPath& path, const Json& json, const TypeDefinition& type, Value& out) {
    switch (type.container) {
      case ContainerKind::none:
      case ContainerKind::generator:
        return read_item(path, json, type, out);
      case ContainerKind::list:
        return read_list(path, json, type, out);
      case ContainerKind::map_int32:
        return read_map<MapInt32>(path, json, type, out);
      case ContainerKind::map_string:
        return read_map<MapString>(path, json, type, out);
    }
    return false;
  }

 private:
  static TypeDefinition item_type(const TypeDefinition& type) {
    auto item = type;
    item.container = ContainerKind::none;
    return item;
  }

  bool read_list(const FieldPath& path, const Json& json, const TypeDefinition& type, Value& out) {
    if (json.is_null()) return true;
    if (!json.is_array()) return fail_kind(path, json, "an array, or null");
    const auto each = item_type(type);
    List list;
    list.items.reserve(json.size());
    for (const auto& item : json) {
      const auto at = path.index(static_cast<std::int32_t>(list.items.size()));
      if (!read_item(at, item, each, list.items.emplace_back())) return false;
    }
    out = std::move(list);
    return true;
  }

  template <class Map>
  bool read_map(const FieldPath& path, const Json& json, const TypeDefinition& type, Value& out) {
    if (json.is_null()) return true;
    if (!json.is_object()) return fail_kind(path, json, "an object, or null");
    const auto each = item_type(type);
    Map map;
    map.items.reserve(json.size());
    for (const auto& [key, item] : json.items()) {
      map.items.emplace_back();
      if (!read_key(path, key, map.items.back().first) ||
          !read_item(path.key(key), item, each, map.items.back().second))
        return false;
    }
    std::sort(map.items.begin(), map.items.end(),
              [](const auto& left, const auto& right) { return left.first < right.first; });
    out = std::move(map);
    return true;
  }
  bool read_key(const FieldPath&, const std::string& key, std::string& out) {
    out = key;
    return true;
  }
  bool read_key(const FieldPath& path, const std::string& key, std::int32_t& out) {
    const auto number = canonical_number<std::int32_t>(key);
    if (number) {
      out = *number;
      return true;
    }
    return fail(ErrorCode::data_type_error, path,
                "has the key " + rr::quote(key) + ", expected an int32 in plain decimal digits");
  }

  bool read_item(const FieldPath& path, const Json& json, const TypeDefinition& type, Value& out) {
    switch (type.type) {
      case DataType::void_t:
        return json.is_null() || fail_kind(path, json, "null");
      case DataType::varvalue_t:
        return read_varvalue(path, json, out);
      case DataType::enum_t:
        return read_enum(path, json, type, out);
      case DataType::string_t:
        if (!json.is_string()) return fail_kind(path, json, "a string");
        out = json.get_ref<const std::string&>();
        return true;
      case DataType::structure_t:
      case DataType::pod_t:
      case DataType::namedarray_t:
        return read_named(path, json, type, out);
      default:
        break;
    }
    if (!is_numeric(type.type)) return fail(ErrorCode::data_type_error, path, "is no value: " + format_type(type));
    if (type.array == ArrayKind::none) {
      Scalar scalar;
      if (!read_scalar(path, json, type.type, scalar)) return false;
      out = scalar;
      return true;
    }
    if (is_multidim(type)) {
      MultiDimArray value;
      const Json* data = nullptr;
      if (!read_shape(path, json, type, value.dims, data)) return false;
      const auto at = path.field("data", {});
      if (!read_numbers(at, *data, type.type, value.array) || !check_product(path, value.dims, value.array.size()))
        return false;
      out = std::move(value);
      return true;
    }
    Array array;
    if (!read_numbers(path, json, type.type, array) || !check_count(path, type, array.size())) return false;
    out = std::move(array);
    return true;
  }

  bool read_varvalue(const FieldPath& path, const Json& json, Value& out) {
    if (json.is_null()) return true;
    if (!json.is_object() || json.size() != 2 || !json.contains("type") || !json.contains("value"))
      return fail(ErrorCode::data_type_mismatch, path, "expected null or {\"type\": ..., \"value\": ...}");
    if (!json["type"].is_string()) return fail_kind(path.field("type", {}), json["type"], "the text of a type");
    const auto type = parse_type_text(json["type"].get_ref<const std::string&>(), types_);
    if (type.has_error()) return fail(type.error().code, path, type.error().message);
    return read(path, json["value"], *type, out);
  }

  bool read_enum(const FieldPath& path, const Json& json, const TypeDefinition& type, Value& out) {
    const auto* names = types_.find_enum(type.qualified_name);
    if (json.is_string() && names) {
      const auto& name = json.get_ref<const std::string&>();
      for (const auto& each : names->values) {
        if (each.name != name) continue;
        out = each.value;
        return true;
      }
      return fail(ErrorCode::out_of_range, path,
                  "found " + rr::quote(name) + ", which is no value of " + format_type(type));
    }
    if (!json.is_number()) return fail_kind(path, json, "a name of " + format_type(type) + ", or a number");
    Scalar number;
    if (!read_scalar(path, json, DataType::int32_t, number)) return false;
    out = number;
    return true;
  }

  bool read_shape(const FieldPath& path, const Json& json, const TypeDefinition& type, std::vector<std::uint32_t>& dims,
                  const Json*& data) {
    if (!json.is_object() || json.size() != 2 || !json.contains("dims") || !json.contains("data") ||
        !json["dims"].is_array() || json["dims"].empty())
      return fail(ErrorCode::data_type_mismatch, path, "expected {\"dims\": [rows, columns, ...], \"data\": ...}");
    const auto at = path.field("dims", {});
    for (const auto& size : json["dims"]) {
      Scalar number;
      if (!read_scalar(at.index(static_cast<std::int32_t>(dims.size())), size, DataType::uint32_t, number))
        return false;
      dims.push_back(load<std::uint32_t>(number.bytes().data()));
    }
    const auto product = product_of(std::span<const std::uint32_t>(dims));
    if (!product || *product > static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max()))
      return fail(ErrorCode::out_of_range, at, "is " + dims_text(dims) + ", more items than an array holds");
    if (!has_declared_dims(type, dims))
      return fail(ErrorCode::data_type_error, path,
                  "has dims " + dims_text(dims) + ", expected " + item_type_text(type));
    data = &json["data"];
    return true;
  }

  bool check_product(const FieldPath& path, const std::vector<std::uint32_t>& dims, std::size_t count) {
    const auto product = product_of(std::span<const std::uint32_t>(dims));
    if (product && *product == count) return true;
    return fail(ErrorCode::data_type_error, path,
                "has " + std::to_string(count) + " items, expected those of dims " + dims_text(dims));
  }

  bool check_count(const FieldPath& path, const TypeDefinition& type, std::size_t count) {
    const auto wrong = wrong_count(type, count);
    return wrong.empty() || fail(ErrorCode::data_type_error, path, wrong + " (" + item_type_text(type) + ")");
  }

  // --- named types ---

  bool read_named(const FieldPath& path, const Json& json, const TypeDefinition& type, Value& out) {
    const std::string_view type_name = type.qualified_name;
    const auto* entity = types_.find_entity(type_name);
    if (!entity || entity->kind == EntityKind::object)
      return fail(ErrorCode::data_type_error, path,
                  rr::quote(type_name) + (entity ? " is an object" : " is not known"));
    if (entity->kind == EntityKind::structure) {
      if (json.is_null()) return true;
      Structure structure;
      structure.type_name = type_name;
      if (!read_fields(path, json, *entity, type_name, structure)) return false;
      out = std::move(structure);
      return true;
    }
    const bool is_scalar = type.array == ArrayKind::none;
    std::vector<std::uint32_t> dims;
    const Json* data = &json;
    if (is_multidim(type) && !read_shape(path, json, type, dims, data)) return false;
    return entity->kind == EntityKind::pod
               ? read_pods(path, *data, *entity, type, is_scalar, std::move(dims), out)
               : read_named_arrays(path, *data, *entity, type, is_scalar, std::move(dims), out);
  }

  bool read_fields(const FieldPath& path, const Json& json, const EntityDefinition& entity, std::string_view type_name,
                   Structure& out) {
    if (!json.is_object()) return fail_kind(path, json, "an object with the fields of " + std::string(type_name));
    out.fields.reserve(entity.members.size());
    for (const auto& member : entity.members) {
      const auto at = path.field(member.name, type_name);
      const auto found = json.find(member.name);
      if (found == json.end())
        return fail(ErrorCode::data_type_error, at, "is missing, expected " + format_type(member.type));
      out.fields.push_back({member.name, {}});
      if (!read(at, *found, member.type, out.fields.back().value)) return false;
    }
    return check_keys(path, json, entity, type_name);
  }

  bool check_keys(const FieldPath& path, const Json& json, const EntityDefinition& entity, std::string_view type_name) {
    if (form_.ignores_unknown || json.size() == entity.members.size()) return true;  // all declared ones were there
    for (const auto& [key, unused] : json.items())
      if (!entity.find_member(key))
        return fail(ErrorCode::data_type_error, path.field(key, type_name), "is not a field of the type");
    return true;
  }

  bool read_pods(const FieldPath& path, const Json& json, const EntityDefinition& entity, const TypeDefinition& type,
                 bool is_scalar, std::vector<std::uint32_t> dims, Value& out) {
    PodArray pods;
    pods.type_name = type.qualified_name;
    pods.is_scalar = is_scalar;
    pods.is_multidim = is_multidim(type);
    pods.dims = std::move(dims);
    if (is_scalar) {
      if (!read_fields(path, json, entity, type.qualified_name, pods.items.emplace_back())) return false;
      out = std::move(pods);
      return true;
    }
    if (!json.is_array()) return fail_kind(path, json, "an array of objects");
    for (const auto& item : json) {
      const auto at = path.index(static_cast<std::int32_t>(pods.items.size()));
      if (!read_fields(at, item, entity, type.qualified_name, pods.items.emplace_back())) return false;
    }
    if (pods.is_multidim ? !check_product(path, pods.dims, pods.items.size())
                         : !check_count(path, type, pods.items.size()))
      return false;
    out = std::move(pods);
    return true;
  }

  bool read_named_arrays(const FieldPath& path, const Json& json, const EntityDefinition& entity,
                         const TypeDefinition& type, bool is_scalar, std::vector<std::uint32_t> dims, Value& out) {
    NamedArray named;
    named.type_name = type.qualified_name;
    named.is_scalar = is_scalar;
    named.is_multidim = is_multidim(type);
    named.dims = std::move(dims);
    std::size_t count = 1;
    if (!is_scalar && json.is_object()) {
      const auto each = entity.namedarray_count * item_size(entity.namedarray_type);
      if (!read_packed(path, json, entity.namedarray_type, each, count, named.array)) return false;
    } else {
      Bytes bytes;
      if (is_scalar) {
        if (!flatten(path, json, entity, type.qualified_name, bytes)) return false;
      } else {
        if (!json.is_array()) return fail_kind(path, json, "an array of objects");
        count = json.size();
        std::int32_t index = 0;
        for (const auto& item : json)
          if (!flatten(path.index(index++), item, entity, type.qualified_name, bytes)) return false;
      }
      named.array = Array::copy(entity.namedarray_type, bytes);
    }
    if (named.is_multidim ? !check_product(path, named.dims, count) : !is_scalar && !check_count(path, type, count))
      return false;
    out = std::move(named);
    return true;
  }

  /// Adds the numbers of one value, which is an object by fields or a list of all its numbers.
  bool flatten(const FieldPath& path, const Json& json, const EntityDefinition& entity, std::string_view type_name,
               Bytes& out) {
    if (json.is_array()) {
      if (json.size() != entity.namedarray_count)
        return fail(
            ErrorCode::data_type_error, path,
            "has " + std::to_string(json.size()) + " numbers, expected " + std::to_string(entity.namedarray_count));
      return add_numbers(path, json, entity.namedarray_type, out);
    }
    Structure structure;
    if (!read_fields(path, json, entity, type_name, structure)) return false;
    for (const auto& field : structure.fields) {
      ByteSpan bytes;
      if (const auto* scalar = field.value.get_if<Scalar>()) bytes = scalar->bytes();
      if (const auto* array = field.value.get_if<Array>()) bytes = array->bytes();
      if (const auto* multidim = field.value.get_if<MultiDimArray>()) bytes = multidim->array.bytes();
      if (const auto* named = field.value.get_if<NamedArray>()) bytes = named->array.bytes();
      out.insert(out.end(), bytes.begin(), bytes.end());
    }
    return true;
  }

  const TypeRegistry& types_;
  const JsonForm& form_;
};

}  // namespace

Result<Value> value_from_json(const Json& json, const TypeDefinition& type, const TypeRegistry& types,
                              const JsonForm& form, std::string_view name) {
  FieldPath root;
  root.name = name;
  FromJson reader(types, form);
  Value out;
  if (!reader.read(root, json, type, out)) return reader.take_error();
  return out;
}

}  // namespace rr
