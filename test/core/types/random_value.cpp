#include "test/core/types/random_value.hpp"

#include <map>

#include "core/types/multidim.hpp"

namespace rr::test {

namespace {

constexpr DataType numeric_types[] = {DataType::double_t, DataType::single_t, DataType::int8_t,    DataType::uint8_t,
                                      DataType::int16_t,  DataType::uint16_t, DataType::int32_t,   DataType::uint32_t,
                                      DataType::int64_t,  DataType::uint64_t, DataType::cdouble_t, DataType::csingle_t,
                                      DataType::bool_t};

std::size_t product(const std::vector<std::uint32_t>& dims) {
  return static_cast<std::size_t>(product_of(std::span<const std::uint32_t>(dims)).value());
}

}  // namespace

Value RandomValue::make(const TypeDefinition& type, int depth) {
  const bool is_null = depth > 4 || below(8) == 0;
  const auto count = below(4);
  switch (type.container) {
    case ContainerKind::list: {
      if (is_null) return {};
      List list;
      for (std::uint32_t i = 0; i < count; ++i) list.items.push_back(make_item(type, depth + 1));
      return list;
    }
    case ContainerKind::map_int32: {
      if (is_null) return {};
      std::map<std::int32_t, Value> items;
      for (std::uint32_t i = 0; i < count; ++i)
        items[static_cast<std::int32_t>(engine_())] = make_item(type, depth + 1);
      return MapInt32{{items.begin(), items.end()}};
    }
    case ContainerKind::map_string: {
      if (is_null) return {};
      std::map<std::string, Value> items;
      for (std::uint32_t i = 0; i < count; ++i) items[make_text()] = make_item(type, depth + 1);
      return MapString{{items.begin(), items.end()}};
    }
    default:
      return make_item(type, depth);
  }
}

Value RandomValue::make_item(const TypeDefinition& type, int depth) {
  if (type.type == DataType::varvalue_t) return make_varvalue(depth);
  if (type.type == DataType::string_t) return make_text();
  if (type.type == DataType::enum_t) return static_cast<std::int32_t>(engine_());
  if (!is_numeric(type.type)) return make_named(type, depth);
  if (type.array == ArrayKind::none) return Scalar::from_bytes(type.type, make_array(type.type, 1).bytes());
  if (!is_multidim(type)) return make_array(type.type, make_count(type));
  auto dims = make_dims(type);
  auto array = make_array(type.type, product(dims));
  return MultiDimArray{std::move(dims), std::move(array)};
}

Value RandomValue::make_varvalue(int depth) {
  TypeDefinition type;
  type.type = DataType::varvalue_t;
  switch (below(depth > 4 ? 3 : 8)) {
    case 0:
      return {};
    case 1:
      return make_text();
    case 2:
      return make_array(numeric_types[below(13)], below(5));
    case 3:
      type.container = ContainerKind::list;
      break;
    case 4:
      type.container = ContainerKind::map_int32;
      break;
    case 5:
      type.container = ContainerKind::map_string;
      break;
    default: {
      const auto& definition = *types_.definitions()[below(static_cast<std::uint32_t>(types_.definitions().size()))];
      const auto& entity = definition.entities[below(static_cast<std::uint32_t>(definition.entities.size()))];
      if (entity.kind == EntityKind::object) return {};
      type.type = DataType::namedtype_t;
      type.qualified_name = definition.name + "." + entity.name;
      if (entity.kind != EntityKind::structure) type.array = below(2) ? ArrayKind::variable : ArrayKind::multidim;
      return make_named(type, depth + 1);
    }
  }
  return make(type, depth + 1);
}

Value RandomValue::make_named(const TypeDefinition& type, int depth) {
  const auto& entity = *types_.find_entity(type.qualified_name);
  if (entity.kind == EntityKind::structure) {
    if (depth > 4 || below(8) == 0) return {};
    auto structure = make_fields(entity, depth + 1);
    structure.type_name = type.qualified_name;
    return structure;
  }
  const auto shape = [&](auto& named) {
    named.type_name = type.qualified_name;
    named.is_scalar = type.array == ArrayKind::none;
    named.is_multidim = is_multidim(type);
    if (!named.is_multidim) return named.is_scalar ? 1 : make_count(type);
    named.dims = make_dims(type);
    return product(named.dims);
  };
  if (entity.kind == EntityKind::namedarray) {
    NamedArray named;
    const auto count = shape(named);
    named.array = make_array(entity.namedarray_type, count * entity.namedarray_count);
    return named;
  }
  PodArray pods;
  const auto count = shape(pods);
  for (std::size_t i = 0; i < count; ++i) pods.items.push_back(make_fields(entity, depth + 1));
  return pods;
}

Structure RandomValue::make_fields(const EntityDefinition& entity, int depth) {
  Structure structure;
  for (const auto& member : entity.members) structure.fields.push_back({member.name, make(member.type, depth)});
  return structure;
}

std::string RandomValue::make_text() {
  std::string text;
  for (auto length = below(6); length > 0; --length) text += static_cast<char>(engine_());
  if (below(50) == 0) text.append(300, 'x');
  return text;
}

Array RandomValue::make_array(DataType type, std::size_t count) {
  Bytes bytes(count * item_size(type));
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(engine_());
  return Array::copy(type, bytes);
}

std::vector<std::uint32_t> RandomValue::make_dims(const TypeDefinition& type) {
  if (type.array == ArrayKind::fixed_multidim) return {type.sizes.begin(), type.sizes.end()};
  std::vector<std::uint32_t> dims(1 + below(3));
  for (auto& dim : dims) dim = below(4);
  return dims;
}

std::size_t RandomValue::make_count(const TypeDefinition& type) {
  if (type.array == ArrayKind::fixed) return static_cast<std::size_t>(type.sizes[0]);
  if (type.array == ArrayKind::max) return below(static_cast<std::uint32_t>(type.sizes[0]) + 1);
  return below(5);
}

}  // namespace rr::test
