// What a hostile byte costs: memory at its peak, and time, for each byte that a decoder is given. Each ceiling is what
// the worst input known takes, rounded up; docs/security.md says why that is no less.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "core/robdef/robdef.hpp"
#include "server/json/value_from_json.hpp"
#include "test/core/types/fixture.hpp"
#include "test/core/wire/coded_message.hpp"
#include "test/support/count_allocations.hpp"

using namespace rr;
using namespace rr::test;

namespace {

constexpr std::size_t input_size = 200'000;

std::string repeat(std::string_view part, std::string_view begin = "", std::string_view end = "") {
  std::string text(begin);
  while (text.size() < input_size) text += part;
  return text.append(end);
}

double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

struct Cost {
  double bytes = 0;   ///< of the heap at its peak, for each byte of input
  double hashes = 0;  ///< time, as a multiple of what a plain hash of the same input takes
};

/// The better one of three runs counts: others use the machine as well.
double best_of_three(const std::function<void()>& run) {
  double best = 1e9;
  for (int i = 0; i < 3; ++i) {
    const auto begin = processor_seconds();
    run();
    best = std::min(best, processor_seconds() - begin);
  }
  return best;
}

Cost measure(std::string_view input, const std::function<void(std::string_view)>& decode) {
  const auto before = live_bytes;
  peak_bytes = live_bytes;
  decode(input);
  Cost cost;
  cost.bytes = static_cast<double>(peak_bytes - before) / static_cast<double>(input.size());
  const auto hashing = best_of_three([&] {
    for (int i = 0; i < 10; ++i) {
      volatile std::uint64_t hash = 14695981039346656037u;
      for (const auto c : input) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211u;
    }
  });
  cost.hashes = best_of_three([&] { decode(input); }) / std::max(hashing / 10, 1e-6);
  return cost;
}

struct Case {
  const char* name;
  std::string input;
  double most_bytes;
};

void check(const std::vector<Case>& cases, const std::function<void(std::string_view)>& decode) {
  for (const auto& each : cases) {
    const auto cost = measure(each.input, decode);
    INFO(each.name << ": " << cost.bytes << " bytes of heap a byte, " << cost.hashes << " times the time of a hash");
    CHECK(cost.bytes <= each.most_bytes);
    CHECK(cost.hashes <= 800);  // some three times what is measured; quadratic time takes thousands
    if (std::getenv("RR_AMPLIFICATION"))
      WARN(each.name << ": " << cost.bytes << " bytes, " << cost.hashes << " hashes");
  }
}

ByteSpan bytes_of(std::string_view text) {
  return as_bytes(text);
}

/// What an account is charged for a document covers what the document takes, and is at most so many times as much.
void check_charge(std::string_view input, std::size_t charged, const std::function<bool(std::string_view)>& decode,
                  std::size_t most = 3) {
  const auto before = live_bytes;
  peak_bytes = live_bytes;
  CHECK(decode(input));
  const auto taken = peak_bytes - before;
  INFO(quote(input.substr(0, 40)) << ": " << charged << " bytes charged, " << taken << " taken for " << input.size());
  CHECK(charged >= taken);
  CHECK(charged <= most * taken + 1024);
}

}  // namespace

TEST_CASE("what a byte of JSON costs") {
  check({{"numbers", repeat("1,", "[", "1]"), 36},
         {"empty arrays", repeat("[],", "[", "[]]"), 36},
         {"empty objects", repeat("{},", "[", "{}]"), 36},
         {"empty texts", repeat("\"\",", "[", "1]"), 36},
         {"too deep", repeat("["), 36}},
        [](std::string_view text) { (void)read_json(text); });
}

TEST_CASE("what a byte of CBOR costs") {
  check({{"numbers", repeat("\x01", "\x9f", "\xff"), 96},
         {"empty arrays", repeat("\x80", "\x9f", "\xff"), 96},
         {"empty maps", repeat("\xa0", "\x9f", "\xff"), 96},
         {"empty texts", repeat("\x60", "\x9f", "\xff"), 96},
         {"too deep", repeat("\x81"), 96},
         {"tags", repeat("\xc6"), 96}},
        [](std::string_view text) { (void)read_cbor(bytes_of(text)); });
}

TEST_CASE("the account is charged what a document of JSON takes while it is read") {
  const auto escaped = "\"" + repeat("\\n\\u00e4ab") + "\"";
  for (const auto& text : {repeat("1,", "[", "1]"), repeat("0.123456789,", "[", "1]"), repeat("[],", "[", "[]]"),
                           repeat("[1],", "[", "[]]"), repeat("{},", "[", "{}]"), repeat("\"\",", "[", "1]"),
                           repeat("{\"x\":1,\"y\":-2},", "[", "1]"), repeat("{\"\":{}},", "[", "1]"),
                           repeat("\"a text that is longer than what fits into a string\",", "[", "1]"),
                           repeat("{\"a key that is longer than what fits into a string\":null},", "[", "1]"), escaped,
                           "[" + escaped + "]", "\"" + repeat("A") + "\"", "{" + escaped + ":1}",
                           std::string("{\"id\":1,\"op\":\"get\"}"), std::string("1")})
    check_charge(text, memory_of_json(text), [](std::string_view json) { return read_json(json).has_value(); });
}

TEST_CASE("the account is charged what a document of CBOR takes while it is read") {
  using namespace std::string_literals;
  const auto long_text = "\x78\x40"s + std::string(64, 'a');
  const auto in_array = [](std::string_view item) { return repeat(item, "\x9f", "\xff"); };
  for (const auto& bytes :
       {in_array("\x01"), in_array("\xfb\x3f\xf1\x99\x99\x99\x99\x99\x9a"), in_array("\x80"), in_array("\x81\x01"),
        in_array("\xa0"), in_array("\x60"), in_array("\x40"), in_array("\xd8\x40\x41\x01"), in_array("\xa1\x60\x01"),
        in_array("\xa2\x61x\x01\x61y\x02"), in_array(long_text), in_array("\xa1" + long_text + "\x01"),
        "\xa1\x61z\x01"s, "\x9a\x00\x04\x00\x00"s + std::string(0x40000, '\x01')})
    check_charge(bytes, memory_of_cbor(bytes_of(bytes)),
                 [](std::string_view cbor) { return read_cbor(bytes_of(cbor)).has_value(); });
  // Pieces count as items of their own.
  for (const auto& bytes : {repeat("\x61"
                                   "a",
                                   "\x7f", "\xff"),
                            repeat("\x41"
                                   "a",
                                   "\x5f", "\xff")})
    check_charge(
        bytes, memory_of_cbor(bytes_of(bytes)),
        [](std::string_view cbor) { return read_cbor(bytes_of(cbor)).has_value(); }, 60);
}

TEST_CASE("what a byte of a service definition costs") {
  const std::string head = "service a.b\nstdver 0.10\n";
  check({{"constants", repeat("constant int32 a 1\n", head), 36},
         {"empty structures", repeat("struct a\nend\n", head), 36},
         {"members", repeat("property a b\n", head + "object a\n", "end\n"), 36},
         {"mistakes", repeat("x\n", head), 36},
         {"parameters", repeat("a a,", head + "object a\nfunction a a(", "a a)\nend\n"), 40}},
        [](std::string_view text) { (void)parse_service_definition(text, RobdefMode::compat); });
}

TEST_CASE("what a byte of a message costs, and of the values in it") {
  const auto text_of = [](const Bytes& element, std::size_t count) {
    const auto bytes = coded_message("a", element, count);
    return std::string(bytes.begin(), bytes.end());
  };
  check({{"void elements", text_of(coded_element(), input_size / 6), 64},
         {"a map of void elements", text_of(coded_map(coded_element(), input_size / 6), 1), 64},
         {"empty maps", text_of(coded_map({}, 0), input_size / 14), 64}},
        [](std::string_view text) {
          Message message;
          if (!decode(bytes_of(text), {.string_table = {.local = true, .standard = true}}, message)) return;
          for (const auto& element : message.elements)
            (void)unpack(message, element, type_of(DataType::varvalue_t), test_types());
        });
}
