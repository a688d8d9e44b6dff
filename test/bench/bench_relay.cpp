// One device through two relays on the same bytes: latency of an empty call, and arrays of 1 MB either way.
//
//   bench_relay OUR_PORT YARDSTICK_PORT
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "test/bench/comparison.hpp"
#include "test/bench/raw_session.hpp"

namespace {

constexpr std::uint32_t item_count = 131'072;  // 1 MiB of double

void compare(const std::string& name, int rounds, rr::bench::RawSession& ours, rr::bench::RawSession& yardstick,
             const rr::Bytes& our_request, const rr::Bytes& yardstick_request) {
  rr::bench::compare(
      "relay, " + name, rounds, [&] { ours.round_trip(our_request); },
      [&] { yardstick.round_trip(yardstick_request); });
  rr::Message reply;
  ours.decode_reply(reply);
  yardstick.decode_reply(reply);
}

void run(std::uint16_t our_port, std::uint16_t yardstick_port) {
  boost::asio::io_context io;
  rr::bench::RawSession ours(io, our_port);
  rr::bench::RawSession yardstick(io, yardstick_port);
  compare("empty call", 10'000, ours, yardstick, ours.make_call("nothing"), yardstick.make_call("nothing"));
  compare("1 MB from the device", 300, ours, yardstick, ours.make_call("ramp", "count", item_count),
          yardstick.make_call("ramp", "count", item_count));
  const std::vector<double> items(item_count, 1.0);
  compare("1 MB to the device", 300, ours, yardstick, ours.make_call("sum", "values", items),
          yardstick.make_call("sum", "values", items));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: bench_relay OUR_PORT YARDSTICK_PORT\n");
    return 2;
  }
  try {
    run(static_cast<std::uint16_t>(std::atoi(argv[1])), static_cast<std::uint16_t>(std::atoi(argv[2])));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_relay: %s\n", error.what());
    return 1;
  }
}
