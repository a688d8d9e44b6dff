#include "server/json/value_to_json.hpp"

#include <charconv>
#include <cmath>

#include "core/support/utf8.hpp"
#include "core/types/field_path.hpp"
#include "node/tls/base64.hpp"
#include "server/json/typed_array_tags.hpp"

namespace rr {

namespace {

/// What a declared type says that the value itself doesn't.
struct Hint {
  bool is_varvalue = false;
  const EnumDefinition* names = nullptr;  ///< of an enum
};

class ToJson {
 public:
  ToJson(const TypeRegistry& types, const JsonForm& form) : types_(types), form_(form) {}

  bool write(const FieldPath& path, const Value& value, const TypeDefinition& type, OrderedJson& out) {
    const Hint hint{type.type == DataType::varvalue_t,
                    type.type == DataType::enum_t ? types_.find_enum(type.qualified_name) : nullptr};
    if (type.container == ContainerKind::none || type.container == ContainerKind::generator)
      return write_item(path, value, hint, out);
    return write_plain(path, value, hint, out);
  }
  Error take_error() { return std::move(*error_); }

 private:
  /// A value that is no container, or a varvalue.
  bool write_item(const FieldPath& path, const Value& value, const Hint& hint, OrderedJson& out) {
    if (!hint.is_varvalue || value.is_null()) return write_plain(path, value, hint, out);
    out = OrderedJson::object();
    add_key(out, "type") = type_text(value);
    return write_plain(path, value, hint, add_key(out, "value"));
  }

  bool write_plain(const FieldPath& path, const Value& value, const Hint& hint, OrderedJson& out) {
    return std::visit([&](const auto& held) { return put(path, held, hint, out); }, value.storage());
  }

  bool put(const FieldPath&, std::monostate, const Hint&, OrderedJson& out) {
    out = nullptr;
    return true;
  }
  bool put(const FieldPath&, const Scalar& scalar, const Hint& hint, OrderedJson& out) {
    out = hint.names ? enum_value(load<std::int32_t>(scalar.bytes().data()), *hint.names)
                     : number(scalar.type, scalar.bytes().data());
    return true;
  }
  bool put(const FieldPath& path, const std::string& text, const Hint&, OrderedJson& out) {
    return check_text(path, text) && (out = text, true);
  }
  bool put(const FieldPath&, const Array& array, const Hint&, OrderedJson& out) {
    out = numbers(array.type(), array.bytes());
    return true;
  }
  bool put(const FieldPath&, const MultiDimArray& value, const Hint&, OrderedJson& out) {
    out = shaped(value.dims, numbers(value.array.type(), value.array.bytes()));
    return true;
  }
  bool put(const FieldPath& path, const Structure& structure, const Hint&, OrderedJson& out) {
    return fields(path, structure, structure.type_name, out);
  }
  bool put(const FieldPath& path, const PodArray& pods, const Hint&, OrderedJson& out) {
    if (pods.is_scalar && pods.items.size() == 1) return fields(path, pods.items.front(), pods.type_name, out);
    auto items = OrderedJson::array();
    for (const auto& pod : pods.items) {
      items.emplace_back();
      const auto at = path.index(static_cast<std::int32_t>(items.size() - 1));
      if (!fields(at, pod, pods.type_name, items.back())) return false;
    }
    out = pods.is_multidim ? shaped(pods.dims, std::move(items)) : std::move(items);
    return true;
  }
  bool put(const FieldPath&, const NamedArray& named, const Hint&, OrderedJson& out) {
    const auto* entity = types_.find_entity(named.type_name);
    const auto bytes = named.array.bytes();
    if (!entity || entity->namedarray_count == 0) {
      out = numbers(named.array.type(), bytes);
      return true;
    }
    const std::size_t each = entity->namedarray_count * item_size(entity->namedarray_type);
    if (named.is_scalar && bytes.size() == each) {
      out = form_.packs_arrays ? plain_list(entity->namedarray_type, bytes) : named_array(*entity, bytes);
      return true;
    }
    OrderedJson items;
    if (form_.packs_arrays) {
      items = packed(bytes, bytes.size() / each);
    } else {
      items = OrderedJson::array();
      for (std::size_t at = 0; at + each <= bytes.size(); at += each)
        items.push_back(named_array(*entity, bytes.subspan(at, each)));
    }
    out = named.is_multidim ? shaped(named.dims, std::move(items)) : std::move(items);
    return true;
  }
  bool put(const FieldPath& path, const List& list, const Hint& hint, OrderedJson& out) {
    out = OrderedJson::array();
    for (const auto& item : list.items) {
      out.emplace_back();
      if (!write_item(path.index(static_cast<std::int32_t>(out.size() - 1)), item, hint, out.back())) return false;
    }
    return true;
  }
  bool put(const FieldPath& path, const MapInt32& map, const Hint& hint, OrderedJson& out) {
    out = OrderedJson::object();
    for (const auto& [key, item] : map.items)
      if (!write_item(path.index(key), item, hint, add_key(out, std::to_string(key)))) return false;
    return true;
  }
  bool put(const FieldPath& path, const MapString& map, const Hint& hint, OrderedJson& out) {
    out = OrderedJson::object();
    for (const auto& [key, item] : map.items) {
      const auto at = path.key(key);
      if (!check_text(at, key) || !write_item(at, item, hint, add_key(out, key))) return false;
    }
    return true;
  }

  bool fields(const FieldPath& path, const Structure& structure, std::string_view type_name, OrderedJson& out) {
    const auto* entity = types_.find_entity(type_name);
    out = OrderedJson::object();
    for (const auto& field : structure.fields) {
      const auto at = path.field(field.name, type_name);
      const auto* member = entity ? entity->find_member(field.name) : nullptr;
      auto& item = add_key(out, field.name);
      if (!(member ? write(at, field.value, member->type, item) : write_plain(at, field.value, {}, item))) return false;
    }
    return true;
  }

  /// One value of a named array: its numbers, flattened in field order, as an object.
  OrderedJson named_array(const EntityDefinition& entity, ByteSpan bytes) const {
    auto object = OrderedJson::object();
    const std::size_t number_size = item_size(entity.namedarray_type);
    for (const auto& member : entity.members) {
      std::size_t count = 1;
      for (const auto size : member.type.sizes) count *= static_cast<std::size_t>(size);
      const auto* inner =
          member.type.type == DataType::namedarray_t ? types_.find_entity(member.type.qualified_name) : nullptr;
      const std::size_t size = count * number_size * (inner ? inner->namedarray_count : 1);
      if (size > bytes.size()) break;
      const auto part = bytes.first(size);
      bytes = bytes.subspan(size);
      auto& out = add_key(object, member.name);
      if (member.type.array == ArrayKind::none) {
        out = inner ? named_array(*inner, part) : number(entity.namedarray_type, part.data());
        continue;
      }
      OrderedJson items;
      if (!inner) {
        items = numbers(entity.namedarray_type, part);
      } else {
        items = OrderedJson::array();
        for (std::size_t i = 0; i < count; ++i)
          items.push_back(named_array(*inner, part.subspan(i * size / count, size / count)));
      }
      out =
          member.type.array == ArrayKind::fixed_multidim
              ? shaped(std::vector<std::uint32_t>(member.type.sizes.begin(), member.type.sizes.end()), std::move(items))
              : std::move(items);
    }
    return object;
  }

  OrderedJson enum_value(std::int32_t value, const EnumDefinition& names) const {
    if (!form_.numbers_enums)
      for (const auto& each : names.values)
        if (each.value == value) return each.name;
    return value;
  }

  static OrderedJson shaped(const std::vector<std::uint32_t>& dims, OrderedJson data) {
    auto out = OrderedJson::object();
    add_key(out, "dims") = dims;
    add_key(out, "data") = std::move(data);
    return out;
  }

  static OrderedJson packed(ByteSpan bytes, std::size_t count) {
    auto out = OrderedJson::object();
    add_key(out, "b64") = encode_base64(bytes);
    add_key(out, "count") = count;
    return out;
  }

  OrderedJson numbers(DataType type, ByteSpan bytes) const {
    const auto tag = typed_array_tag(type);
    if (form_.has_bytes && tag) {
      std::vector<std::uint8_t> items(bytes.begin(), bytes.end());
      return type == DataType::uint8_t ? OrderedJson::binary(std::move(items))
                                       : OrderedJson::binary(std::move(items), *tag);
    }
    if (type == DataType::uint8_t) return encode_base64(bytes);
    if (type == DataType::void_t) return OrderedJson::array();
    return form_.packs_arrays ? packed(bytes, bytes.size() / item_size(type)) : plain_list(type, bytes);
  }

  static OrderedJson plain_list(DataType type, ByteSpan bytes) {
    auto out = OrderedJson::array();
    const auto each = item_size(type);
    out.get_ref<OrderedJson::array_t&>().reserve(bytes.size() / each);
    for (std::size_t at = 0; at < bytes.size(); at += each) out.push_back(number(type, bytes.data() + at));
    return out;
  }

  static OrderedJson real(double value) {
    if (std::isfinite(value)) return value;
    return std::isnan(value) ? "NaN" : value < 0 ? "-Infinity" : "Infinity";
  }
  /// The double with the fewest digits among those that round to `value`.
  static OrderedJson real(float value) {
    if (!std::isfinite(value)) return real(double{value});
    char digits[24];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    double shortest = 0;
    std::from_chars(digits, end, shortest);
    return shortest;
  }

  static OrderedJson number(DataType type, const std::uint8_t* at) {
    switch (type) {
      case DataType::double_t:
        return real(load<double>(at));
      case DataType::single_t:
        return real(load<float>(at));
      case DataType::int8_t:
        return load<std::int8_t>(at);
      case DataType::uint8_t:
        return load<std::uint8_t>(at);
      case DataType::int16_t:
        return load<std::int16_t>(at);
      case DataType::uint16_t:
        return load<std::uint16_t>(at);
      case DataType::int32_t:
        return load<std::int32_t>(at);
      case DataType::uint32_t:
        return load<std::uint32_t>(at);
      case DataType::int64_t:
        return std::to_string(load<std::int64_t>(at));
      case DataType::uint64_t:
        return std::to_string(load<std::uint64_t>(at));
      case DataType::cdouble_t:
        return OrderedJson::array({real(load<double>(at)), real(load<double>(at + 8))});
      case DataType::csingle_t:
        return OrderedJson::array({real(load<float>(at)), real(load<float>(at + 4))});
      case DataType::bool_t:
        return *at != 0;
      default:
        return nullptr;
    }
  }

  /// What stands before the value in an envelope. On the wire a number is an array of one.
  static std::string type_text(const Value& value) {
    if (value.get_if<List>()) return "varvalue{list}";
    if (value.get_if<MapInt32>()) return "varvalue{int32}";
    if (value.get_if<MapString>()) return "varvalue{string}";
    if (const auto* array = value.get_if<MultiDimArray>())
      return std::string(data_type_name(array->array.type())) + "[*]";
    if (const auto* pods = value.get_if<PodArray>()) return pods->type_name + array_suffix(*pods);
    if (const auto* named = value.get_if<NamedArray>()) return named->type_name + array_suffix(*named);
    return value.type_text();
  }
  template <class Named>
  static const char* array_suffix(const Named& value) {
    return value.is_multidim ? "[*]" : value.is_scalar ? "" : "[]";
  }

  bool check_text(const FieldPath& path, std::string_view text) {
    if (is_utf8(text)) return true;
    error_ = value_error(ErrorCode::data_serialization_error, "write", path, "is not UTF-8");
    return false;
  }

  const TypeRegistry& types_;
  const JsonForm& form_;
  std::optional<Error> error_;
};

/// U+FFFD for every byte that is not part of UTF-8.
std::string mended(const std::string& text) {
  const auto quoted_text = OrderedJson(text).dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
  return OrderedJson::parse(quoted_text).get<std::string>();
}

}  // namespace

Result<OrderedJson> value_to_json(const Value& value, const TypeDefinition& type, const TypeRegistry& types,
                                  const JsonForm& form, std::string_view name) {
  FieldPath root;
  root.name = name;
  ToJson writer(types, form);
  OrderedJson out;
  if (!writer.write(root, value, type, out)) return writer.take_error();
  return {boost::system::in_place_value, std::move(out)};
}

OrderedJson error_to_json(const Error& error, const TypeRegistry& types) {
  auto out = OrderedJson::object();
  auto& held = add_key(out, "error") = OrderedJson::object();
  add_key(held, "name") = mended(error.qualified_name());
  add_key(held, "message") = mended(error.message);
  if (!error.sub_name.empty()) add_key(held, "subname") = mended(error.sub_name);
  TypeDefinition any;
  any.type = DataType::varvalue_t;
  if (error.param && !error.param->is_null())
    if (auto param = value_to_json(*error.param, any, types)) add_key(held, "param") = std::move(*param);
  return out;
}

}  // namespace rr
