// A device of the gateway by itself: which of its URLs is taken, and how it stops.
#include "server/upstream/device_registry.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"

using namespace rrgate;
using boost::asio::ip::tcp;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

/// Listens, but answers no further connection: its queue is full.
class Hanging {
 public:
  Hanging() : acceptor_(io_, tcp::v4()) {
    acceptor_.bind({boost::asio::ip::address_v4::loopback(), 0});
    acceptor_.listen(0);
    for (int i = 0; i < 8; ++i) {
      fillers_.emplace_back(io_, tcp::v4());
      fillers_.back().async_connect(acceptor_.local_endpoint(), [](const auto&) {});
    }
  }
  rr::ConnectionUrl url() const {
    return rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(acceptor_.local_endpoint().port()) + "/?service=x")
        .value();
  }

 private:
  boost::asio::io_context io_;  // never run
  tcp::acceptor acceptor_;
  std::vector<tcp::socket> fillers_;
};

/// A device on a loop of its own, watched.
struct Watched {
  explicit Watched(rr::ConnectionUrl url) {
    config.timeouts.connect = seconds(60);
    DeviceConfig made;
    made.name = "x";
    made.url = std::move(url);
    device = std::make_shared<Device>(io.get_executor(), std::move(made), config);
  }
  void start() {
    const auto watch = [kept = device]() -> rr::awaitable<void> { co_await kept->watch(); };
    boost::asio::co_spawn(io, watch, boost::asio::detached);
  }
  /// Until nothing is left to do.
  milliseconds run_out() {
    const auto begin = std::chrono::steady_clock::now();
    io.restart();
    io.run();
    return std::chrono::duration_cast<milliseconds>(std::chrono::steady_clock::now() - begin);
  }

  Config config;
  boost::asio::io_context io{1};
  std::shared_ptr<Device> device;
};

}  // namespace

TEST_CASE("a device that hangs while it is dialed stops at once, for its clients too") {
  const Hanging hanging;
  Watched watched(hanging.url());
  watched.start();
  std::optional<rr::Error> failure;
  boost::asio::co_spawn(watched.io, watched.device->connect(), [&](std::exception_ptr, auto stream) {
    if (!stream) failure = stream.error();
  });
  watched.io.run_for(milliseconds(200));
  CHECK_FALSE(failure);
  watched.device->stop();
  CHECK(watched.run_out() < seconds(5));
  REQUIRE(failure);
  CHECK(failure->code == rr::ErrorCode::operation_aborted);
}

TEST_CASE("a device may be stopped between any two turns of its loop while it is dialed") {
  boost::asio::io_context io;
  tcp::acceptor closed(io, {boost::asio::ip::address_v4::loopback(), 0});
  const auto url =
      rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(closed.local_endpoint().port()) + "/?service=x");
  closed.close();  // who dials there fails in a few turns
  for (int turns = 0; turns < 60; ++turns) {
    Watched watched(url.value());
    watched.start();
    bool has_ended = false;
    boost::asio::co_spawn(watched.io, watched.device->connect(),
                          [&](const std::exception_ptr&, const auto&) { has_ended = true; });
    for (int turn = 0; turn < turns; ++turn) watched.io.poll_one();
    watched.device->stop();
    CHECK(watched.run_out() < seconds(5));
    CHECK(has_ended);
  }
}

TEST_CASE("devices that are not configured stay at a reload, and follow what it says of all devices") {
  boost::asio::io_context io{1};
  Config config;
  DeviceRegistry registry(io.get_executor(), config);
  std::vector<const Device*> devices;
  for (const auto* name : {"found", "page", "replay~arm.x.20261125T083000123Z"}) {
    DeviceConfig made;
    made.name = name;
    made.url = rr::parse_url("rr+tcp://127.0.0.1:1/?service=x").value();
    made.is_found = made.name == "found";
    made.is_served = made.name == "page";
    devices.push_back(&registry.add(std::move(made), nullptr));
  }
  config.timeouts.request = milliseconds(1234);
  config.retry = {milliseconds(11), milliseconds(12), milliseconds(13)};
  registry.replace(registry.prepare(config).value());
  for (const auto* device : devices) {
    REQUIRE(registry.has(*device));
    CHECK(device->request_timeout() == milliseconds(1234));
    CHECK(device->retry() == config.retry);
  }
  registry.stop();
  io.run();
}

TEST_CASE("who asks for no device in particular gets none that plays a recording") {
  boost::asio::io_context io{1};
  const Config config;
  DeviceRegistry registry(io.get_executor(), config);
  const auto add = [&](const char* name) {
    DeviceConfig made;
    made.name = name;
    made.url = rr::parse_url("rr+tcp://127.0.0.1:1/?service=x").value();
    made.is_found = made.name == "found";
    return &registry.add(std::move(made), nullptr);
  };
  const auto* replay = add("replay~arm.x.20261125T083000123Z");
  CHECK(registry.route({}, {}) == nullptr);
  const auto* found = add("found");
  CHECK(registry.route({}, {}) == found);
  registry.remove(*found);
  registry.remove(*replay);
  io.run();
}

TEST_CASE("a reload with shorter waits ends the wait that is under way") {
  boost::asio::io_context io{1};
  rr::Node node(io, "test.device");
  const auto port = node.listen("rr+tcp://127.0.0.1:0");
  node.stop();  // nobody answers there yet
  Config config;
  config.retry = {std::chrono::hours(1), std::chrono::hours(1), std::chrono::hours(1)};
  DeviceConfig made;
  made.name = "x";
  made.url = rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=x").value();
  const auto device = std::make_shared<Device>(io.get_executor(), made, config);
  device->start();
  const auto run_until = [&](DeviceState state) {
    const auto end = std::chrono::steady_clock::now() + seconds(10);
    while (device->state() != state && std::chrono::steady_clock::now() < end) io.run_one_for(milliseconds(50));
    return device->state() == state;
  };
  REQUIRE(run_until(DeviceState::offline));
  rr::Node again(io, "test.device");
  again.listen("rr+tcp://127.0.0.1:" + std::to_string(port));
  const auto change = [&](const Retry& retry) {
    config.retry = retry;
    device->become(made, config);
  };
  change({milliseconds(10), milliseconds(10), std::chrono::hours(1)});
  REQUIRE(run_until(DeviceState::online));
  again.stop();
  change({milliseconds(10), milliseconds(10), milliseconds(10)});
  CHECK(run_until(DeviceState::offline));
  device->stop();
  io.run_for(seconds(2));
}

TEST_CASE("of devices that are one node a client gets one that is online, and no other robot of its name") {
  const bool is_another = GENERATE(false, true);
  boost::asio::io_context io{1};
  rr::Node node(io, "test.arm");
  const auto port = node.listen("rr+tcp://127.0.0.1:0");
  Config config;
  for (const auto* where : {"1", "live"}) {
    DeviceConfig made;
    made.name = where;
    const auto its_port = made.name == "live" ? std::to_string(port) : made.name;
    const std::string id = is_another && made.name != "live" ? "nodeid={11111111-2222-3333-4444-555555555555}&" : "";
    made.url = rr::parse_url("rr+tcp://127.0.0.1:" + its_port + "/?" + id + "nodename=test.arm&service=x").value();
    config.devices.push_back(std::move(made));
  }
  DeviceRegistry registry(io.get_executor(), config);
  const auto* away = registry.find("1");
  const auto* live = registry.find("live");
  CHECK(registry.route({}, "test.arm") == away);  // neither has answered
  registry.start();
  const auto end = std::chrono::steady_clock::now() + seconds(10);
  while (live->state() != DeviceState::online && std::chrono::steady_clock::now() < end)
    io.run_one_for(milliseconds(50));
  CHECK(registry.route({}, "test.arm") == (is_another ? away : live));
  CHECK(registry.route(node.identity().id, {}) == live);
  registry.stop();
  node.stop();
  io.run_for(seconds(2));
}

TEST_CASE("of the URLs of a found device the one that answers is taken, whichever hangs") {
  const Hanging hanging;
  rr::RunningNode node([](rr::Node&) {});
  const auto good = rr::parse_url(node.url("x")).value();
  Watched watched(hanging.url());
  watched.device->set_urls({hanging.url(), good});
  watched.start();
  for (int i = 0; i < 100 && watched.device->state() != DeviceState::online; ++i) {
    watched.io.restart();
    watched.io.run_for(milliseconds(50));
  }
  CHECK(watched.device->state() == DeviceState::online);
  CHECK(watched.device->config().url == good);
  CHECK(watched.device->identity()->node_name == "test.node");
  watched.device->stop();
  CHECK(watched.run_out() < seconds(5));
}

TEST_CASE("a device that ends the connection says so once") {
  Watched watched(rr::ConnectionUrl{});
  tcp::acceptor acceptor(watched.io, {boost::asio::ip::address_v4::loopback(), 0});
  acceptor.async_accept([](const auto&, const tcp::socket&) {});  // which closes it
  watched.device->set_urls(
      {rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()) + "/?service=x")
           .value()});
  watched.start();
  for (int i = 0; i < 100 && watched.device->state() != DeviceState::offline; ++i) {
    watched.io.restart();
    watched.io.run_for(milliseconds(50));
  }
  CHECK(watched.device->last_error() == "device: closed the connection without an answer");
  watched.device->stop();
  acceptor.close();
  watched.run_out();
}
