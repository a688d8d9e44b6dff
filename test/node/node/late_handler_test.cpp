// Handlers that may wait: whoever waits keeps nobody else waiting, and answers find nobody without harm.
#include "node/service/late_handler.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <catch2/catch.hpp>
#include <condition_variable>
#include <mutex>

#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;
namespace asio = boost::asio;

namespace {

constexpr const char* definition = R"(service test.patient
stdver 0.10
object Nurse
    function int32{generator} count(int32 last)
    function int32{generator} count_blocking(int32 last)
end
object Patient
    property double level
    function int32 quick(int32 number)
    function int32 block(int32 number)
    function void block_and_post(int32 count)
    function int32 wait(int32 number)
    function string greet(string name)
    function int32 ask_later(int32 number)
    function void drop()
    function int32{generator} count(int32 last)
    function int32{generator} count_blocking(int32 last)
    wire double both
    memory uint8[] cells
    objref Nurse nurse
end
)";

/// A gate that handlers wait at, and that knows how many have come.
class Gate {
 public:
  void wait() {
    std::unique_lock lock(mutex_);
    ++arrived_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_open_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }
  bool has_seen(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, 10s, [&] { return arrived_ >= count; });
  }
  int arrived() {
    const std::lock_guard lock(mutex_);
    return arrived_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int arrived_ = 0;
  bool is_open_ = false;
};

std::int32_t checked(std::int32_t number) {
  if (number < 0) throw std::runtime_error("negative");
  if (number == 0) throw ServiceException("nothing", ErrorCode::invalid_argument);
  return number;
}

struct Patient {
  Gate gate;
  std::mutex mutex;
  std::vector<std::string> reports;
  std::vector<Reply<std::int32_t>> replies;  ///< used on the node's thread
  std::unique_ptr<asio::steady_timer> timer;
  std::promise<void> cancelled;
  double level = 1;
  std::shared_ptr<Service> service = Service::from_text({definition}, "Patient", "Patient");
  std::shared_ptr<Object> nurse;  ///< counts, too

  explicit Patient(Node* node)
      : timer(std::make_unique<asio::steady_timer>(node->io_context(), asio::steady_timer::time_point::max())) {
    service->property("level")
        .get(blocking([this] {
          const std::lock_guard lock(mutex);
          return level;
        }))
        .set(blocking([this](double value) {
          const std::lock_guard lock(mutex);
          level = value;
        }));
    service->function("quick", [](std::int32_t number) { return checked(number); });
    service->function("block", blocking([this](std::int32_t number) {
                        gate.wait();
                        return checked(number);
                      }));
    service->function("block_and_post", blocking([this, node](std::int32_t count) {
                        gate.wait();
                        for (; count > 0; --count) node->post([] {});
                      }));
    service->function("wait", [this](std::int32_t number) -> asio::awaitable<std::int32_t> {
      co_await timer->async_wait(asio::as_tuple(asio::use_awaitable));
      const auto state = co_await asio::this_coro::cancellation_state;
      if (state.cancelled() != asio::cancellation_type::none) cancelled.set_value();
      co_return checked(number);
    });
    service->function("greet", [](const std::string& name) -> asio::awaitable<std::string> {
      auto executor = co_await asio::this_coro::executor;
      for (int turn = 0; turn < 3; ++turn) co_await asio::post(executor, asio::use_awaitable);
      co_return "hello " + name;
    });
    service->function("ask_later",
                      [this](std::int32_t, Reply<std::int32_t> reply) { replies.push_back(std::move(reply)); });
    service->function("drop", [](const Reply<void>&) {});
    const auto count = [this](std::int32_t last) {
      return [this, last, next = 0]() mutable -> asio::awaitable<std::optional<std::int32_t>> {
        if (next == 1) co_await timer->async_wait(asio::as_tuple(asio::use_awaitable));
        if (next == last) co_return std::nullopt;
        co_return next++;
      };
    };
    const auto count_blocking = [this](std::int32_t last) {
      return blocking([this, last, next = 0]() mutable -> std::optional<std::int32_t> {
        if (next == 1) gate.wait();
        if (next == 3) throw std::runtime_error("too many");
        if (next == last) return std::nullopt;
        return next++;
      });
    };
    nurse = service->make_object("Nurse");
    service->objref("nurse", [this] { return nurse; });
    for (auto* object : {&service->root(), nurse.get()}) {
      object->generator("count", count);
      object->generator("count_blocking", count_blocking);
    }
    MemoryHandlers cells;
    cells.dimensions = [] { return MemoryShape{4}; };
    cells.read = [this](const MemoryRange& range) {
      gate.wait();
      return Value(std::vector<std::uint8_t>(range.count.front(), 7));
    };
    cells.write = [](const MemoryRange&, const Value&) { throw std::runtime_error("worn out"); };
    service->memory("cells", blocking(cells));
  }
  std::vector<std::string> reported() {
    const std::lock_guard lock(mutex);
    return reports;
  }
};

/// Patient in a node that runs; its gate is opened before anything is joined.
struct PatientNode {
  explicit PatientNode(std::size_t max_blocking = 8)
      : node(std::make_unique<Node>("test.node", options_of(max_blocking))) {
    patient = std::make_unique<Patient>(node.get());
    *report = [this](const std::string& problem) {
      const std::lock_guard lock(patient->mutex);
      patient->reports.push_back(problem);
    };
    node->add(patient->service);
    url = "rr+tcp://127.0.0.1:" + std::to_string(node->listen("rr+tcp://127.0.0.1:0")) + "/?service=Patient";
    thread = std::thread([this] { node->run(); });
  }
  ~PatientNode() {
    patient->gate.open();
    stop();
    patient->timer.reset();
    node.reset();
  }
  NodeOptions options_of(std::size_t max_blocking) const {
    NodeOptions options;
    options.max_blocking = max_blocking;
    options.report = [to = report](const std::string& problem) { (*to)(problem); };
    return options;
  }
  void stop() {
    if (!thread.joinable()) return;
    node->post([this] { node->stop(); });
    thread.join();
  }
  template <class F>
  auto ask(F&& question) {
    std::packaged_task<decltype(question())()> task(std::forward<F>(question));
    auto answer = task.get_future();
    node->post([&] { task(); });
    return answer.get();
  }
  RemoteObject connect() const { return rr::connect(url); }

  std::shared_ptr<std::function<void(const std::string&)>> report =
      std::make_shared<std::function<void(const std::string&)>>();
  std::unique_ptr<Node> node;
  std::unique_ptr<Patient> patient;
  std::string url;
  std::thread thread;
};

/// A call that is not waited for.
struct Pending {
  // The call keeps it as well: it is completed at the latest when its connection goes, which may outlive this.
  std::shared_ptr<std::optional<Result<Value>>> kept = std::make_shared<std::optional<Result<Value>>>();
  std::optional<Result<Value>>& result = *kept;

  Pending(const RemoteObject& object, const std::string& function, std::vector<Value> arguments) {
    object.connection().asynchronous().call(object.path(), function, arguments,
                                            [kept = kept](Result<Value> completed) { *kept = std::move(completed); });
  }
  Result<Value> wait(const RemoteObject& object) {
    REQUIRE(object.connection().run_until([this] { return result.has_value(); }, 10s));
    return *result;
  }
};

}  // namespace

TEST_CASE("handlers that block keep nobody waiting: neither other clients nor other calls of their own") {
  PatientNode device;
  const auto one = device.connect();
  const auto two = device.connect();
  Pending first(one, "block", {Value(1)});
  Pending second(one, "block", {Value(2)});
  REQUIRE(device.patient->gate.has_seen(2));
  CHECK(one.call("quick", 3) == Value(3));
  for (std::int32_t i = 1; i <= 100; ++i) {
    REQUIRE(two.call("quick", i) == Value(i));
    REQUIRE(two.call("greet", "you") == Value("hello you"));
  }
  two.set("level", 2.5);
  CHECK(two.get("level") == Value(2.5));
  CHECK_FALSE(first.result);
  CHECK_FALSE(second.result);
  device.patient->gate.open();
  CHECK(first.wait(one).value() == Value(1));
  CHECK(second.wait(one).value() == Value(2));
}

TEST_CASE("more blocking handlers than there may be threads wait their turn") {
  PatientNode device(1);
  const auto one = device.connect();
  Pending first(one, "block", {Value(1)});
  Pending second(one, "block", {Value(2)});
  REQUIRE(device.patient->gate.has_seen(1));
  CHECK(one.call("quick", 3) == Value(3));
  CHECK(device.patient->gate.arrived() == 1);
  device.patient->gate.open();
  CHECK(first.wait(one).value() == Value(1));
  CHECK(second.wait(one).value() == Value(2));
}

TEST_CASE("coroutines wait side by side, and others are served meanwhile") {
  PatientNode device;
  const auto one = device.connect();
  const auto two = device.connect();
  Pending first(one, "wait", {Value(1)});
  Pending second(two, "wait", {Value(2)});
  for (std::int32_t i = 1; i <= 100; ++i) REQUIRE(two.call("quick", i) == Value(i));
  REQUIRE(one.call("quick", 1) == Value(1));
  CHECK_FALSE(first.result);
  device.ask([&] { return device.patient->timer->cancel(); });
  CHECK(first.wait(one).value() == Value(1));
  CHECK(second.wait(two).value() == Value(2));
}

TEST_CASE("a reply comes later, from any thread; the first one counts, and a forgotten one is told") {
  PatientNode device;
  const auto one = device.connect();
  Pending first(one, "ask_later", {Value(1)});
  Pending second(one, "ask_later", {Value(2)});
  REQUIRE(one.call("quick", 1) == Value(1));
  CHECK_FALSE(first.result);
  const auto replies = device.ask([&] { return std::exchange(device.patient->replies, {}); });
  REQUIRE(replies.size() == 2);
  CHECK(replies[0].caller().id != 0);
  std::thread([&] {
    replies[1](20);
    replies[1](21);
    replies[0].fail(make_error(ErrorCode::invalid_state, "too early"));
  }).join();
  CHECK(second.wait(one).value() == Value(20));
  CHECK(first.wait(one).error().code == ErrorCode::invalid_state);
  CHECK(error_of([&] { one.call("drop"); }).message == "its handler has ended without an answer");
}

namespace {

/// A running generator whose steps are not waited for.
struct Steps {
  RemoteObject object;
  std::string function;
  std::int32_t index = 0;
  std::vector<std::optional<Result<Value>>> results;

  Steps(const RemoteObject& of, std::string named, std::size_t count)
      : object(of), function(std::move(named)), results(count) {
    const std::array<Value, 1> last{Value(2)};
    const Value opened = object.connection().wait_for([&](ClientConnection& connection, auto done) {
      connection.open_generator(object.path(), function, last, std::move(done));
    });
    index = *opened.to<std::int32_t>();
  }
  Value next() {
    return object.connection().wait_for([&](ClientConnection& connection, auto done) {
      connection.next_generator(object.path(), function, index, std::nullopt, std::move(done));
    });
  }
  /// Asks for as many as `results` has room for.
  void ask() {
    for (auto& result : results)
      object.connection().asynchronous().next_generator(
          object.path(), function, index, std::nullopt,
          [&result](Result<Value> completed) { result = std::move(completed); });
  }
  bool wait() {
    const auto has_all = [&] {
      return std::all_of(results.begin(), results.end(), [](const auto& result) { return result.has_value(); });
    };
    return object.connection().run_until(has_all, 10s);
  }
  bool are_aborted() const {
    return std::all_of(results.begin(), results.end(), [](const auto& result) {
      return result->has_error() && result->error().code == ErrorCode::operation_aborted;
    });
  }
};

}  // namespace

TEST_CASE("generators may wait for their values: one at a time, in the order of asking") {
  const std::string function = GENERATE("count", "count_blocking");
  PatientNode device;
  const auto one = device.connect();
  const auto two = device.connect();
  Steps steps(one, function, 3);
  CHECK(steps.next() == Value(0));
  steps.ask();
  for (std::int32_t i = 1; i <= 20; ++i) REQUIRE(two.call("quick", i) == Value(i));
  REQUIRE(one.call("quick", 1) == Value(1));
  CHECK_FALSE(steps.results[0]);
  device.patient->gate.open();
  device.ask([&] { return device.patient->timer->cancel(); });
  REQUIRE(steps.wait());
  CHECK(steps.results[0]->value() == Value(1));
  CHECK(steps.results[1]->error().code == ErrorCode::stop_iteration);
  CHECK_FALSE(steps.results[2]->has_value());
}

TEST_CASE("a generator that waits is aborted at once, and what was asked of it fails") {
  PatientNode device;
  const auto one = device.connect();
  Steps steps(one, "count", 2);
  CHECK(steps.next() == Value(0));
  steps.ask();
  one.connection().wait_for([&](ClientConnection& connection, auto done) {
    connection.abort_generator(one.path(), "count", steps.index, std::move(done));
  });
  REQUIRE(steps.wait());
  CHECK(steps.are_aborted());
  CHECK(one.call("quick", 1) == Value(1));
}

TEST_CASE("a generator that waits ends at once when its object is replaced, which it lets go") {
  const std::string function = GENERATE("count", "count_blocking");
  PatientNode device;
  const auto one = device.connect();
  Steps steps(one.object("nurse"), function, 2);
  CHECK(steps.next() == Value(0));
  steps.ask();
  REQUIRE(one.call("quick", 1) == Value(1));
  const std::weak_ptr<Object> replaced = device.patient->nurse;
  device.ask([&] {
    device.patient->nurse.reset();
    device.patient->service->root().release("nurse");
  });
  device.patient->gate.open();  // one that blocks can't be cancelled
  REQUIRE(steps.wait());
  CHECK(steps.are_aborted());
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (!replaced.expired() && std::chrono::steady_clock::now() < end) REQUIRE(one.call("quick", 1) == Value(1));
  CHECK(replaced.expired());
  CHECK(device.patient->reported().empty());
}

TEST_CASE("what handlers throw later reaches the client, and mistakes are reported") {
  PatientNode device;
  device.patient->gate.open();
  const auto one = device.connect();
  CHECK(error_of([&] { one.call("block", -1); }).message == "negative");
  CHECK(error_of([&] { one.call("block", 0); }).code == ErrorCode::invalid_argument);
  CHECK(one.memory("cells").read({1}, {2}) == Value(std::vector<std::uint8_t>{7, 7}));
  CHECK(error_of([&] { one.memory("cells").write({0}, Value(std::vector<std::uint8_t>{1})); }).message == "worn out");
  Pending waiting(one, "wait", {Value(-1)});
  REQUIRE(one.call("quick", 1) == Value(1));
  device.ask([&] { return device.patient->timer->cancel(); });
  CHECK(waiting.wait(one).error().message == "negative");
  CHECK(device.patient->reported() == std::vector<std::string>{"function 'block': its handler failed: negative",
                                                               "memory 'cells': its handler failed: worn out",
                                                               "function 'wait': its handler failed: negative"});
}

TEST_CASE("when a client goes its coroutines are cancelled, and what has not begun to block never does") {
  PatientNode device(1);
  auto cancelled = device.patient->cancelled.get_future();
  {
    const auto one = device.connect();
    const Pending blocked(one, "block", {Value(1)});
    const Pending queued(one, "block", {Value(2)});
    const Pending waiting(one, "wait", {Value(3)});
    REQUIRE(one.call("quick", 1) == Value(1));
    REQUIRE(device.patient->gate.has_seen(1));
    one.connection().close();
  }
  REQUIRE(cancelled.wait_for(10s) == std::future_status::ready);
  const auto two = device.connect();
  Pending next(two, "block", {Value(4)});
  REQUIRE(two.call("quick", 1) == Value(1));
  device.patient->gate.open();
  CHECK(next.wait(two).value() == Value(4));
  CHECK(device.patient->gate.arrived() == 2);  // the one that had begun, and the other client's
  CHECK(device.patient->reported().empty());
}

TEST_CASE("a node goes while handlers block and wait; who answers then harms nobody") {
  PatientNode device;
  std::vector<Reply<std::int32_t>> replies;
  {
    const auto one = device.connect();
    Pending blocked(one, "block", {Value(1)});
    Pending waiting(one, "wait", {Value(2)});
    Pending later(one, "ask_later", {Value(3)});
    REQUIRE(one.call("quick", 1) == Value(1));
    REQUIRE(device.patient->gate.has_seen(1));
    replies = device.ask([&] { return std::exchange(device.patient->replies, {}); });
    device.stop();
    REQUIRE(one.connection().run_until([&] { return later.result.has_value(); }, 10s));
    CHECK_FALSE(blocked.result->has_value());
    CHECK_FALSE(waiting.result->has_value());
    CHECK_FALSE(later.result->has_value());
  }
  std::thread opener([&] {
    replies.front()(5);
    device.patient->gate.open();
  });
  device.patient->timer.reset();
  device.node.reset();  // waits for the one that blocks
  CHECK(device.patient->gate.arrived() == 1);
  opener.join();
  replies.front()(6);
}

TEST_CASE("a handler that blocks may post to its node while that goes") {
  PatientNode device;
  const auto one = device.connect();
  const Pending blocked(one, "block_and_post", {Value(1000)});
  REQUIRE(one.call("quick", 1) == Value(1));
  REQUIRE(device.patient->gate.has_seen(1));
  device.stop();
  device.patient->timer.reset();
  device.patient->gate.open();
  device.node.reset();  // waits for the handler
  CHECK(device.patient->gate.arrived() == 1);
}

TEST_CASE("handlers that can't wait say so where they are set; signatures are checked in every form") {
  const auto service = Service::from_text({definition}, "Patient", "Patient");
  CHECK_THAT(refusal([&] { service->on_wire("both", blocking([](double) {})); }),
             Catch::Matchers::Contains("newer values do not wait"));
  CHECK_THAT(refusal([&] { service->function("quick", blocking([](const std::string&) { return 1; })); }),
             Catch::Matchers::Contains("parameter 'number'"));
  CHECK_THAT(refusal([&] { service->function("quick", [](Reply<std::int32_t>) {}); }),
             Catch::Matchers::Contains("takes 0 parameters"));
  CHECK_THAT(
      refusal([&] { service->function("quick", [](std::int32_t) -> asio::awaitable<std::string> { co_return "x"; }); }),
      Catch::Matchers::Contains("returns string"));
}
