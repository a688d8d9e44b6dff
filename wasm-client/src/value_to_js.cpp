#include "wasm-client/src/value_to_js.hpp"

namespace rr {

namespace {

class ToJs {
 public:
  ToJs(JsWriter& js, const TypeRegistry& types, bool is_varvalue) : js_(js), types_(types), is_varvalue_(is_varvalue) {}

  void operator()(std::monostate) const { js_.null(); }
  void operator()(const Scalar& scalar) const { number(scalar.type, scalar.bytes().data()); }
  void operator()(const std::string& text) const { js_.text(text); }
  void operator()(const Array& array) const { numbers(array.type(), array.bytes()); }
  void operator()(const MultiDimArray& value) const {
    shaped(value.dims, [&] { (*this)(value.array); });
  }

  void operator()(const Structure& structure) const {
    fields(structure, types_.find_entity(structure.type_name), marking(structure.type_name, ""));
  }

  void operator()(const PodArray& pods) const {
    if (pods.is_scalar && pods.items.size() == 1) return fields(pods.items.front());
    elements(pods, [&] {
      for (const auto& item : pods.items) fields(item);
    });
  }

  void operator()(const NamedArray& named) const {
    const auto* entity = types_.find_entity(named.type_name);
    const auto bytes = named.array.bytes();
    if (!entity || entity->namedarray_count == 0) return (*this)(named.array);
    const std::size_t each = entity->namedarray_count * item_size(entity->namedarray_type);
    if (named.is_scalar && bytes.size() == each) return named_array(*entity, bytes);
    elements(named, [&] {
      for (std::size_t at = 0; at + each <= bytes.size(); at += each) named_array(*entity, bytes.subspan(at, each));
    });
  }

  void operator()(const List& list) const {
    js_.begin_array();
    for (const auto& item : list.items) convert(item);
    js_.end();
  }
  void operator()(const MapInt32& map) const {
    js_.begin_map();
    for (const auto& [key, item] : map.items) {
      js_.number(key);
      convert(item);
    }
    js_.end();
  }
  void operator()(const MapString& map) const {
    js_.begin_map();
    for (const auto& [key, item] : map.items) {
      js_.text(key);
      convert(item);
    }
    js_.end();
  }

  void convert(const Value& value) const { std::visit(*this, value.storage()); }

 private:
  void number(DataType type, const std::uint8_t* at) const {
    switch (type) {
      case DataType::double_t:
        return js_.number(load<double>(at));
      case DataType::single_t:
        return js_.number(load<float>(at));
      case DataType::int8_t:
        return js_.number(load<std::int8_t>(at));
      case DataType::uint8_t:
        return js_.number(load<std::uint8_t>(at));
      case DataType::int16_t:
        return js_.number(load<std::int16_t>(at));
      case DataType::uint16_t:
        return js_.number(load<std::uint16_t>(at));
      case DataType::int32_t:
        return js_.number(load<std::int32_t>(at));
      case DataType::uint32_t:
        return js_.number(load<std::uint32_t>(at));
      case DataType::int64_t:
        return js_.bigint(at, false);
      case DataType::uint64_t:
        return js_.bigint(at, true);
      case DataType::cdouble_t:
        return complex(load<double>(at), load<double>(at + 8));
      case DataType::csingle_t:
        return complex(load<float>(at), load<float>(at + 4));
      case DataType::bool_t:
        return js_.boolean(*at != 0);
      default:
        return js_.null();
    }
  }

  void complex(double real, double imaginary) const {
    js_.begin_object();
    js_.key("re").number(real);
    js_.key("im").number(imaginary);
    js_.end();
  }

  void numbers(DataType type, ByteSpan bytes) const {
    switch (type) {
      case DataType::void_t:
        js_.begin_array();
        return js_.end();
      case DataType::bool_t:
        return js_.booleans(bytes);
      case DataType::cdouble_t:
      case DataType::csingle_t:
        js_.begin_object();
        js_.key("re").parts(type, bytes, 0);
        js_.key("im").parts(type, bytes, 1);
        return js_.end();
      default:
        return js_.items(type, bytes);
    }
  }

  /// `data` writes the items.
  template <class Sizes, class Data>
  void shaped(const Sizes& dims, Data data, std::string_view mark = {}) const {
    js_.begin_object();
    js_.key("dims").begin_array();
    for (const auto size : dims) js_.number(static_cast<double>(size));
    js_.end();
    js_.key("data");
    data();
    if (!mark.empty()) js_.mark(mark);
    js_.end();
  }

  /// An array of pods or of named arrays; `items` writes its elements.
  template <class Values, class Items>
  void elements(const Values& values, Items items) const {
    const auto mark = marking(values.type_name, values.is_multidim ? "[*]" : "[]");
    const auto data = [&](std::string_view array_mark) {
      js_.begin_array();
      items();
      if (!array_mark.empty()) js_.mark(array_mark);
      js_.end();
    };
    if (!values.is_multidim) return data(mark);
    shaped(
        values.dims, [&] { data({}); }, mark);
  }

  /// `entity`  tells which fields are varvalues; nullptr where none can be.
  void fields(const Structure& structure, const EntityDefinition* entity = nullptr, std::string_view mark = {}) const {
    js_.begin_object();
    for (std::size_t i = 0; i < structure.fields.size(); ++i) {
      const auto& field = structure.fields[i];
      const auto* member = entity ? member_of(*entity, field.name, i) : nullptr;
      const bool is_varvalue = member && member->type.type == DataType::varvalue_t;
      js_.key(field.name);
      ToJs(js_, types_, is_varvalue).convert(field.value);
    }
    if (!mark.empty()) js_.mark(mark);
    js_.end();
  }

  /// `at`  where it most likely stands: services send fields in the order of the definition.
  static const MemberDefinition* member_of(const EntityDefinition& entity, std::string_view name, std::size_t at) {
    const auto& members = entity.members;
    return at < members.size() && members[at].name == name ? &members[at] : entity.find_member(name);
  }

  /// One value of a named array: its numbers, flattened in field order, as an object.
  void named_array(const EntityDefinition& entity, ByteSpan bytes) const {
    js_.begin_object();
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
      js_.key(member.name);
      if (!inner && is_array) {
        shaped_like(member.type, [&] { numbers(entity.namedarray_type, part); });
      } else if (!inner) {
        number(entity.namedarray_type, part.data());
      } else if (!is_array) {
        named_array(*inner, part);
      } else {
        shaped_like(member.type, [&] {
          js_.begin_array();
          for (std::size_t i = 0; i < count; ++i) named_array(*inner, part.subspan(i * size / count, size / count));
          js_.end();
        });
      }
    }
    js_.end();
  }

  template <class Data>
  void shaped_like(const TypeDefinition& type, Data data) const {
    if (type.array != ArrayKind::fixed_multidim) return data();
    shaped(type.sizes, data);
  }

  /// Empty where the value needs no mark.
  std::string marking(std::string_view type_name, std::string_view array) const {
    if (!is_varvalue_ || type_name.empty()) return {};
    return std::string(type_name).append(array);
  }

  JsWriter& js_;
  const TypeRegistry& types_;
  bool is_varvalue_;
};

}  // namespace

void write_js(JsWriter& js, const Value& value, const TypeRegistry& types, bool is_varvalue) {
  ToJs(js, types, is_varvalue).convert(value);
}

void write_js(JsWriter& js, const Error& error, const TypeRegistry& types) {
  js.begin_object();
  js.key("code").number(static_cast<double>(error.code));
  js.key("name").text(error.qualified_name());
  js.key("subName").text(error.sub_name);
  js.key("param");
  if (error.param)
    write_js(js, *error.param, types, true);
  else
    js.null();
  js.key("message").text(error.message);
  js.end();
}

JsValue to_js(const Error& error, const TypeRegistry& types) {
  JsWriter js;
  write_js(js, error, types);
  return js.build();
}

}  // namespace rr
