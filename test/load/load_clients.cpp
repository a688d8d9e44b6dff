// load_clients: connects many clients in one process, and prints as JSON what they noticed.
//   load_clients --url URL [--wire PATH.MEMBER] [--pipe PATH.MEMBER] [--event PATH.MEMBER] [--clients N] [--seconds S]
//                [--stalled K] [--storm]
// "packets" are those of the pipe, and events.
// --stalled K  K of them stop reading when they are connected, until SIGUSR1; their values count nowhere.
// --storm      all connect at once, and whoever is lost comes back by itself, after a wait that grows and is half
//              chance. Without it 50 at a time connect, once.
// A line {"event": "ready", ...} each time nobody is waited for any more, from when on values are counted, and
// {"event": "stalled_lost", ...} for each stalled one whose connection ends, and {"event": "end", ...} after S seconds
// from the first "ready", or at SIGTERM.
#include <sys/resource.h>

#include <boost/asio/signal_set.hpp>
#include <cmath>
#include <csignal>
#include <iostream>
#include <list>
#include <map>
#include <nlohmann/json.hpp>

#include "node/driver/clocks.hpp"
#include "test/load/age_histogram.hpp"
#include "test/load/load_client.hpp"

namespace asio = boost::asio;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

namespace {

constexpr std::size_t openings_at_a_time = 50;
constexpr std::size_t max_reasons = 50;

struct Options {
  LoadPlan plan = {};
  std::size_t clients = 1;
  std::size_t stalled = 0;
  double seconds = INFINITY;
  bool is_storm = false;
};

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

Clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// How often each text was said.
class Reasons {
 public:
  void add(const std::string& reason) { ++counts_[counts_.size() < max_reasons ? reason : "others"]; }
  json to_json() const { return counts_; }

 private:
  std::map<std::string, std::uint64_t> counts_;
};

class Swarm final : private LoadOwner {
 public:
  Swarm(asio::io_context& io, const Options& options) : io_(io), options_(options), end_(io) {
    for (std::size_t i = 0; i < options.clients; ++i)
      clients_.emplace_back(io, options_.plan, static_cast<LoadOwner&>(*this), i < options.stalled);
    next_ = clients_.begin();
  }

  void start() {
    waiting_ = clients_.size();
    connect_more();
  }

  void resume() {
    for (auto& client : clients_) client.resume();
  }

  json report() const {
    const double window = measures_since_ ? seconds_since(*measures_since_) : 0;
    return {
        {"event", "end"},
        {"clients", clients_.size()},
        {"ready", ready_},
        {"first_values_seconds", first_values_seconds_},
        {"window_seconds", window},
        {"values", ages_.count()},
        {"rate", rates(window)},
        {"age_ms", {{"p50", ages_.percentile_ms(0.5)}, {"p99", ages_.percentile_ms(0.99)}, {"max", ages_.max_ms()}}},
        {"packets", packets_},
        {"packet_gaps", packet_gaps_},
        {"failed", failed_.to_json()},
        {"lost", lost_.to_json()},
        {"reconnects", reconnects_}};
  }

 private:
  void connect_more() {
    for (; next_ != clients_.end() && (options_.is_storm || openings_ < openings_at_a_time); ++next_) {
      ++openings_;
      next_->connect();
    }
  }

  void became_ready(LoadClient&) override {
    ++ready_;
    if (has_been_ready_) ++reconnects_;
    one_less_to_wait_for();
  }

  void received_value(LoadClient& client, rr::TimeSpec time) override {
    if (!measures_since_ || client.stalls()) return;
    const auto now = rr::read_clocks().utc;
    ages_.add(std::chrono::seconds(now.seconds - time.seconds) +
              std::chrono::nanoseconds(now.nanoseconds - time.nanoseconds));
    ++client.values;
  }

  void received_packet(LoadClient& client, bool is_next) override {
    if (client.stalls()) return;
    if (measures_since_) ++packets_;
    if (!is_next) ++packet_gaps_;
  }

  void ended(LoadClient& client, const rr::Error& reason) override {
    if (client.is_ready()) {
      --ready_;
      if (waiting_ == 0) waits_since_ = Clock::now();
      ++waiting_;
      ++openings_;
      note_lost(client, reason);
    } else {
      failed_.add(reason.message);
    }
    if (options_.is_storm)
      client.connect_later();
    else
      one_less_to_wait_for();
  }

  void note_lost(const LoadClient& client, const rr::Error& reason) {
    if (!client.stalls()) return lost_.add(reason.message);
    std::cout << json{{"event", "stalled_lost"}, {"reason", reason.message}} << std::endl;
  }

  void one_less_to_wait_for() {
    --openings_;
    connect_more();
    if (--waiting_ > 0) return;
    const double seconds = seconds_since(waits_since_);
    // A lost client that does not come back is no news for who waits for all.
    if (has_been_ready_ && !options_.is_storm) return;
    std::cout << json{{"event", "ready"}, {"ready", ready_}, {"seconds", seconds}, {"failed", failed_.to_json()}}
              << std::endl;
    if (std::exchange(has_been_ready_, true)) return;
    first_values_seconds_ = seconds;
    measures_since_ = Clock::now();
    if (std::isinf(options_.seconds)) return;
    end_.expires_after(to_duration(options_.seconds));
    end_.async_wait([this](const rr::error_code& error) {
      if (!error) io_.stop();
    });
  }

  /// Values a second of those who read.
  json rates(double window) const {
    std::vector<double> all;
    for (const auto& client : clients_)
      if (!client.stalls() && window > 0) all.push_back(static_cast<double>(client.values) / window);
    if (all.empty()) return nullptr;
    std::sort(all.begin(), all.end());
    return {{"min", all.front()}, {"median", all[all.size() / 2]}, {"max", all.back()}};
  }

  asio::io_context& io_;
  const Options& options_;
  std::list<LoadClient> clients_;
  std::list<LoadClient>::iterator next_;  ///< the first that has not connected yet
  std::size_t openings_ = 0;              ///< begun, neither ready nor failed
  std::size_t waiting_ = 0;               ///< not ready yet and not given up
  std::size_t ready_ = 0;
  bool has_been_ready_ = false;
  Clock::time_point waits_since_ = Clock::now();
  double first_values_seconds_ = 0;
  std::optional<Clock::time_point> measures_since_;
  AgeHistogram ages_;
  std::uint64_t packets_ = 0;
  std::uint64_t packet_gaps_ = 0;
  std::uint64_t reconnects_ = 0;
  Reasons failed_;
  Reasons lost_;
  asio::steady_timer end_;
};

Options parse_options(int argc, char** argv) {
  std::map<std::string, std::string> given;
  Options out;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--storm") {
      out.is_storm = true;
    } else {
      if (i + 1 == argc) throw std::invalid_argument(name + " needs a value");
      given[name] = argv[++i];
    }
  }
  const auto take = [&](const char* name, const std::string& otherwise) {
    const auto found = given.extract(name);
    return found.empty() ? otherwise : found.mapped();
  };
  const auto url = rr::parse_url(take("--url", ""));
  if (!url) throw std::invalid_argument("--url: " + url.error().message);
  out.plan.url = *url;
  out.plan.wire = MemberName::parse(take("--wire", ""));
  out.plan.pipe = MemberName::parse(take("--pipe", ""));
  out.plan.event = MemberName::parse(take("--event", ""));
  out.clients = std::stoul(take("--clients", "1"));
  out.stalled = std::stoul(take("--stalled", "0"));
  out.seconds = std::stod(take("--seconds", "inf"));
  if (!given.empty()) throw std::invalid_argument("unknown option " + rr::quote(given.begin()->first));
  return out;
}

void allow_many_files() {
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &files);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Options options = parse_options(argc, argv);
    allow_many_files();
    asio::io_context io(1);
    Swarm swarm(io, options);
    asio::signal_set signals(io, SIGTERM, SIGINT);
    signals.async_wait([&](const rr::error_code&, int) { io.stop(); });
    asio::signal_set resume(io, SIGUSR1);
    resume.async_wait([&](const rr::error_code& error, int) {
      if (!error) swarm.resume();
    });
    swarm.start();
    io.run();
    std::cout << swarm.report() << std::endl;
    std::_Exit(0);  // thousands of connections need not be taken down one by one
  } catch (const std::exception& failure) {
    std::cerr << "load_clients: " << failure.what() << '\n';
    return 2;
  }
}
