// What a response does when its client reads slowly, goes away, or asks for the next one already.
#include "server/http/response_writer.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <catch2/catch.hpp>
#include <deque>

using namespace rrgate;
namespace asio = boost::asio;
using std::chrono::milliseconds;

namespace {

/// A client that sends what the test says, and takes nothing while it is full.
class FakeClient final : public rr::ByteStream {
 public:
  explicit FakeClient(asio::io_context& io) : io_(io), changed_(io, asio::steady_timer::time_point::max()) {}

  void send(std::string text) {
    sent_.push_back(std::move(text));
    changed_.cancel();
  }
  void go() { send(""); }

  rr::awaitable<rr::ReadResult> read_some(std::span<std::uint8_t> into) override {
    if (const auto count = take_put_back(into)) co_return rr::ReadResult{{}, count};
    if (trickles) {
      asio::steady_timer pause(io_, milliseconds(2));
      co_await pause.async_wait(asio::as_tuple(asio::use_awaitable));
      into[0] = 'a';
      co_return rr::ReadResult{{}, 1};
    }
    const auto cancels = cancels_;
    while (sent_.empty() && !is_closed && cancels == cancels_) co_await wait();
    if (sent_.empty()) co_return rr::ReadResult{asio::error::operation_aborted, 0};
    const auto text = std::move(sent_.front());
    sent_.pop_front();
    std::copy(text.begin(), text.end(), into.begin());
    co_return rr::ReadResult{{}, text.size()};
  }
  rr::awaitable<rr::error_code> write(std::span<const rr::ByteSpan> slices) override {
    while (is_full && !is_closed) co_await wait();
    if (is_closed) co_return asio::error::operation_aborted;
    for (const auto& slice : slices) received += rr::as_text(slice);
    co_return rr::error_code();
  }
  void finish_sending() override {}
  void cancel() override {
    ++cancels_;
    changed_.cancel();
  }
  rr::awaitable<void> end(const rr::EndReason&) override {
    close();
    co_return;
  }
  void close() override {
    is_closed = true;
    changed_.cancel();
  }
  std::string peer() const override { return "fake"; }
  asio::any_io_executor executor() override { return io_.get_executor(); }

  std::string received;
  bool is_full = false;
  bool is_closed = false;
  bool trickles = false;  ///< sends a byte now and then, each just before its reading is cancelled

 private:
  rr::awaitable<void> wait() { co_await changed_.async_wait(asio::as_tuple(asio::use_awaitable)); }

  asio::io_context& io_;
  asio::steady_timer changed_;
  std::deque<std::string> sent_;
  unsigned cancels_ = 0;
};

struct Exchange {
  explicit Exchange(std::size_t memory = 1'000'000, milliseconds patience = milliseconds(60'000))
      : budget(memory),
        writer(client, reader, request, budget.charge("a"),
               ResponseOptions{.patience = patience, .metrics = &metrics}) {
    request.message.version(11);
  }
  /// Until nothing more happens, or the work is done.
  template <class Work>
  void run(Work work) {
    bool is_done = false;
    auto running = work();
    asio::co_spawn(io, std::move(running), [&](const std::exception_ptr& failure) {
      if (failure) std::rethrow_exception(failure);
      is_done = true;
    });
    while (!is_done && io.run_one_for(std::chrono::seconds(10)) > 0) continue;
    REQUIRE(is_done);
  }

  asio::io_context io{1};
  FakeClient client{io};
  RequestReader reader{client, {8192, milliseconds(1000), milliseconds(1000)}};
  Request request;
  MemoryBudget budget;
  Metrics metrics;
  ResponseWriter writer;
};

}  // namespace

TEST_CASE("a client that takes its response too slowly is cut") {
  Exchange exchange(1'000'000, milliseconds(50));
  exchange.client.is_full = true;
  rr::error_code failed;
  const auto begin = std::chrono::steady_clock::now();
  exchange.run([&]() -> rr::awaitable<void> {
    const auto response = text_response(200, "text/plain", std::string(1000, 'x'));
    failed = co_await exchange.writer.send(response);
  });
  CHECK(failed);
  CHECK(exchange.client.is_closed);
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(5));
}

TEST_CASE("a response that there is no memory for becomes 503; one that others hold as well costs nothing") {
  Exchange exchange(300'000);
  exchange.run([&]() -> rr::awaitable<void> {
    const auto large = text_response(200, "text/plain", std::string(150'001, 'x'));
    co_await exchange.writer.send(large);
  });
  CHECK_THAT(exchange.client.received, Catch::StartsWith("HTTP/1.1 503 ") && Catch::Contains("no memory left") &&
                                           Catch::Contains("Retry-After: 2\r\n"));
  CHECK(exchange.budget.refusals() == 1);
  CHECK(exchange.metrics.rejected[static_cast<std::size_t>(Rejection::memory)] == 1);
  exchange.client.received.clear();
  exchange.run([&]() -> rr::awaitable<void> {
    const auto fits = text_response(200, "text/plain", std::string(100'000, 'x'));
    co_await exchange.writer.send(fits);
    CHECK(exchange.budget.used() == 100'000);
    auto shared = text_response(200, "text/plain", std::string(200'000, 'x'));
    const auto other = shared.body;
    co_await exchange.writer.send(shared);
  });
  CHECK(exchange.client.received.size() > 300'000);
}

TEST_CASE("a response whose rest can't be had breaks off, and does not look like a whole one") {
  Exchange exchange;
  exchange.run([&]() -> rr::awaitable<void> {
    Response head;
    co_await exchange.writer.begin(head);
    co_await exchange.writer.write("half");
    exchange.writer.break_off();
  });
  CHECK(exchange.client.is_closed);
  CHECK_FALSE(exchange.writer.goes_on());
  CHECK_THAT(exchange.client.received, Catch::EndsWith("4\r\nhalf\r\n"));
}

TEST_CASE("a client that leaves is noticed at once, whatever it has sent and does not take") {
  Exchange exchange;
  bool is_gone = false;
  SECTION("while nothing is written") {}
  SECTION("while it takes nothing") {
    exchange.client.is_full = true;
  }
  exchange.run([&]() -> rr::awaitable<void> {
    exchange.writer.watch([&] { is_gone = true; });
    exchange.client.send("GET / HTTP/1.1\r\n");
    exchange.client.send("\r\n");
    asio::post(exchange.io, [&] { asio::post(exchange.io, [&] { exchange.client.go(); }); });
    while (exchange.client.is_full && !co_await exchange.writer.write("text")) continue;
    asio::steady_timer soon(exchange.io, milliseconds(1));
    while (!is_gone) {
      co_await soon.async_wait(asio::use_awaitable);
      soon.expires_after(milliseconds(1));
    }
    co_await exchange.writer.unwatch();
  });
  CHECK(is_gone);
  CHECK(exchange.client.is_closed);
}

TEST_CASE("what a client sends while it is answered is its next request") {
  Exchange exchange;
  exchange.run([&]() -> rr::awaitable<void> {
    exchange.writer.watch([] { FAIL("it has not gone"); });
    exchange.client.send("GET /next HTTP/1.1\r\n");
    co_await exchange.writer.write("text");
    asio::steady_timer soon(exchange.io, milliseconds(1));
    co_await soon.async_wait(asio::use_awaitable);
    exchange.client.send("Host: localhost\r\n\r\n");
    co_await exchange.writer.unwatch();
    const auto next = co_await exchange.reader.next();
    REQUIRE(next.request);
    CHECK(next.request->path() == "/next");
  });
  CHECK_FALSE(exchange.client.is_closed);
}

TEST_CASE("a request is late though no reading of it was cancelled in time") {
  asio::io_context io(1);
  FakeClient client(io);
  client.trickles = true;
  RequestReader reader(client, {1000, milliseconds(100), milliseconds(100)});
  std::optional<ReadRequest> read;
  asio::co_spawn(
      io, [&]() -> rr::awaitable<void> { read = co_await reader.next(); },
      [](const std::exception_ptr& failure) {
        if (failure) std::rethrow_exception(failure);
      });
  io.run_for(std::chrono::seconds(10));
  REQUIRE(read);
  CHECK_FALSE(read->request);
  CHECK(read->failure.status == 408);
}

TEST_CASE("a client that sends much while its response goes on is taken for gone") {
  Exchange exchange;
  bool is_gone = false;
  exchange.run([&]() -> rr::awaitable<void> {
    Response head;
    co_await exchange.writer.begin(head);
    exchange.writer.watch([&] { is_gone = true; });
    for (int i = 0; i < 5; ++i) exchange.client.send(std::string(4096, 'x'));
    asio::steady_timer pause(exchange.io);
    for (int i = 0; !is_gone && i < 100; ++i) {
      pause.expires_after(milliseconds(10));
      co_await pause.async_wait(asio::as_tuple(asio::use_awaitable));
    }
    exchange.client.close();
    co_await exchange.writer.unwatch();
  });
  CHECK(is_gone);
}
