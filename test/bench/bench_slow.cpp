// What a call takes while another client's handler runs for 5 s, against what it takes without. Who starts it says
// where it runs.
//
//   bench_slow NAME URL     `bench_peer service`, or a gateway in front of it
#include <chrono>
#include <cstdio>
#include <exception>
#include <future>
#include <string>
#include <thread>

#include "node/client/client.hpp"
#include "test/bench/comparison.hpp"

namespace {

constexpr double seconds = 5;

/// One call each millisecond, timed from when it is due: what holds one up is seen in all that should have followed.
template <class Goes>
rr::bench::Samples calls_while(rr::RemoteObject& robot, Goes&& goes_on) {
  rr::bench::Samples samples;
  for (auto due = std::chrono::steady_clock::now(); goes_on(); due += std::chrono::milliseconds(1)) {
    std::this_thread::sleep_until(due);
    robot.call("nothing");
    const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - due;
    samples.nanoseconds.push_back(taken.count());
  }
  return samples;
}

void run(const std::string& name, const std::string& url) {
  auto robot = rr::connect(url);
  for (int i = 0; i < 1000; ++i) robot.call("nothing");
  auto slow = std::async(std::launch::async, [&] {
    auto other = rr::connect(url);
    other.call("wait", seconds);
  });
  const auto beside =
      calls_while(robot, [&] { return slow.wait_for(std::chrono::seconds(0)) != std::future_status::ready; });
  slow.get();
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  const auto alone = calls_while(robot, [&] { return std::chrono::steady_clock::now() < end; });
  rr::bench::print(name, beside, alone);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: bench_slow NAME URL\n");
    return 2;
  }
  try {
    run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_slow: %s\n", error.what());
    return 1;
  }
}
