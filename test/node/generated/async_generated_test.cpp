// Generated clients for programs on Asio, over TCP: everything that the definition has, awaited.
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/use_future.hpp>
#include <catch2/catch.hpp>

#include "node/subscribe/service_subscription.hpp"
#include "test/node/generated/words_service.hpp"

using namespace rr;
using namespace std::chrono_literals;
using namespace test::words;
namespace asio = boost::asio;
using Catch::Matchers::Contains;

namespace {

struct AsyncSession {
  std::shared_ptr<Everything> everything = std::make_shared<Everything>();
  RunningNode node{[this](Node& owner) { owner.add(make_service("words", everything)); }};
  asio::io_context io;

  /// Runs test(client) to its end.
  template <class F>
  void run(F test) {
    bool is_done = false;
    std::exception_ptr failure;
    const auto whole = [&]() -> asio::awaitable<void> {
      const auto object = co_await async_connect(io, node.url("words"));
      const ObjectAsyncClient client(object);
      co_await test(client);
      object.connection()->disconnect();
    };
    asio::co_spawn(io, whole, [&](std::exception_ptr e) {
      failure = e;
      is_done = true;
    });
    io.run_for(10s);
    if (failure) std::rethrow_exception(failure);
    CHECK(is_done);
    CHECK(io.stopped());
  }
  /// Until `is_true`, for a while.
  asio::awaitable<void> wait_until(std::function<bool()> is_true) {
    asio::steady_timer pause(io);
    for (int i = 0; i < 5000 && !is_true(); ++i) {
      pause.expires_after(1ms);
      co_await pause.async_wait(asio::use_awaitable);
    }
    if (!is_true()) throw std::runtime_error("waited in vain");
  }
};

/// The class of what a request fails with, as E.
template <class E, class T>
asio::awaitable<std::optional<E>> failure_of(asio::awaitable<T> request) {
  std::optional<E> failure;
  try {
    co_await std::move(request);
  } catch (const E& exception) {
    failure.emplace(exception);
  }
  co_return failure;
}

}  // namespace

TEST_CASE("generated async: properties, functions, events and exceptions") {
  AsyncSession session;
  session.run([&](const ObjectAsyncClient& client) -> asio::awaitable<void> {
    co_await client.auto_().set(5);
    const std::int32_t number = co_await client.auto_().get();
    CHECK(number == 5);
    const auto value = make_struct();
    const Nullable<switch_> nullable(value);
    const Nullable<switch_> same = co_await client.constructor(nullable, Value("any"));
    CHECK(same == nullable);
    std::string heard;
    client.explicit_().on([&](double, const Nullable<std::vector<std::string>>& texts) { heard = texts->at(0); });
    const double sum = co_await client.operator_(3, "words", enumeration::while_);
    CHECK(sum == 4);
    CHECK(heard == "words");
    const auto declared = co_await failure_of<more::thrown>(client.then(1));
    CHECK(declared);
    const auto other = co_await failure_of<ClientException>(client.void_function(Map::register_, nullptr));
    REQUIRE(other);
    CHECK(other->error().code == ErrorCode::null_value);
  });
}

TEST_CASE("generated async: objects, as their type or a base of it") {
  AsyncSession session;
  session.run([&](const ObjectAsyncClient& client) -> asio::awaitable<void> {
    const baseAsyncClient base = co_await client.friend_();
    const std::string who = co_await base.who();
    CHECK(who == "friend");
    const interfaceAsyncClient whole(base.rr_object);
    std::int32_t moved_by = 0;
    base.moved().on([&](std::int32_t by) { moved_by = by; });
    co_await whole.f();
    CHECK(moved_by == 5);
    const auto second = co_await client.many(2);
    const auto name = co_await second.who();
    CHECK(name == "many 2");
    const auto deep = co_await client.named("a.b");
    const auto deeper = co_await deep.named("c");
    const auto number = co_await deeper.auto_().get();
    CHECK(number == 0);
    const AsyncObject whatever = co_await client.whatever();
    CHECK(whatever.path() == "words.whatever");
    CHECK_THROWS_WITH(ObjectAsyncClient(base.rr_object), Contains("which is no test.words.Object"));
    const auto none = co_await failure_of<ClientException>(client.many(3));
    REQUIRE(none);
    CHECK(none->error().code == ErrorCode::service_error);
  });
}

TEST_CASE("generated async: wires, pipes and memories") {
  AsyncSession session;
  *session.everything->numbers = {{10}, std::vector<double>(10)};
  session.run([&](const ObjectAsyncClient& client) -> asio::awaitable<void> {
    std::vector<double> positions;
    co_await client.position().connect([&](double value) { positions.push_back(value); });
    const union_ target{{1, 2}, 3};
    co_await client.target().poke(target);
    const union_ poked = co_await client.target().peek_out();
    CHECK(poked == target);
    co_await client.target().connect_to_send();
    client.target().send({{0, 0}, 4});
    co_await session.wait_until([&] { return positions.size() == 2; });
    CHECK(positions == std::vector{3.0, 4.0});
    const double position = co_await client.position().peek();
    CHECK(position == 4);
    co_await client.position().disconnect();

    std::vector<std::vector<double>> packets;
    const auto samples =
        co_await client.samples().connect([&](std::vector<double> packet) { packets.push_back(packet); });
    samples.send({1, 2});
    co_await session.wait_until([&] { return !packets.empty(); });
    CHECK(packets.front().size() == 3);
    CHECK(samples.is_open());
    co_await samples.close();
    CHECK_FALSE(samples.is_open());

    const MemoryShape dimensions = co_await client.numbers().dimensions();
    CHECK(dimensions == MemoryShape{10});
    const std::vector<double> items{1.5, 2.5};
    const MemoryShape begin(1, 3);
    const MemoryShape count(1, 2);
    co_await client.numbers().write(begin, items);
    const std::vector<double> read = co_await client.numbers().read(begin, count);
    CHECK(read == items);
  });
}

TEST_CASE("generated async: generators and callbacks") {
  AsyncSession session;
  session.run([&](const ObjectAsyncClient& client) -> asio::awaitable<void> {
    const auto numbers = co_await client.count(2);
    std::vector<std::int32_t> counted;
    while (true) {
      const std::optional<std::int32_t> next = co_await numbers.next();
      if (!next) break;
      counted.push_back(*next);
    }
    CHECK(counted == std::vector{0, 1});
    const auto lines = co_await client.collect();
    const bool goes_on = co_await lines.next("one");
    CHECK(goes_on);
    const auto broken = co_await failure_of<delete_>(lines.next("broken"));
    CHECK(broken);
    const auto sums = co_await client.both_ways(1);
    const auto sum = co_await sums.next(2);
    CHECK(sum == 3.0);
    co_await sums.close();

    client.ask().on(
        [](const std::string& question, enumeration) { return static_cast<std::int32_t>(question.size()); });
    co_await client.auto_().get();
    std::optional<std::int32_t> answer;
    session.node.ask([&](Node&) {
      session.everything->ask(session.everything->last_client, "how many", enumeration::none,
                              [&](const Result<std::int32_t>& result) { answer = result.value(); });
      return true;
    });
    co_await session.wait_until([&] { return session.node.ask([&](Node&) { return answer.has_value(); }); });
    CHECK(answer == 8);
  });
}

TEST_CASE("generated async: futures and callbacks take results as well; the client of a subscription") {
  AsyncSession session;
  auto words = subscribe_service(session.io, session.node.url("words"));
  std::future<std::int32_t> number;
  std::exception_ptr declared;
  words.on_connected([&](const AsyncObject& object) {
    const ObjectAsyncClient client(object);
    number = client.auto_().get(asio::use_future);
    client.then(1, [&](std::exception_ptr failure) {
      declared = failure;
      words.close();
    });
  });
  session.io.run_for(10s);
  CHECK(session.io.stopped());
  CHECK(number.get() == 0);
  CHECK_THROWS_AS(std::rethrow_exception(declared), more::thrown);
}
