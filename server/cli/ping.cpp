// rrgate ping: how long a request to a service and its answer take. Layer: server/cli.
#include <algorithm>
#include <iomanip>
#include <iostream>

#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;

/// Asks for the attributes of the service, which every node answers by itself: no code of the device runs.
Milliseconds time_request(const rr::RemoteObject& root) {
  const auto begin = std::chrono::steady_clock::now();
  root.connection().wait_for([](rr::ClientConnection& connection, rr::ClientConnection::Completion done) {
    connection.get_attributes(std::move(done));
  });
  return std::chrono::steady_clock::now() - begin;
}

void print_times(std::vector<Milliseconds> times, bool is_json) {
  std::sort(times.begin(), times.end());
  const auto at = [&](double part) {
    return times[static_cast<std::size_t>(part * static_cast<double>(times.size() - 1))];
  };
  if (is_json) {
    auto out = rr::OrderedJson::object();
    out["count"] = times.size();
    out["min_ms"] = times.front().count();
    out["p50_ms"] = at(0.5).count();
    out["p99_ms"] = at(0.99).count();
    out["max_ms"] = times.back().count();
    return print_value(out, true);
  }
  std::cout << std::fixed << std::setprecision(3) << times.size() << " requests: min " << times.front().count()
            << " ms, p50 " << at(0.5).count() << " ms, p99 " << at(0.99).count() << " ms, max " << times.back().count()
            << " ms\n";
  // A histogram whose classes double.
  auto next = times.begin();
  for (double limit = 0.0625; next != times.end(); limit *= 2) {
    const auto end = std::upper_bound(next, times.end(), Milliseconds(limit));
    const auto in_class = static_cast<std::size_t>(end - next);
    next = end;
    if (in_class == 0) continue;
    const auto width = (in_class * 50 + times.size() - 1) / times.size();
    std::cout << std::setw(12) << limit << " ms " << std::setw(7) << in_class << " " << std::string(width, '#') << "\n";
  }
}

}  // namespace

int run_ping(Arguments arguments) {
  constexpr std::string_view options[] = {"--timeout", "--user", "--count"};
  const auto parsed = parse_arguments(arguments, {options, remote_flags});
  if (!parsed.error.empty()) return usage_error("ping", parsed.error);
  if (parsed.operands.size() != 1) return usage_error("ping", "expected URL");
  const auto count = number_option(parsed, "--count", 100, 1'000'000);
  if (!count || *count == 0) return usage_error("ping", "--count: expected 1 to 1000000");
  return run_remote("ping", parsed.operands[0], [&] {
    const auto root = open_service(remote_address(parsed.operands[0], parsed));
    std::vector<Milliseconds> times;
    for (std::uint64_t i = 0; i < *count; ++i) times.push_back(time_request(root));
    print_times(std::move(times), parsed.flags.contains("--json"));
    return static_cast<int>(exit_ok);
  });
}

}  // namespace rrgate
