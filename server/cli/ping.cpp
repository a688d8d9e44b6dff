// rrgate ping, bench: how long requests to a service and their answers take. Layer: server/cli.
#include <algorithm>
#include <iomanip>
#include <iostream>

#include "server/cli/progress.hpp"
#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;

using std::chrono::steady_clock;

/// Asks for the attributes of the service, which every node answers by itself: no code of the device runs.
Milliseconds time_request(const rr::RemoteObject& root) {
  const auto begin = steady_clock::now();
  root.connection().wait_for([](rr::ClientConnection& connection, rr::ClientConnection::Completion done) {
    connection.get_attributes(std::move(done));
  });
  return steady_clock::now() - begin;
}

/// A gateway that shares a device is the node that answers, whether the device is there or not.
void tell_who_answers(const rr::RemoteObject& root) {
  const auto* mode = root.connection().attributes().find("rrgate.mode");
  if (!mode || *mode != rr::Value("shared")) return;
  std::cerr << "the gateway answers, not the device; rrgate bench URL PROPERTY asks the device\n";
}

/// So many requests, one after the other. Throws   rr::Exception: one has failed.
std::vector<Milliseconds> time_requests(const rr::RemoteObject& root, std::uint32_t count) {
  std::vector<Milliseconds> times;
  Progress progress("asking", count);
  while (times.size() < count) {
    times.push_back(time_request(root));
    progress.show(times.size());
  }
  return times;
}

/// So many requests, of which `parallel` are under way at a time. Throws   rr::Exception: one has failed.
std::vector<Milliseconds> time_requests(const rr::RemoteObject& root, const std::string& property, std::uint32_t count,
                                        std::uint32_t parallel) {
  std::vector<Milliseconds> times;
  std::optional<rr::Error> failure;
  std::uint32_t begun = 0;
  Progress progress("asking", count);
  auto& connection = root.connection();
  std::function<void()> begin_one = [&] {
    if (begun == count || failure) return;
    ++begun;
    auto done = [&, begin = steady_clock::now()](const rr::Result<rr::Value>& answer) {
      times.emplace_back(steady_clock::now() - begin);
      progress.show(times.size());
      if (!answer) failure = answer.error();
      begin_one();
    };
    if (property.empty())
      connection.asynchronous().get_attributes(std::move(done));
    else
      connection.asynchronous().get(root.path(), property, std::move(done));
  };
  for (std::uint32_t i = 0; i < parallel; ++i) begin_one();
  // Each request has its own time limit, so that all of them end.
  const auto is_done = [&] { return times.size() == begun; };
  while (!is_done()) connection.run_until(is_done, std::chrono::milliseconds(1000));
  if (failure) throw rr::ClientException(*failure);
  return times;
}

void print_times(std::vector<Milliseconds> times, bool is_json, std::optional<Milliseconds> whole = {}) {
  std::sort(times.begin(), times.end());
  const auto at = [&](double part) {
    return times[static_cast<std::size_t>(part * static_cast<double>(times.size() - 1))];
  };
  std::optional<double> rate;
  if (whole) rate = 1000 * static_cast<double>(times.size()) / whole->count();
  if (is_json) {
    auto out = rr::OrderedJson::object();
    out["count"] = times.size();
    if (rate) out["per_second"] = *rate;
    out["min_ms"] = times.front().count();
    out["p50_ms"] = at(0.5).count();
    out["p99_ms"] = at(0.99).count();
    out["max_ms"] = times.back().count();
    return print_value(out, true);
  }
  std::cout << std::fixed << std::setprecision(3) << times.size() << " requests: min " << times.front().count()
            << " ms, p50 " << at(0.5).count() << " ms, p99 " << at(0.99).count() << " ms, max " << times.back().count()
            << " ms\n";
  if (rate) std::cout << std::setprecision(0) << *rate << " /s\n" << std::setprecision(3);
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

struct PingOptions : RemoteOptions {
  std::uint32_t count = 100;
};

int ping(const PingOptions& options) {
  return run_remote("ping", options.url, [&] {
    const auto root = open_service(remote_address(options));
    tell_who_answers(root);
    print_times(time_requests(root, options.count), options.is_json);
  });
}

struct BenchOptions : PingOptions {
  std::string property;
  std::uint32_t parallel = 16;
};

int bench(const BenchOptions& options) {
  return run_remote("bench", options.url, [&] {
    auto found = find_member(open_service(remote_address(options)), options.property);
    if (found.member)
      expect_kind(found, {rr::MemberKind::property}, "bench");
    else
      tell_who_answers(found.object);
    const auto begin = steady_clock::now();
    auto times = time_requests(found.object, found.member ? found.member->name : "", options.count, options.parallel);
    print_times(std::move(times), options.is_json, steady_clock::now() - begin);
  });
}

}  // namespace

void add_ping(Commands& commands) {
  const auto [app, options] = commands.add("ping", "Measure the latency of requests to a service", ping);
  add_url(app, options)->required();
  add_count(app, "--count", options.count, "Number of requests, one after the other")->option_text("N [100]");
  add_json(app, options);
  add_connection_options(app, options);
}

void add_bench(Commands& commands) {
  const auto [app, options] = commands.add("bench", "Measure many parallel requests to a service", bench);
  options.count = 10'000;
  add_url(app, options)->required();
  app.add_option("PROPERTY", options.property, "Property to read; default: a request to the node itself")
      ->option_text(" ");
  add_count(app, "--count", options.count, "Requests")->option_text("N [10000]");
  add_count(app, "--parallel", options.parallel, "Number of requests at the same time")->option_text("N [16]");
  add_json(app, options);
  add_connection_options(app, options);
}

}  // namespace rrgate
