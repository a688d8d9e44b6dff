// Dialing: several ways at once, and giving up on demand. How each session looks after its peer.
#include "node/transport/dial.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <catch2/catch.hpp>

#include "node/transport/race.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/sandbox.hpp"

using namespace rr;
namespace asio = boost::asio;
using asio::ip::tcp;
using Catch::Matchers::Contains;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

std::string url_at(std::uint16_t port, const std::string& scheme = "rr+tcp") {
  return scheme + "://127.0.0.1:" + std::to_string(port) + "/?service=x";
}

/// Nobody listens there.
std::uint16_t dead_port() {
  asio::io_context io;
  const tcp::acceptor acceptor(io, {asio::ip::address_v4::loopback(), 0});
  return acceptor.local_endpoint().port();
}

/// Listens, but answers no further connection: its queue is full.
class Hanging {
 public:
  Hanging() : acceptor_(io_, tcp::v4()) {
    acceptor_.bind({asio::ip::address_v4::loopback(), 0});
    acceptor_.listen(0);
    for (int i = 0; i < 8; ++i) {
      fillers_.emplace_back(io_, tcp::v4());
      fillers_.back().async_connect(acceptor_.local_endpoint(), [](const auto&) {});
    }
  }
  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

 private:
  asio::io_context io_;  // never run
  tcp::acceptor acceptor_;
  std::vector<tcp::socket> fillers_;
};

/// Accepts, and says nothing.
class Silent {
 public:
  Silent() : acceptor_(io_, {asio::ip::address_v4::loopback(), 0}) {}
  std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

 private:
  asio::io_context io_;
  tcp::acceptor acceptor_;
};

struct Outcome {
  Error error;
  std::string peer;
  milliseconds took;
  bool is_given_up;
};

/// Dials until the loop has nothing more to do; `stop_after` zero: nobody stops it.
Outcome dialed(const std::vector<std::string>& texts, milliseconds timeout, milliseconds stop_after = {}) {
  asio::io_context io(1);
  std::vector<ConnectionUrl> urls;
  for (const auto& text : texts) urls.push_back(parse_url(text).value());
  DialOptions options;
  options.timeout = timeout;
  asio::cancellation_signal giving_up;
  Outcome outcome{{ErrorCode::none, ""}, "", {}, false};
  const auto begin = std::chrono::steady_clock::now();
  const auto work = [&]() -> awaitable<void> {
    auto stream = co_await dial_any(urls, options);
    if (stream)
      outcome.peer = (*stream)->peer();
    else
      outcome.error = stream.error();
  };
  const auto ended = [&outcome](std::exception_ptr failure) { outcome.is_given_up = failure != nullptr; };
  asio::co_spawn(io, work, asio::bind_cancellation_slot(giving_up.slot(), ended));
  asio::steady_timer stop(io);
  if (stop_after > milliseconds::zero()) {
    stop.expires_after(stop_after);
    stop.async_wait([&giving_up](const auto&) { giving_up.emit(asio::cancellation_type::terminal); });
  }
  io.run();
  outcome.took = std::chrono::duration_cast<milliseconds>(std::chrono::steady_clock::now() - begin);
  return outcome;
}

std::shared_ptr<Service> make_service() {
  auto service = Service::from_text({"service test.one\nobject One\nproperty int32 one [readonly]\nend\n"}, "x", "One");
  service->property("one").get([] { return 1; });
  return service;
}

/// Messages that a client receives within a while, in which nobody asks for anything.
std::uint64_t idle_messages(const std::string& url, ConnectOptions options) {
  auto one = connect(url, std::move(options));
  const auto& session = one.connection().asynchronous().session();
  const auto before = session.connection().stats().messages_received;
  one.connection().run_for(milliseconds(600));
  return session.connection().stats().messages_received - before;
}

}  // namespace

TEST_CASE("of several URLs the first to be reached wins, and the others end with it") {
  const Hanging hanging;
  const Silent silent;
  const auto outcome = dialed({url_at(hanging.port()), url_at(dead_port()), url_at(silent.port())}, seconds(30));
  CHECK(outcome.error.code == ErrorCode::none);
  CHECK(outcome.peer == "127.0.0.1:" + std::to_string(silent.port()));
  CHECK(outcome.took < seconds(5));
}

TEST_CASE("where no URL works, the reason of each is told") {
  const Sandbox sandbox;
  const Hanging hanging;
  const auto dead = dead_port();
  const auto outcome =
      dialed({url_at(hanging.port()), "rr+local:///?nodename=nobody&service=x", url_at(dead)}, milliseconds(300));
  CHECK(outcome.error.code == ErrorCode::node_not_found);  // says more than what others fail by
  CHECK_THAT(outcome.error.message, Contains("none of 3 ways works"));
  CHECK_THAT(outcome.error.message,
             Contains("127.0.0.1:" + std::to_string(hanging.port()) + ": no answer within 300 ms"));
  CHECK_THAT(outcome.error.message, Contains(std::to_string(dead) + ": Connection refused"));
  CHECK_THAT(outcome.error.message, Contains("nodename=nobody&service=x: no such node of this machine"));

  const auto alone = dialed({url_at(dead)}, seconds(5));
  CHECK(alone.error.message == "connect to 127.0.0.1:" + std::to_string(dead) + ": Connection refused");
  CHECK(dialed({}, seconds(5)).error.message == "connect: no URL that can be dialed");
}

TEST_CASE("dialing is given up on demand, wherever it waits") {
  const Hanging hanging;
  const Silent silent;
  for (const auto& url : {url_at(hanging.port()), url_at(silent.port(), "rr+ws"), url_at(silent.port(), "rrs+tcp"),
                          url_at(silent.port(), "rr+wss"), url_at(silent.port(), "rrs+ws")}) {
    INFO(url);
    const auto outcome = dialed({url, url}, seconds(60), milliseconds(100));
    CHECK(outcome.is_given_up);
    CHECK(outcome.took < seconds(5));
  }
}

TEST_CASE("a client takes the quickest of several URLs") {
  const Hanging hanging;
  RunningNode node([](Node& made) { made.add(make_service()); });
  ConnectOptions options;
  options.other_urls = {node.url("x")};
  CHECK(connect(url_at(hanging.port()), options).get("one").to<std::int32_t>().value() == 1);
  options.other_urls = {"rr+nonsense://x/?service=x"};
  CHECK(error_of([&] { connect(node.url("x"), options); }).code == ErrorCode::connection_error);
}

TEST_CASE("every transport has the heartbeat of the reference") {
  CHECK(heartbeat_of("rr+tcp") == Heartbeat{seconds(10), seconds(15)});
  CHECK(heartbeat_of("rrs+wss") == Heartbeat{seconds(10), seconds(15)});
  CHECK(heartbeat_of("rr+local") == Heartbeat{seconds(30), seconds(600)});
  CHECK(heartbeat_of("rr+usb") == Heartbeat{seconds(5), seconds(15)});
  CHECK(heartbeat_of("rr+pci") == Heartbeat{seconds(5), seconds(15)});
}

TEST_CASE("heartbeats come as often as client or service want them") {
  const auto prepare = [](Node& made) { made.add(make_service()); };
  RunningNode calm(prepare);
  CHECK(idle_messages(calm.url("x"), {}) == 0);
  ConnectOptions nervous;
  nervous.heartbeat = Heartbeat{milliseconds(50), seconds(15)};
  CHECK(idle_messages(calm.url("x"), nervous) >= 3);  // the answers
  NodeOptions options;
  options.heartbeat = Heartbeat{milliseconds(50), seconds(15)};
  RunningNode asking(prepare, options);
  CHECK(idle_messages(asking.url("x"), {}) >= 3);
}

TEST_CASE("a way that throws is one that does not work, and nobody waits for it") {
  asio::io_context io(1);
  std::string told;
  const auto work = [&]() -> awaitable<void> {
    std::vector<Runner<int>> runners;
    runners.push_back({"odd", []() -> awaitable<Result<int>> {
                         throw std::bad_alloc();
                         co_return 1;
                       }});
    const auto winner = co_await race<int>(std::move(runners), milliseconds(1), make_error(ErrorCode::none, ""));
    told = winner ? "it has won" : winner.error().message;
  };
  asio::co_spawn(io, work, asio::detached);
  io.run_for(seconds(10));
  CHECK(told == "it can't be tried");
}
