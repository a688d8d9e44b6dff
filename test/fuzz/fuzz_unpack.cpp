// Any message that decodes gives values or errors, and every value packs and unpacks to itself.
// Seeds: those of fuzz_codec_v2 and fuzz_codec_v4.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "core/types/pack.hpp"
#include "core/wire/codec.hpp"
#include "test/core/types/fixture.hpp"
#include "test/core/wire/coded_message.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rr;

void require(bool holds, const char* rule, const std::string& detail) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s: %s\n", rule, detail.c_str());
  std::abort();
}

void check_value(const Message& message, const MessageElement& element, const TypeDefinition& type) {
  const auto& types = test::test_types();
  const auto value = unpack(message, element, type, types);
  if (!value)
    return require(value.error().message.rfind("unpack '", 0) == 0, "an error names its path", value.error().message);

  static Message packed;
  packed.clear();
  packed.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
  const auto done = pack(packed, "value", *value, type, types);
  require(done.has_value(), "what was unpacked packs", done ? "" : done.error().message);
  const auto again = unpack(packed, packed.elements[0], type, types);
  require(again.has_value(), "what was packed unpacks", again ? "" : again.error().message);
  require(*again == *value, "a value comes back as it was", value->type_text());
}

}  // namespace

/// A message; or '*' and elements of version 4.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 16) return 0;
  Bytes bytes(data, data + size);
  static Message message;
  if (data[0] == '*') {
    // A map of 2,000 elements that name half a megabyte by its code: too long for an input.
    static const std::string text(500'000, 'a');
    bytes = test::coded_message(text, test::coded_map({data + 1, std::min<std::size_t>(size - 1, 1024)}, 2000), 1);
    const rr::fuzz::MemoryBound bound(bytes.size());
    if (decode(bytes, {.string_table = {.local = true, .standard = true}}, message))
      check_value(message, message.elements[0], test::type_of(DataType::varvalue_t));
    return 0;
  }
  const rr::fuzz::MemoryBound bound(size);
  const auto message_size = static_cast<std::uint32_t>(size);
  std::memcpy(bytes.data(), "RRAC", 4);
  std::memcpy(bytes.data() + 4, &message_size, sizeof(message_size));

  if (!decode(bytes, {.string_table = {.local = true, .standard = true}}, message)) return 0;
  static const auto& fields = test::test_types().find_entity("test.types.every")->members;
  static const auto any = test::type_of(DataType::varvalue_t);
  // Every element, nested ones too, so that a mutation of a large value still tests its parts.
  for (const auto& element : message.elements) {
    check_value(message, element, any);
    for (const auto& field : fields) check_value(message, element, field.type);
    if (const auto* entity = test::test_types().find_entity(element.type_name);
        entity && entity->kind != EntityKind::object)
      for (const auto array : {ArrayKind::none, ArrayKind::variable, ArrayKind::multidim})
        check_value(message, element, test::named_type(element.type_name, array));
  }
  return 0;
}
