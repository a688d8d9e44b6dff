#include "wasm-client/src/value_to_js.hpp"

namespace rr {

namespace {

class ToJs {
 public:
  ToJs(const TypeRegistry& types, bool is_varvalue) : types_(types), is_varvalue_(is_varvalue) {}

  JsValue operator()(std::monostate) const { return JsValue::null(); }
  JsValue operator()(const Scalar& scalar) const { return number(scalar.type, scalar.bytes().data()); }
  JsValue operator()(const std::string& text) const { return make_js_text(text); }
  JsValue operator()(const Array& array) const { return numbers(array.type(), array.bytes()); }
  JsValue operator()(const MultiDimArray& value) const { return shaped(value.dims, (*this)(value.array)); }

  JsValue operator()(const Structure& structure) const {
    return marked(fields(structure, types_.find_entity(structure.type_name)), structure.type_name, "");
  }

  JsValue operator()(const PodArray& pods) const {
    if (pods.is_scalar && pods.items.size() == 1) return fields(pods.items.front());
    const JsValue items = make_js_array();
    for (const auto& item : pods.items) push_js(items, fields(item));
    return marked(pods.is_multidim ? shaped(pods.dims, items) : items, pods.type_name, pods.is_multidim ? "[*]" : "[]");
  }

  JsValue operator()(const NamedArray& named) const {
    const auto* entity = types_.find_entity(named.type_name);
    const auto bytes = named.array.bytes();
    if (!entity || entity->namedarray_count == 0) return (*this)(named.array);
    const std::size_t each = entity->namedarray_count * item_size(entity->namedarray_type);
    if (named.is_scalar && bytes.size() == each) return named_array(*entity, bytes);
    const JsValue items = make_js_array();
    for (std::size_t at = 0; at + each <= bytes.size(); at += each)
      push_js(items, named_array(*entity, bytes.subspan(at, each)));
    return marked(named.is_multidim ? shaped(named.dims, items) : items, named.type_name,
                  named.is_multidim ? "[*]" : "[]");
  }

  JsValue operator()(const List& list) const {
    const JsValue items = make_js_array();
    for (const auto& item : list.items) push_js(items, convert(item));
    return items;
  }
  JsValue operator()(const MapInt32& map) const {
    const JsValue items = make_js_map();
    for (const auto& [key, item] : map.items) set_js_key(items, make_js_number(key), convert(item));
    return items;
  }
  JsValue operator()(const MapString& map) const {
    const JsValue items = make_js_map();
    for (const auto& [key, item] : map.items) set_js_key(items, make_js_text(key), convert(item));
    return items;
  }

  JsValue convert(const Value& value) const { return std::visit(*this, value.storage()); }

 private:
  static JsValue number(DataType type, const std::uint8_t* at) {
    switch (type) {
      case DataType::double_t:
        return make_js_number(load<double>(at));
      case DataType::single_t:
        return make_js_number(load<float>(at));
      case DataType::int8_t:
        return make_js_number(load<std::int8_t>(at));
      case DataType::uint8_t:
        return make_js_number(load<std::uint8_t>(at));
      case DataType::int16_t:
        return make_js_number(load<std::int16_t>(at));
      case DataType::uint16_t:
        return make_js_number(load<std::uint16_t>(at));
      case DataType::int32_t:
        return make_js_number(load<std::int32_t>(at));
      case DataType::uint32_t:
        return make_js_number(load<std::uint32_t>(at));
      case DataType::int64_t:
        return make_js_bigint(at, false);
      case DataType::uint64_t:
        return make_js_bigint(at, true);
      case DataType::cdouble_t:
        return complex(make_js_number(load<double>(at)), make_js_number(load<double>(at + 8)));
      case DataType::csingle_t:
        return complex(make_js_number(load<float>(at)), make_js_number(load<float>(at + 4)));
      case DataType::bool_t:
        return make_js_boolean(*at != 0);
      default:
        return JsValue::null();
    }
  }

  static JsValue numbers(DataType type, ByteSpan bytes) {
    switch (type) {
      case DataType::void_t:
        return make_js_array();
      case DataType::bool_t:
        return make_js_booleans(bytes);
      case DataType::cdouble_t:
      case DataType::csingle_t:
        return complex(make_js_parts(type, bytes, 0), make_js_parts(type, bytes, 1));
      default:
        return make_js_items(type, bytes);
    }
  }

  static JsValue complex(const JsValue& real, const JsValue& imaginary) {
    const JsValue object = make_js_object();
    set_js_field(object, "re", real);
    set_js_field(object, "im", imaginary);
    return object;
  }

  static JsValue shaped(const std::vector<std::uint32_t>& dims, const JsValue& data) {
    const JsValue object = make_js_object();
    const JsValue sizes = make_js_array();
    for (const auto size : dims) push_js(sizes, make_js_number(size));
    set_js_field(object, "dims", sizes);
    set_js_field(object, "data", data);
    return object;
  }

  /// `entity`  tells which fields are varvalues; nullptr where none can be.
  JsValue fields(const Structure& structure, const EntityDefinition* entity = nullptr) const {
    const JsValue object = make_js_object();
    for (const auto& field : structure.fields) {
      const auto* member = entity ? entity->find_member(field.name) : nullptr;
      const bool is_varvalue = member && member->type.type == DataType::varvalue_t;
      set_js_field(object, field.name, ToJs(types_, is_varvalue).convert(field.value));
    }
    return object;
  }

  /// One value of a named array: its numbers, flattened in field order, as an object.
  JsValue named_array(const EntityDefinition& entity, ByteSpan bytes) const {
    const JsValue object = make_js_object();
    const std::size_t number_size = item_size(entity.namedarray_type);
    for (const auto& member : entity.members) {
      std::size_t count = 1;
      for (const auto size : member.type.sizes) count *= static_cast<std::size_t>(size);
      const bool is_array = member.type.array != ArrayKind::none;
      const auto* inner =
          member.type.type == DataType::namedarray_t ? types_.find_entity(member.type.qualified_name) : nullptr;
      const std::size_t size = count * number_size * (inner ? inner->namedarray_count : 1);
      if (size > bytes.size()) break;
      const auto part = bytes.first(size);
      bytes = bytes.subspan(size);
      if (!inner) {
        const JsValue items =
            is_array ? numbers(entity.namedarray_type, part) : number(entity.namedarray_type, part.data());
        set_js_field(object, member.name, shaped_like(member.type, items));
      } else if (!is_array) {
        set_js_field(object, member.name, named_array(*inner, part));
      } else {
        const JsValue items = make_js_array();
        for (std::size_t i = 0; i < count; ++i)
          push_js(items, named_array(*inner, part.subspan(i * size / count, size / count)));
        set_js_field(object, member.name, shaped_like(member.type, items));
      }
    }
    return object;
  }

  static JsValue shaped_like(const TypeDefinition& type, const JsValue& items) {
    if (type.array != ArrayKind::fixed_multidim) return items;
    return shaped(std::vector<std::uint32_t>(type.sizes.begin(), type.sizes.end()), items);
  }

  JsValue marked(const JsValue& object, std::string_view type_name, std::string_view array) const {
    if (is_varvalue_ && !type_name.empty()) mark_js_type(object, std::string(type_name).append(array));
    return object;
  }

  const TypeRegistry& types_;
  bool is_varvalue_;
};

}  // namespace

JsValue to_js(const Value& value, const TypeRegistry& types, bool is_varvalue) {
  return ToJs(types, is_varvalue).convert(value);
}

JsValue to_js(const Error& error, const TypeRegistry& types) {
  const JsValue object = make_js_object();
  set_js_field(object, "code", make_js_number(static_cast<double>(error.code)));
  set_js_field(object, "name", make_js_text(error.qualified_name()));
  set_js_field(object, "subName", make_js_text(error.sub_name));
  set_js_field(object, "param", error.param ? to_js(*error.param, types, true) : JsValue::null());
  set_js_field(object, "message", make_js_text(error.message));
  return object;
}

}  // namespace rr
