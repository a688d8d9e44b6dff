#include "test/core/types/fixture.hpp"

#include <stdexcept>

#include "test/support/golden.hpp"

namespace rr::test {

namespace {

constexpr const char* definition_text = R"(service test.types

stdver 0.10

enum mode
    off = 0,
    run = 1,
    fault = -1
end

namedarray vec3
    field double x
    field double y
    field double z
end

namedarray transform
    field vec3[2] axes
    field double w
end

namedarray flags
    field bool a
    field bool[2] b
end

pod point
    field int16 id
    field single value
end

pod shape
    field uint8 u8
    field bool b
    field cdouble c
    field double[2] f2
    field double[2-] m2
    field int16[2,3] grid
    field point p
    field point[2] p2
    field point[2-] pm
    field point[2,1] pgrid
    field vec3 v
    field vec3[2] v2
    field vec3[2-] vm
    field vec3[1,2] vgrid
end

pod nothing
end

struct empty
end

struct point3
    field double x
    field double y
    field double z
end

struct tree
    field string name
    field tree child
    field tree{list} children
    field varvalue any
end

struct every
    field double d
    field single s
    field int8 i8
    field uint8 u8
    field int16 i16
    field uint16 u16
    field int32 i32
    field uint32 u32
    field int64 i64
    field uint64 u64
    field cdouble cd
    field csingle cs
    field bool b
    field string text
    field mode m
    field double[] ds
    field int32[3] f3
    field int32[3-] m3
    field bool[] bs
    field double[*] grid
    field int16[2,3] grid23
    field point3 p3
    field point3{list} p3s
    field point3{int32} p3_by_number
    field point3{string} p3_by_name
    field string{list} texts
    field double{int32} ds_by_number
    field uint8[]{string} blobs
    field mode{list} modes
    field varvalue any
    field varvalue{list} anys
    field point p
    field point[] ps
    field point[2] p2
    field point[2-] pm
    field point[*] pgrid
    field point[2,1] pgrid21
    field point[]{list} ps_list
    field shape sh
    field nothing n
    field vec3 v
    field vec3[] vs
    field vec3[2] v2
    field vec3[2-] vm
    field vec3[*] vgrid
    field vec3[1,2] vgrid12
    field transform t
    field flags fl
    field empty e
end
)";

}  // namespace

const TypeRegistry& test_types() {
  static const auto registry = [] {
    TypeRegistry types;
    auto added = types.add({definition_text, read_golden("types/experimental.vectors.robdef")}, RobdefMode::strict);
    if (!added) throw std::runtime_error(added.error().message);
    return types;
  }();
  return registry;
}

const TypeDefinition& field_type(std::string_view entity, std::string_view field) {
  const auto* found = test_types().find_entity(entity);
  const auto* member = found ? found->find_member(field) : nullptr;
  if (!member) throw std::runtime_error("no field " + std::string(entity) + " " + std::string(field));
  return member->type;
}

TypeDefinition type_of(DataType type, ArrayKind array, std::vector<std::int32_t> sizes) {
  TypeDefinition definition;
  definition.type = type;
  definition.array = array;
  definition.sizes = std::move(sizes);
  return definition;
}

TypeDefinition named_type(std::string_view qualified_name, ArrayKind array) {
  const auto* entity = test_types().find_entity(qualified_name);
  if (!entity) throw std::runtime_error("no type " + std::string(qualified_name));
  const bool is_pod = entity->kind == EntityKind::pod;
  const bool is_structure = entity->kind == EntityKind::structure;
  auto definition = type_of(is_structure ? DataType::structure_t
                            : is_pod     ? DataType::pod_t
                                         : DataType::namedarray_t,
                            array);
  definition.name = definition.qualified_name = qualified_name;
  return definition;
}

Result<Bytes> pack_message(const Value& value, const TypeDefinition& type, std::uint16_t version) {
  Message message;
  message.header.version = version;
  message.header.sender_node_id = parse_node_id("00112233445566778899aabbccddeeff").value();
  message.header.receiver_node_id = parse_node_id("0102030405060708090a0b0c0d0e0f10").value();
  message.header.sender_endpoint = 1;
  message.header.receiver_endpoint = 2000;
  message.header.message_id = 7;
  message.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
  if (auto packed = pack(message, "value", value, type, test_types()); !packed) return packed.error();
  EncodedMessage encoded;
  if (auto done = encode(message, {}, encoded); !done) return done.error();
  return encoded.to_bytes();
}

Result<Value> unpack_message(ByteSpan bytes, const TypeDefinition& type) {
  Message message;
  if (auto done = decode(bytes, {}, message); !done) return done.error();
  const auto* element = message.elements_of(message.entries.at(0)).find("value");
  if (!element) return make_error(ErrorCode::message_element_not_found, "no element 'value'");
  return unpack(message, *element, type, test_types());
}

Result<Value> round_trip(const Value& value, const TypeDefinition& type, std::uint16_t version) {
  auto bytes = pack_message(value, type, version);
  if (!bytes) return bytes.error();
  return unpack_message(*bytes, type);
}

Error pack_error(const Value& value, const TypeDefinition& type) {
  Message message;
  message.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
  auto packed = pack(message, "value", value, type, test_types());
  return packed ? Error{ErrorCode::none, "no error"} : packed.error();
}

}  // namespace rr::test
