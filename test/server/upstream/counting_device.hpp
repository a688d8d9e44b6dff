// A device that counts what it is asked, below a gateway that may offer leases of it. Test support.
#pragma once

#include "server/upstream/lock_table.hpp"
#include "test/server/upstream/upstream_bench.hpp"

namespace rrgate::test {

using namespace std::chrono_literals;

inline constexpr const char* bench_definition = R"(service test.bench
stdver 0.10
object Part
    wire double level [readonly]
end
object Motor
    function void stop()
end
object Bench
    event struck(int32 number)
    wire double level [readonly]
    wire double wish [writeonly]
    pipe int32 news [readonly]
    property int32 number
    callback int32 ask()
    function int32{generator} count()
    function void fill(uint8[]{generator} bytes)
    function void wait()
    function void halt() [nolock]
    function void take(uint8[] bytes)
    function void stop()
    objref Bench spare
    objref Bench{int32} others
    objref Part{int32} parts
    objref varobject{int32} things
end
)";

struct Counting {
  std::shared_ptr<const bool> life = std::make_shared<const bool>(true);
  std::shared_ptr<rr::Service> service = rr::Service::from_text({bench_definition}, "bench", "Bench");
  std::optional<rr::Reply<void>> waiting;  ///< whoever called wait() or halt()
  std::vector<std::string> commands;       ///< calls of stop(), and values of "wish"
  std::int32_t number = 1;
  int reads = 0;  ///< of the number
  std::shared_ptr<rr::Object> thing;

  Counting() {
    service->generator(
        "count", [this] { return [next = 0, token = life]() mutable { return std::optional<std::int32_t>(++next); }; });
    service->generator("fill", [this] {
      rr::Generator made;
      made.start = [token = life](rr::Value, const std::shared_ptr<rr::LateCall>& call) { call->answer(rr::Value()); };
      return made;
    });
    service->root().objref("spare", std::shared_ptr<rr::Object>());
    service->root().objref("others", [](std::string_view) { return std::shared_ptr<rr::Object>(); });
    service->root().objref("parts", [](std::string_view) { return std::shared_ptr<rr::Object>(); });
    service->root().objref("things", [this](std::string_view) { return thing; });
    service->function("wait", [this](rr::Reply<void> reply) { waiting = std::move(reply); });
    service->function("halt", [this](rr::Reply<void> reply) { waiting = std::move(reply); });
    service->function("take", [](const std::vector<std::uint8_t>&) {});
    service->property("number")
        .get([this] {
          ++reads;
          return number;
        })
        .set([this](std::int32_t value) { number = value; });
    service->function("stop", [this] { commands.emplace_back("stop"); });
    service->on_wire("wish", [this](double value) { commands.push_back(std::to_string(value)); });
  }
  void put_thing(const std::string& type) {
    thing = service->make_object(type);
    if (type == "Motor") thing->function("stop", [this] { commands.emplace_back("stop"); });
  }
  /// Generators that clients have opened and not closed.
  long open_generators() const { return life.use_count() - 1; }
};

inline LeaseConfig leases_with(const std::string& function) {
  LeaseConfig leases;
  leases.is_offered = true;
  leases.safe = {{SafeAction::Kind::call, "bench", function, "[]"}};
  return leases;
}

/// About a lease, of the whole service if nothing else is said, by `upstream`.
inline rr::ErrorCode ask_for_lease(UpstreamBench& bench, const std::shared_ptr<Upstream>& upstream,
                                   HearingClient& holder, rr::LockCommand command,
                                   std::chrono::milliseconds deadman = 10s, const std::string& path = "bench") {
  std::optional<rr::ErrorCode> answer;
  rr::LockWanted wanted;
  wanted.command = command;
  wanted.path = path;
  wanted.timeout = deadman;
  upstream->lock(holder, wanted,
                 [&](const rr::Result<>& result) { answer = result ? rr::ErrorCode::none : result.error().code; });
  REQUIRE(bench.run_until([&] { return answer.has_value(); }));
  return *answer;
}

inline void take_lease(UpstreamBench& bench, const std::shared_ptr<Upstream>& upstream, HearingClient& holder,
                       std::chrono::milliseconds deadman = 10s) {
  REQUIRE(ask_for_lease(bench, upstream, holder, rr::LockCommand::acquire_lease, deadman) == rr::ErrorCode::none);
}

/// What the gateway asks in sessions that are opened from now on is answered within this time, or it has failed.
inline void answer_within(UpstreamBench& bench, std::chrono::milliseconds timeout) {
  bench.config.timeouts.request = timeout;
  const auto config = bench.device->config();
  bench.device->become(config, bench.config);
}

inline void cut(UpstreamBench& bench, const std::shared_ptr<Upstream>& upstream) {
  upstream->connection()->close(rr::make_error(rr::ErrorCode::connection_error, "the line was cut"));
  REQUIRE(bench.run_until([&] { return !upstream->is_open(); }));
}

}  // namespace rrgate::test
