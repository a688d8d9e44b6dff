// A 1 MB array from value to value through the codec, against memcpy of the same bytes.
//
// Ours: pack, encode, decode, unpack. Between encode and decode the slices are not joined: a socket would gather and
// copy them, and that copy is neither side's. What remains of ours is the one copy that makes the received value own
// its items; the yardstick makes one copy too.
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "core/types/pack.hpp"
#include "core/wire/codec.hpp"
#include "test/bench/comparison.hpp"

namespace {

constexpr std::size_t item_count = 131'072;  // 1 MiB of double

void check(bool is_right, const char* what) {
  if (is_right) return;
  std::fprintf(stderr, "bench_codec: %s\n", what);
  std::exit(1);
}

void run(std::uint16_t version) {
  std::vector<double> items(item_count);
  for (std::size_t index = 0; index < items.size(); ++index) items[index] = static_cast<double>(index);
  const rr::Value value(items);
  const rr::TypeDefinition type{.type = rr::DataType::double_t, .array = rr::ArrayKind::variable};
  const rr::TypeRegistry types;

  rr::Message outgoing;
  const auto encode = [&](rr::EncodedMessage& encoded) {
    outgoing.clear();
    outgoing.header.version = version;
    outgoing.begin_entry(rr::EntryType::property_get_res, "bench", "samples", 1);
    check(static_cast<bool>(rr::pack(outgoing, "value", value, type, types)), "pack failed");
    check(static_cast<bool>(rr::encode(outgoing, {}, encoded)), "encode failed");
  };

  rr::EncodedMessage encoded;
  encode(encoded);
  const rr::Bytes received = encoded.to_bytes();
  rr::Message incoming;
  double last = 0;
  const auto ours = [&] {
    encode(encoded);
    check(static_cast<bool>(rr::decode(received, {}, incoming)), "decode failed");
    const auto result = rr::unpack(incoming, incoming.elements.front(), type, types);
    check(static_cast<bool>(result), "unpack failed");
    last = (*result->to_items<double>()).back();
  };
  const auto yardstick = [&] {
    // Not a vector, which would fill the memory before it is copied to.
    const auto copy = std::make_unique_for_overwrite<double[]>(items.size());
    std::memcpy(copy.get(), items.data(), items.size() * sizeof(double));
    last = copy[items.size() - 1];
  };
  rr::bench::compare("codec, 1 MB double[], version " + std::to_string(version), 500, ours, yardstick);
  check(last == static_cast<double>(item_count - 1), "wrong items");
}

}  // namespace

int main() {
  run(2);
  run(4);
}
