// Generator functions of the service API, asked by the blocking client.
#include "node/service/generator.hpp"

#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

constexpr const char* definition = R"(service test.scanner
stdver 0.10
object Scanner
    function int32{generator} count(int32 last)
    function double{generator} scale(double factor, double{generator} values)
    function void store(string{generator} lines)
    function int32{generator} watch()
    function int32 plain(int32 last)
end
)";

std::shared_ptr<Service> make_scanner(std::vector<std::string>& log) {
  auto scanner = Service::from_text({definition}, "Scanner", "Scanner");
  scanner->generator("count", [](std::int32_t last) {
    return [i = 0, last]() mutable -> std::optional<std::int32_t> {
      if (i == last) return std::nullopt;
      if (i == 100) throw ServiceException("one hundred is enough", ErrorCode::out_of_range);
      return ++i;
    };
  });
  scanner->generator(
      "scale", [](double factor) { return [factor](double value) { return std::optional<double>(factor * value); }; });
  scanner->generator("store", [&log] {
    return [&log](const std::string& line) {
      log.push_back(line);
      return line != "last";
    };
  });
  scanner->generator("watch", [&log] {
    Generator generator;
    generator.next = [](const Value&) { return std::optional<Value>(std::int32_t{1}); };
    generator.close = [&log] { log.emplace_back("closed"); };
    generator.abort = [&log] { log.emplace_back("aborted"); };
    return generator;
  });
  scanner->function("plain", [](std::int32_t last) { return last; });
  return scanner;
}

}  // namespace

TEST_CASE("a generator is read by range-for, and step by step") {
  std::vector<std::string> log;
  RunningNode node([&](Node& it) { it.add(make_scanner(log)); });
  const auto scanner = connect(node.url("Scanner"));
  std::vector<std::int32_t> numbers;
  for (const Value& number : scanner.generator("count", 3)) numbers.push_back(number.to<std::int32_t>().value());
  CHECK(numbers == std::vector<std::int32_t>{1, 2, 3});

  auto one = scanner.generator("count", 1);
  CHECK(one.next() == Value(std::int32_t{1}));
  CHECK_FALSE(one.next());
  CHECK_FALSE(one.next());
  one.close();  // has ended

  auto scale = scanner.generator("scale", 2.0);
  CHECK(scale.next(4.0) == Value(8.0));
  CHECK(error_of([&] { scale.next(); }).code == ErrorCode::invalid_argument);
  auto store = scanner.generator("store");
  CHECK(store.next("first").value().is_null());
  CHECK_FALSE(store.next("last"));
  CHECK(log == std::vector<std::string>{"first", "last"});
}

TEST_CASE("a handler that throws fails the step and ends the generator") {
  std::vector<std::string> log;
  RunningNode node([&](Node& it) { it.add(make_scanner(log)); });
  const auto scanner = connect(node.url("Scanner"));
  auto count = scanner.generator("count", 1000);
  std::size_t steps = 0;
  const auto error = error_of([&] {
    for (; count.next(); ++steps) {
    }
  });
  CHECK(steps == 100);
  CHECK(error.code == ErrorCode::out_of_range);
  CHECK(error.message == "one hundred is enough");
  CHECK(error_of([&] { count.next(); }).code == ErrorCode::invalid_operation);
}

TEST_CASE("close and abort reach the handler once; a client that goes aborts what it left") {
  std::vector<std::string> log;
  RunningNode node([&](Node& it) { it.add(make_scanner(log)); });
  const auto log_now = [&] { return node.ask([&](Node&) { return log; }); };
  {
    const auto scanner = connect(node.url("Scanner"));
    auto closed = scanner.generator("watch");
    closed.next();
    closed.close();
    closed.close();
    CHECK(log_now() == std::vector<std::string>{"closed"});
    CHECK_FALSE(closed.next());
    auto aborted = scanner.generator("watch");
    aborted.abort();
    CHECK(error_of([&] { aborted.next(); }).code == ErrorCode::operation_aborted);
    CHECK(log_now() == std::vector<std::string>{"closed", "aborted"});
    scanner.generator("watch").next();
  }  // says goodbye, and waits for the answer
  CHECK(log_now() == std::vector<std::string>{"closed", "aborted", "aborted"});
}

TEST_CASE("a generator that answers later keeps what its function has") {
  std::vector<std::string> log;
  RunningNode node([&](Node& it) {
    auto scanner = make_scanner(log);
    scanner->generator("watch", [] {
      Generator generator;
      generator.start = [n = 0](const Value&, const std::shared_ptr<LateCall>& call) mutable {
        call->answer(Value(++n));
      };
      return generator;
    });
    it.add(scanner);
  });
  const auto scanner = connect(node.url("Scanner"));
  auto watch = scanner.generator("watch");
  for (std::int32_t n = 1; n <= 3; ++n) CHECK(watch.next() == Value(n));
}

TEST_CASE("generator handlers that do not fit are refused where they are set") {
  const auto scanner = Service::from_text({definition}, "Scanner", "Scanner");
  const auto none = [] { return [] { return std::optional<std::int32_t>(); }; };
  CHECK_THAT(refusal([&] { scanner->generator("plain", none); }), Contains("no generator function"));
  CHECK_THAT(refusal([&] { scanner->function("count", [](std::int32_t) {}); }), Contains("generator()"));
  CHECK_THAT(refusal([&] { scanner->generator("count", none); }),
             Equals("test.scanner.Scanner.count: the handler takes 0 parameters, the definition has 1"));
  CHECK_THAT(refusal([&] {
               scanner->generator("count", [](std::int32_t) { return [] { return std::optional<std::string>(); }; });
             }),
             Equals("test.scanner.Scanner.count, each step: is int32, the handler returns string"));
  CHECK_THAT(
      refusal([&] { scanner->generator("scale", [](double) { return [] { return std::optional<double>(); }; }); }),
      Equals("test.scanner.Scanner.scale, each step: the handler takes 0 parameters, the definition has 1"));
  CHECK_THAT(refusal([&] { scanner->generator("store", [] { return [](double) {}; }); }),
             Equals("test.scanner.Scanner.store, each step: parameter 'lines' is string, the handler takes double"));
  CHECK_THAT(refusal([&] {
               scanner->generator("store", [] { return [](const std::string&) { return std::optional<double>(); }; });
             }),
             Equals("test.scanner.Scanner.store, each step: is void, the handler returns double"));
}
