// Looks at a device that has no room for another connection while a session with it is open.
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>

#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;
using boost::asio::ip::tcp;

namespace {

constexpr auto token = boost::asio::as_tuple(boost::asio::use_awaitable);

/// In front of a node: counts who comes, and has room for one at a time.
class Turnstile : public std::enable_shared_from_this<Turnstile> {
 public:
  Turnstile(boost::asio::io_context& io, std::uint16_t node)
      : node_(boost::asio::ip::address_v4::loopback(), node),
        acceptor_(io, {boost::asio::ip::address_v4::loopback(), 0}) {}

  void start() { boost::asio::co_spawn(acceptor_.get_executor(), accept(shared_from_this()), boost::asio::detached); }
  void stop() { acceptor_.close(); }
  rr::ConnectionUrl url() const {
    const auto port = std::to_string(acceptor_.local_endpoint().port());
    return rr::parse_url("rr+tcp://127.0.0.1:" + port + "/?service=bench").value();
  }

  int let_in = 0;
  int turned_away = 0;

 private:
  struct Pair {
    tcp::socket client;
    tcp::socket node;
    std::shared_ptr<Turnstile> by;
    Pair(tcp::socket from, std::shared_ptr<Turnstile> its)
        : client(std::move(from)), node(client.get_executor()), by(std::move(its)) {}
    ~Pair() { by->is_taken_ = false; }
    void close() {
      client.close();
      node.close();
    }
  };

  static rr::awaitable<void> accept(std::shared_ptr<Turnstile> self) {
    for (;;) {
      auto [failed, client] = co_await self->acceptor_.async_accept(token);
      if (failed) co_return;
      if (self->is_taken_) {
        ++self->turned_away;
        continue;
      }
      ++self->let_in;
      self->is_taken_ = true;
      const auto pair = std::make_shared<Pair>(std::move(client), self);
      boost::asio::co_spawn(self->acceptor_.get_executor(), join(pair), boost::asio::detached);
    }
  }
  static rr::awaitable<void> join(std::shared_ptr<Pair> pair) {
    const auto [failed] = co_await pair->node.async_connect(pair->by->node_, token);
    if (failed) co_return pair->close();
    boost::asio::co_spawn(pair->client.get_executor(), pump(pair, pair->node, pair->client), boost::asio::detached);
    co_await pump(pair, pair->client, pair->node);
  }
  static rr::awaitable<void> pump(std::shared_ptr<Pair> pair, tcp::socket& from, tcp::socket& to) {
    std::array<char, 4096> bytes;
    for (;;) {
      const auto [failed, count] = co_await from.async_read_some(boost::asio::buffer(bytes), token);
      if (failed) break;
      const auto [unsent, sent] = co_await boost::asio::async_write(to, boost::asio::buffer(bytes, count), token);
      if (unsent) break;
    }
    pair->close();
  }

  tcp::endpoint node_;
  tcp::acceptor acceptor_;
  bool is_taken_ = false;
};

/// The bench's device with a turnstile in front of it, looked at often.
struct SmallDevice {
  Counting counting;
  UpstreamBench bench{counting.service};
  std::shared_ptr<Turnstile> turnstile = std::make_shared<Turnstile>(bench.io, bench.port);

  SmallDevice() {
    turnstile->start();
    bench.config.retry = {10ms, 10ms, 10ms};
    const auto config = bench.device->config();
    bench.device->become(config, bench.config);
    bench.device->set_urls({turnstile->url()});
    bench.device->start();
    REQUIRE(is(DeviceState::online));
    bench.upstream->keep_open();
    REQUIRE(bench.run_until([&] { return bench.upstream->is_open(); }));
  }
  ~SmallDevice() { turnstile->stop(); }
  SmallDevice(const SmallDevice&) = delete;
  SmallDevice& operator=(const SmallDevice&) = delete;

  bool is(DeviceState state) {
    return bench.run_until([&] { return bench.device->state() == state; });
  }
};

}  // namespace

TEST_CASE("a device that has no room beside its session is online, and is not looked at until that ends") {
  SmallDevice small;
  auto& bench = small.bench;
  auto& turnstile = *small.turnstile;
  // Another device, which nobody uses, says how many looks this one would have had.
  Counting other;
  rr::Node unused(bench.io, "test.other");
  unused.add(other.service);
  const auto beside = std::make_shared<Turnstile>(bench.io, unused.listen("rr+tcp://127.0.0.1:0"));
  beside->start();
  DeviceConfig config = bench.device->config();
  config.url = beside->url();
  const auto compared = std::make_shared<Device>(bench.io.get_executor(), config, bench.config);
  const auto before = turnstile.turned_away;
  compared->start();
  REQUIRE(bench.run_until([&] { return beside->let_in >= 20; }));
  CHECK(bench.upstream->is_open());
  CHECK(bench.device->state() == DeviceState::online);
  CHECK(turnstile.turned_away - before <= 1);
  compared->stop();
  beside->stop();
  unused.stop();

  const auto entered = turnstile.let_in;
  bench.upstream->close();
  CHECK(bench.run_until([&] { return turnstile.let_in >= entered + 3; }));
  CHECK(small.is(DeviceState::online));
}

TEST_CASE("a device that has gone with its session is offline, though a look had been in vain before") {
  SmallDevice small;
  REQUIRE(small.bench.run_until([&] { return small.turnstile->turned_away > 0; }));
  CHECK(small.bench.device->state() == DeviceState::online);
  small.bench.node.stop();
  CHECK(small.is(DeviceState::offline));
}
