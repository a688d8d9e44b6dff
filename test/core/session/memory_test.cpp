// Memories between a client and a service session, and peers that do it wrong.
#include <catch2/catch.hpp>
#include <limits>
#include <numeric>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;

namespace {

Value numbers(std::size_t count, double first = 0) {
  std::vector<double> items(count);
  std::iota(items.begin(), items.end(), first);
  return items;
}

Value shape(MemoryShape dimensions) {
  return Value(std::move(dimensions));
}

struct Script : Loopback {
  Script() { connect(); }

  RequestId read(MemoryShape position, MemoryShape count, const char* member = "data") {
    return client->read_memory("arm", member, position, count, now);
  }
  /// The service is asked: `answer` is its reply.
  Called expect(CallKind kind, const Result<Value>& answer) {
    pump();
    auto called = next_service<Called>();
    CHECK(called.kind == kind);
    service->reply(called.id, answer, now);
    return called;
  }
  void expect_read(MemoryShape position, MemoryShape count, const Result<Value>& answer) {
    const auto called = expect(CallKind::memory_read, answer);
    CHECK(called.range.position == position);
    CHECK(called.range.count == count);
  }
  Error error_of(RequestId id) {
    const auto result = completion(id);
    return result ? Error{ErrorCode::none, {}} : result.error();
  }
  /// The service's answer to a request that this client would not send.
  Error answer_to_access(EntryType type, const char* member, MemoryShape position, MemoryShape count,
                         std::optional<std::size_t> doubles = {}) {
    std::vector<double> items(doubles.value_or(0));
    return answer_to([&](Message& message) {
      message.begin_entry(type, "arm", member, 9);
      write_memory_range(message, {position, count});
      if (doubles)
        message.add("data", DataType::double_t, static_cast<std::uint32_t>(*doubles),
                    {reinterpret_cast<const std::uint8_t*>(items.data()), items.size() * 8});
    });
  }
  Error answer_to_parameter(const char* member, const char* parameter) {
    return answer_to([&](Message& message) {
      message.begin_entry(EntryType::memory_get_param, "arm", member, 9);
      if (parameter) message.add_text("parameter", parameter);
    });
  }
  /// The client's request is lost, and this comes instead of an answer.
  template <class Write>
  void answer_instead(EntryType type, RequestId id, Write&& write) {
    lose_requests();
    forge(*service, [&](Message& message) {
      message.begin_entry(type, "arm", "data", id);
      write(message);
    });
    carry(*service, *client, 1u << 20);  // what the client asks next is lost with the next answer
  }
  void give_shape_and_limit(RequestId id, std::uint64_t length, std::uint32_t limit) {
    answer_instead(EntryType::memory_get_param_ret, id,
                   [&](Message& message) { message.add_scalar("return", DataType::uint64_t, length); });
    answer_instead(EntryType::memory_get_param_ret, id,
                   [&](Message& message) { message.add_scalar("return", DataType::uint32_t, limit); });
  }
};

}  // namespace

TEST_CASE("dimensions are what the application says") {
  Script script;
  auto id = script.client->get_memory_dimensions("arm", "data", script.now);
  script.expect(CallKind::memory_dimensions, shape({100}));
  CHECK(script.completion(id).value() == shape({100}));
  id = script.client->get_memory_dimensions("arm", "grid", script.now);
  script.expect(CallKind::memory_dimensions, shape({4, 3}));
  CHECK(script.completion(id).value() == shape({4, 3}));
  // An application that says something else.
  for (const auto& wrong : {shape({4, 3}), shape({}), Value(4.0), Value{}}) {
    id = script.client->get_memory_dimensions("arm", "data", script.now);
    script.expect(CallKind::memory_dimensions, wrong);
    CHECK(script.error_of(id).code == ErrorCode::internal_error);
  }
}

TEST_CASE("a read asks for dimensions and, once, for the limit") {
  Script script;
  auto id = script.read({10}, {3});
  script.expect(CallKind::memory_dimensions, shape({100}));
  script.expect_read({10}, {3}, numbers(3, 10));
  CHECK(script.completion(id).value() == numbers(3, 10));

  const auto sent = script.client->connection().stats().messages_sent;
  id = script.read({0}, {1});
  script.expect(CallKind::memory_dimensions, shape({100}));
  script.expect_read({0}, {1}, numbers(1));
  CHECK(script.completion(id).has_value());
  CHECK(script.client->connection().stats().messages_sent - sent == 2);
}

TEST_CASE("large transfers are split below the limit, in both directions") {
  Script script;
  // The service says 102,400 bytes: 12,800 doubles.
  auto id = script.read({5}, {30'000});
  script.expect(CallKind::memory_dimensions, shape({40'000}));
  script.expect_read({5}, {12'800}, numbers(12'800, 5));
  script.expect_read({12'805}, {12'800}, numbers(12'800, 12'805));
  script.expect_read({25'605}, {4'400}, numbers(4'400, 25'605));
  CHECK(script.completion(id).value() == numbers(30'000, 5));

  const std::uint64_t position[] = {1};
  id = script.client->write_memory("arm", "data", position, numbers(20'000), script.now);
  script.expect(CallKind::memory_dimensions, shape({40'000}));
  auto called = script.expect(CallKind::memory_write, Value{});
  CHECK(called.range.position == MemoryShape{1});
  CHECK(called.arguments == std::vector{numbers(12'800)});
  called = script.expect(CallKind::memory_write, Value{});
  CHECK(called.range.position == MemoryShape{12'801});
  CHECK(called.arguments == std::vector{numbers(7'200, 12'800)});
  CHECK(script.completion(id).value().is_null());
}

TEST_CASE("a failure in the middle ends the transfer, once") {
  Script script;
  const auto id = script.read({0}, {30'000});
  script.expect(CallKind::memory_dimensions, shape({40'000}));
  script.expect_read({0}, {12'800}, numbers(12'800));
  script.expect_read({12'800}, {12'800}, make_error(ErrorCode::io_error, "disk"));
  CHECK(script.completion(id).error().message == "disk");
  script.pump();
  CHECK_FALSE(script.client->poll_event());
  CHECK_FALSE(script.service->poll_event());
  CHECK(script.client->pending_requests() == 0);
}

TEST_CASE("a transfer can be cancelled, and ends with its time or its session") {
  Script script;
  const auto id = script.read({0}, {30'000});
  script.expect(CallKind::memory_dimensions, shape({40'000}));
  SECTION("cancelled: the late answer starts nothing") {
    script.pump();
    script.client->cancel(id);
    script.expect_read({0}, {12'800}, numbers(12'800));
    script.pump();
    CHECK_FALSE(script.client->poll_event());
    CHECK_FALSE(script.service->poll_event());
  }
  SECTION("no answer in time: each part has the time of a request") {
    script.pump();
    script.advance(14s);
    script.client->handle_timeout(script.now);
    CHECK_FALSE(script.client->poll_event());
    script.advance(1s);
    script.client->handle_timeout(script.now);
    CHECK(script.error_of(id).code == ErrorCode::request_timeout);
  }
  SECTION("the session ends") {
    script.client->handle_closed({ErrorCode::connection_error, "cut"}, script.now);
    CHECK(script.next_client<Completed>().id == id);
    script.next_client<SessionClosed>();
    CHECK_FALSE(script.client->poll_event());
  }
}

TEST_CASE("the client checks against the dimensions, whatever the service would do") {
  Script script;
  const auto error = [&](MemoryShape position, MemoryShape count, const char* member, MemoryShape dimensions) {
    const auto id = script.read(std::move(position), std::move(count), member);
    script.expect(CallKind::memory_dimensions, shape(std::move(dimensions)));
    return script.error_of(id).code;
  };
  CHECK(error({98}, {3}, "data", {100}) == ErrorCode::out_of_range);
  CHECK(error({std::numeric_limits<std::uint64_t>::max()}, {2}, "data", {100}) == ErrorCode::out_of_range);
  CHECK(error({0, 0}, {1, 1}, "data", {100}) == ErrorCode::invalid_argument);
  CHECK(error({0}, {1}, "grid", {4, 3}) == ErrorCode::invalid_argument);
  CHECK(error({0, 3}, {4, 1}, "grid", {4, 3}) == ErrorCode::out_of_range);
  CHECK(error({0}, {1ull << 32}, "data", {1ull << 40}) == ErrorCode::out_of_range);
  const std::uint64_t position[] = {99};
  const auto id = script.client->write_memory("arm", "data", position, numbers(2), script.now);
  script.expect(CallKind::memory_dimensions, shape({100}));
  CHECK(script.error_of(id).code == ErrorCode::out_of_range);
  CHECK(script.error_of(script.client->write_memory("arm", "data", position, Value("text"), script.now)).code ==
        ErrorCode::data_type_mismatch);
}

TEST_CASE("reading and writing nothing is asked of nobody") {
  Script script;
  auto id = script.read({100}, {0});
  script.expect(CallKind::memory_dimensions, shape({100}));
  CHECK(script.completion(id).value() == numbers(0));
  const std::uint64_t position[] = {100};
  id = script.client->write_memory("arm", "data", position, numbers(0), script.now);
  script.expect(CallKind::memory_dimensions, shape({100}));
  CHECK(script.completion(id).value().is_null());
  CHECK_FALSE(script.service->poll_event());
}

TEST_CASE("directions hold on both sides") {
  Script script;
  const std::uint64_t position[] = {0};
  const Value byte(std::vector<std::uint8_t>{1});
  CHECK(script.error_of(script.client->write_memory("arm", "log", position, byte, script.now)).code ==
        ErrorCode::read_only_member);
  CHECK(script.error_of(script.read({0}, {1}, "command")).code == ErrorCode::write_only_member);
  CHECK(script.answer_to_access(EntryType::memory_write, "log", {0}, {1}, 1).code == ErrorCode::read_only_member);
  CHECK(script.answer_to_access(EntryType::memory_read, "command", {0}, {1}).code == ErrorCode::write_only_member);
}

TEST_CASE("requests of bad clients are refused before the application hears of them") {
  Script script;
  const auto read = EntryType::memory_read, write = EntryType::memory_write;
  constexpr auto largest = std::numeric_limits<std::uint64_t>::max();
  CHECK(script.answer_to_access(read, "data", {0, 0}, {1, 1}).code == ErrorCode::invalid_argument);
  CHECK(script.answer_to_access(read, "grid", {0, 0}, {1}).code == ErrorCode::invalid_argument);
  CHECK(script.answer_to_access(read, "grid", {}, {}).code == ErrorCode::invalid_argument);
  CHECK(script.answer_to_access(read, "data", {0}, {largest}).code == ErrorCode::buffer_limit_violation);
  CHECK(script.answer_to_access(read, "data", {0}, {2'000'000}).code == ErrorCode::buffer_limit_violation);
  CHECK(script.answer_to_access(read, "grid", {0, 0}, {1ull << 32, 1ull << 32}).code == ErrorCode::out_of_range);
  CHECK(script.answer_to_access(write, "data", {0}, {3}, 2).code == ErrorCode::invalid_argument);
  CHECK(script.answer_to_access(write, "data", {0}, {0}, 1).code == ErrorCode::invalid_argument);
  CHECK(script.answer_to_access(write, "data", {0}, {1}).code == ErrorCode::message_element_not_found);
  CHECK(script.answer_to_access(write, "grid", {0, 0}, {1, 1}, 1).code == ErrorCode::data_type_mismatch);
  CHECK(script.answer_to_access(read, "speed", {0}, {1}).code == ErrorCode::member_not_found);
  CHECK(script.answer_to_parameter("data", "Colour").code == ErrorCode::invalid_operation);
  CHECK(script.answer_to_parameter("data", "Dimensions").code == ErrorCode::invalid_operation);
  CHECK(script.answer_to_parameter("grid", "Length").code == ErrorCode::invalid_operation);
  CHECK(script.answer_to_parameter("grid", nullptr).code == ErrorCode::message_element_not_found);
  CHECK(script.answer_to_parameter("grid", "MaxTransferSize").code == ErrorCode::none);
  const auto is_no_text = [](Message& message) {
    message.begin_entry(EntryType::memory_get_param, "arm", "data", 1);
    message.add_scalar("parameter", DataType::int32_t, std::int32_t{1});
  };
  CHECK(script.answer_to(is_no_text).code == ErrorCode::data_type_mismatch);
  CHECK_FALSE(script.service->poll_event());
}

TEST_CASE("an application's items that are not as many as asked for are an error, not a short read") {
  Script script;
  for (const std::size_t items : {0, 2, 4}) {
    const auto id = script.read({0}, {3});
    script.expect(CallKind::memory_dimensions, shape({100}));
    script.expect(CallKind::memory_read, numbers(items));
    const auto error = script.error_of(id);
    CHECK(error.code == ErrorCode::invalid_argument);
    CHECK(error.message == "memory 'data': the data is [" + std::to_string(items) + "], expected [3]");
  }
}

TEST_CASE("replies of bad services fail the transfer, and nothing else") {
  Script script;
  const auto id = script.read({0}, {3});
  SECTION("a shape that is none") {
    script.answer_instead(EntryType::memory_get_param_ret, id,
                          [](Message& message) { message.add_scalar("return", DataType::int32_t, std::int32_t{5}); });
    CHECK(script.error_of(id).code == ErrorCode::data_type_mismatch);
  }
  SECTION("no shape") {
    script.answer_instead(EntryType::memory_get_param_ret, id, [](Message&) {});
    CHECK(script.error_of(id).code == ErrorCode::message_element_not_found);
  }
  SECTION("a limit of nothing: one item at a time") {
    script.give_shape_and_limit(id, 100, 0);
    const auto called = script.expect(CallKind::memory_read, numbers(1));
    CHECK(called.range.count == MemoryShape{1});
    script.expect_read({1}, {1}, numbers(1, 1));
    script.expect_read({2}, {1}, numbers(1, 2));
    CHECK(script.completion(id).value() == numbers(3));
  }
  SECTION("a wrong count of items") {
    script.give_shape_and_limit(id, 100, 1024);
    script.answer_instead(EntryType::memory_read_ret, id, [](Message& message) {
      write_memory_range(message, {{0}, {3}});
      message.add_scalar("data", DataType::double_t, 1.0);
    });
    CHECK(script.error_of(id).message == "memory 'data': the data is [1], expected [3]");
  }
  SECTION("no items, items of another type") {
    script.give_shape_and_limit(id, 100, 1024);
    script.answer_instead(EntryType::memory_read_ret, id,
                          [](Message& message) { message.add_scalar("data", DataType::int32_t, std::int32_t{1}); });
    CHECK(script.error_of(id).code == ErrorCode::data_type_mismatch);
  }
  CHECK(script.client->pending_requests() == 0);
  CHECK(script.client->state() == ClientState::connected);
}

TEST_CASE("the reference's habits are understood: the position as count, 1172 for a write") {
  Script script;
  auto id = script.read({1}, {2});
  script.give_shape_and_limit(id, 100, 1024);
  script.answer_instead(EntryType::memory_read_ret, id, [](Message& message) {
    static const double items[] = {1, 2};
    write_memory_range(message, {{1}, {1}});
    message.add("data", DataType::double_t, 2, {reinterpret_cast<const std::uint8_t*>(items), sizeof(items)});
  });
  CHECK(script.completion(id).value() == numbers(2, 1));
  const std::uint64_t position[] = {0};
  id = script.client->write_memory("arm", "data", position, numbers(2), script.now);
  script.expect(CallKind::memory_dimensions, shape({100}));
  script.answer_instead(EntryType::memory_read_ret, id, [](Message&) {});
  CHECK(script.completion(id).value().is_null());
}

TEST_CASE("a memory of an object that was replaced is asked for its limit again") {
  Script script;
  const auto read_notes = [&] {
    REQUIRE(script.completion(script.client->find_object("arm.tool", script.now)).has_value());
    const auto sent = script.client->connection().stats().messages_sent;
    const std::uint64_t position[] = {0}, count[] = {1};
    const auto id = script.client->read_memory("arm.tool", "notes", position, count, script.now);
    script.expect(CallKind::memory_dimensions, shape({5}));
    script.expect_read({0}, {1}, numbers(1));
    REQUIRE(script.completion(id).has_value());
    return script.client->connection().stats().messages_sent - sent;
  };
  CHECK(read_notes() == 3);
  CHECK(read_notes() == 2);
  script.service->release_path("arm.tool", script.now);
  script.pump();
  script.next_client<PathReleased>();
  CHECK(read_notes() == 3);
}

TEST_CASE("a transfer whose object is replaced fails: what comes later is of another object") {
  Script script;
  REQUIRE(script.completion(script.client->find_object("arm.tool", script.now)).has_value());
  const bool is_write = GENERATE(false, true);
  const std::uint64_t position[] = {0}, count[] = {30'000};
  const auto transfer = [&](const char* path, const char* member) {
    return is_write ? script.client->write_memory(path, member, position, numbers(30'000), script.now)
                    : script.client->read_memory(path, member, position, count, script.now);
  };
  const auto part = [&](std::size_t items) {
    if (is_write)
      script.expect(CallKind::memory_write, Value{});
    else
      script.expect(CallKind::memory_read, numbers(items));
  };
  const auto release = [&](std::string_view path) {
    script.service->release_path(path, script.now);
    script.pump();
    CHECK(script.next_client<PathReleased>().path == path);
  };
  SECTION("between two parts") {
    const auto id = transfer("arm.tool", "notes");
    script.expect(CallKind::memory_dimensions, shape({30'000}));
    part(12'800);
    release("arm.tool");
    part(12'800);  // was asked for before the client heard
    const auto error = script.error_of(id);
    CHECK(error.code == ErrorCode::object_not_found);
    CHECK(error.message == "object 'arm.tool' was replaced");
  }
  SECTION("before the first part") {
    REQUIRE(script.completion(script.client->find_object("arm.tools[a]", script.now)).has_value());
    const auto id = transfer("arm.tools[a]", "notes");
    script.pump();
    release("arm.tools[a]");
    script.expect(CallKind::memory_dimensions, shape({30'000}));
    CHECK(script.error_of(id).code == ErrorCode::object_not_found);
  }
  SECTION("that of another object goes on") {
    const auto id = transfer("arm", "data");
    script.expect(CallKind::memory_dimensions, shape({30'000}));
    part(12'800);
    release("arm.tool");
    part(12'800);
    part(4'400);
    CHECK(script.completion(id).has_value());
  }
  script.pump();
  CHECK_FALSE(script.service->poll_event());
  CHECK_FALSE(script.client->poll_event());
  CHECK(script.client->pending_requests() == 0);
}
