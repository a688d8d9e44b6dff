// Any JSON or CBOR gives a value that packs, or an error that names its place; what was read is written and read again
// to the same text.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/types/pack.hpp"
#include "server/json/value_from_json.hpp"
#include "test/core/types/fixture.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rr;

void require(bool holds, const char* rule, const std::string& detail) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s: %s\n", rule, detail.c_str());
  std::abort();
}

std::string written(const Value& value, const TypeDefinition& type, const JsonForm& form) {
  const auto json = value_to_json(value, type, test::test_types(), form);
  require(json.has_value(), "what was read is written", json ? "" : json.error().message);
  return write_json(*json);
}

}  // namespace

/// The first byte chooses a type, the second the forms; then comes JSON, or CBOR, whose first bytes may be repeated:
/// what nests without end is too long for an input.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  const auto& types = test::test_types();
  static const auto& fields = types.find_entity("test.types.every")->members;
  const auto& type = fields[data[0] % fields.size()].type;
  JsonForm form;
  form.packs_arrays = data[1] & 1;
  form.numbers_enums = data[1] & 2;
  form.ignores_unknown = data[1] & 4;
  ByteSpan body(data + 2, size - 2);
  Bytes repeated;
  if (const auto part = body.first(std::min<std::size_t>(body.size(), 1 + (data[1] >> 5))); data[1] & 16) {
    for (std::size_t i = 0; i < 100'000; ++i) repeated.insert(repeated.end(), part.begin(), part.end());
    repeated.insert(repeated.end(), body.begin(), body.end());
    body = repeated;
  }
  const rr::fuzz::MemoryBound bound(body.size());
  const auto json = data[1] & 8 ? read_cbor(body) : read_json(as_text(body));
  if (!json) {
    require(!json.error().message.empty(), "an error says what", "");
    return 0;
  }
  const auto value = value_from_json(*json, type, types, form);
  if (!value) {
    require(value.error().message.rfind("read 'value", 0) == 0, "an error names its path", value.error().message);
    return 0;
  }
  Message packed;
  packed.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
  const auto done = pack(packed, "value", *value, type, types);
  require(done.has_value(), "what was read packs", done ? "" : done.error().message);
  const auto received = unpack(packed, packed.elements[0], type, types);
  require(received.has_value(), "what was packed unpacks", received ? "" : received.error().message);

  if (data[1] & 8) return 0;  // text in CBOR need not be UTF-8
  const auto text = written(*received, type, form);
  const auto again = read_json(text);
  require(again.has_value(), "what was written is JSON", text);
  const auto back = value_from_json(*again, type, types, form);
  require(back.has_value(), "what was written is read", back ? "" : back.error().message);
  require(written(*back, type, form) == text, "a value comes back as it was", text);
  return 0;
}
