// What a hostile byte costs: memory at its peak, and time, for each byte that a decoder is given. Each ceiling is what
// the worst input known takes, rounded up.
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

}  // namespace

TEST_CASE("what a byte of JSON costs") {
  check({{"numbers", repeat("1,", "[", "1]"), 40},
         {"empty arrays", repeat("[],", "[", "[]]"), 40},
         {"empty objects", repeat("{},", "[", "{}]"), 40},
         {"empty texts", repeat("\"\",", "[", "1]"), 40},
         {"too deep", repeat("["), 40}},
        [](std::string_view text) { (void)read_json(text); });
}

TEST_CASE("what a byte of CBOR costs") {
  check({{"numbers", repeat("\x01", "\x9f", "\xff"), 110},
         {"empty arrays", repeat("\x80", "\x9f", "\xff"), 110},
         {"empty maps", repeat("\xa0", "\x9f", "\xff"), 110},
         {"empty texts", repeat("\x60", "\x9f", "\xff"), 110},
         {"too deep", repeat("\x81"), 110},
         {"tags", repeat("\xc6"), 110}},
        [](std::string_view text) { (void)read_cbor(bytes_of(text)); });
}

TEST_CASE("what a byte of a service definition costs") {
  const std::string head = "service a.b\nstdver 0.10\n";
  check({{"constants", repeat("constant int32 a 1\n", head), 80},
         {"empty structures", repeat("struct a\nend\n", head), 80},
         {"members", repeat("property a b\n", head + "object a\n", "end\n"), 80},
         {"mistakes", repeat("x\n", head), 80},
         {"parameters", repeat("a a,", head + "object a\nfunction a a(", "a a)\nend\n"), 80}},
        [](std::string_view text) { (void)parse_service_definition(text, RobdefMode::compat); });
}

TEST_CASE("what a byte of a message costs, and of the values in it") {
  const auto message = [](const Bytes& element, std::size_t count) {
    const auto bytes = coded_message("a", element, count);
    return std::string(bytes.begin(), bytes.end());
  };
  check({{"void elements", message(coded_element(), input_size / 6), 64},
         {"a map of void elements", message(coded_map(coded_element(), input_size / 6), 1), 64},
         {"empty maps", message(coded_map({}, 0), input_size / 14), 64}},
        [](std::string_view text) {
          Message message;
          if (!decode(bytes_of(text), {.string_table = {.local = true, .standard = true}}, message)) return;
          for (const auto& element : message.elements)
            (void)unpack(message, element, type_of(DataType::varvalue_t), test_types());
        });
}
