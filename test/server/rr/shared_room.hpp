// A device, the gateway's node that shares it, and clients of that node, all on one loop. Test support.
#pragma once

#include <map>

#include "core/support/random.hpp"
#include "server/rr/shared_node.hpp"
#include "test/node/transport/memory_stream.hpp"
#include "test/server/upstream/counting_device.hpp"

namespace rrgate::test {

using ConnectionPtr = std::shared_ptr<rr::ClientConnection>;
using Admit = std::function<rr::Result<>(const rr::MemberAccess&)>;

struct SharedRoom {
  Counting device;
  UpstreamBench bench;
  MemoryBudget memory{100'000'000};
  Access access;
  Logins logins;
  SharedNode node;
  std::shared_ptr<SharedService> service;
  int left = 0;  ///< clients that have gone

  explicit SharedRoom(const rr::SecurityPolicy& policy = {}, const AccessConfig& rights = {})
      : bench(with(policy)),
        access(rights),
        logins(bench.io.get_executor(), access),
        node({rr::random_node_id(), "gateway"}, bench.config, logins) {
    REQUIRE(access.load().has_value());
    // Nothing is tried again by itself.
    auto config = bench.device->config();
    bench.config.retry = {60s, 60s, 60s};
    bench.device->become(config, bench.config);
    service = std::make_shared<SharedService>(bench.device, "bench", std::vector<ServiceBoard*>{&node});
    service->start(1ms);
    REQUIRE(bench.run_until([&] { return service->hosted() && service->upstream()->is_resting(); }));
  }
  ~SharedRoom() {
    node.close();
    service->stop();
  }
  SharedRoom(const SharedRoom&) = delete;
  SharedRoom& operator=(const SharedRoom&) = delete;

  const std::shared_ptr<Upstream>& upstream() const { return service->upstream(); }
  bool run_until(const std::function<bool()>& is_so) { return bench.run_until(is_so); }

  /// A client that connects to the service. `came`  becomes the gateway's side of it.
  rr::Result<ConnectionPtr> come(const std::string& user = {}, Admit admit = nullptr,
                                 std::shared_ptr<SharedClient>* came = nullptr) {
    rr::test::MemoryStreams streams(bench.io.get_executor());
    SharedArrival arrival{.admit = std::move(admit), .memory = memory.charge("one")};
    const auto client = node.add(std::move(streams.server), std::move(arrival), [this] { ++left; });
    if (came) *came = client;
    rr::ConnectOptions options;
    options.service = "bench";
    options.username = user;
    if (!user.empty()) options.credentials = rr::Value(rr::MapString{{{"password", rr::Value("secret")}}});
    std::optional<rr::Result<ConnectionPtr>> opened;
    rr::ClientConnection::open(std::move(streams.client), std::move(options),
                               [&](rr::Result<ConnectionPtr> result) { opened = std::move(result); });
    REQUIRE(run_until([&] { return opened.has_value(); }));
    return *opened;
  }
  /// One for whom the session with the device is open.
  ConnectionPtr enter(Admit admit = nullptr, std::shared_ptr<SharedClient>* came = nullptr) {
    auto connection = come({}, std::move(admit), came);
    REQUIRE(connection.has_value());
    REQUIRE(run_until([&] { return upstream()->is_open(); }));
    return *connection;
  }
  /// What a client's request comes to.
  template <class Ask>
  rr::Result<rr::Value> answer(Ask ask) {
    std::optional<rr::Result<rr::Value>> result;
    ask([&](rr::Result<rr::Value> came) { result = std::move(came); });
    REQUIRE(run_until([&] { return result.has_value(); }));
    return *result;
  }

 private:
  const std::shared_ptr<rr::Service>& with(const rr::SecurityPolicy& policy) {
    device.service->set_security(policy);
    return device.service;
  }
};

}  // namespace rrgate::test
