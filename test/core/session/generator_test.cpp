// Generator functions between a client and a service session, and peers that do it wrong.
#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;

namespace {

/// A connected pair, and what a transcript of generators needs.
struct Script : Loopback {
  Script() { connect(); }

  std::int32_t open(std::string_view function, std::vector<Value> arguments = {}) {
    const auto id = client->open_generator("arm", function, arguments, now);
    pump();
    called = next_service<Called>();
    REQUIRE(called.kind == CallKind::generator_open);
    CHECK(called.arguments == arguments);
    generator = called.generator;
    service->reply(called.id, Value{}, now);
    return completion(id).value().to<std::int32_t>().value();
  }
  /// The service is asked a step: `kind` and parameters as expected; `answer` is its reply.
  void expect_step(CallKind kind, std::vector<Value> arguments, const Result<Value>& answer) {
    pump();
    called = next_service<Called>();
    CHECK(called.kind == kind);
    CHECK(called.arguments == arguments);
    CHECK(called.generator == generator);
    service->reply(called.id, answer, now);
  }
  Result<Value> next(std::string_view function, std::int32_t index, const Result<Value>& answer,
                     std::optional<Value> parameter = {}) {
    const auto id = client->next_generator("arm", function, index, parameter, now);
    expect_step(CallKind::generator_next, parameter ? std::vector{*parameter} : std::vector<Value>{}, answer);
    return completion(id);
  }
  ErrorCode step_code(RequestId id) {
    const auto result = completion(id);
    return result ? ErrorCode::none : result.error().code;
  }
  /// The answer of the service to a step that this client would not send.
  Error answer_to_step(std::string_view member, std::optional<std::int32_t> index, ErrorCode error = ErrorCode::none) {
    return answer_to([&](Message& message) {
      message.begin_entry(EntryType::generator_next_req, "arm", member, 9).error = error;
      if (index) message.add_scalar("index", DataType::int32_t, *index);
    });
  }

  Called called;
  GeneratorId generator = 0;
};

const Error stop{ErrorCode::stop_iteration, {}};

}  // namespace

TEST_CASE("a generator is opened, gives values, and ends") {
  Script script;
  const auto index = script.open("count");
  CHECK(script.next("count", index, Value(std::int32_t{1})).value() == Value(std::int32_t{1}));
  CHECK(script.next("count", index, Value(std::int32_t{2})).value() == Value(std::int32_t{2}));
  CHECK(script.next("count", index, stop).error().code == ErrorCode::stop_iteration);
  CHECK(script.next_service<GeneratorEnded>().id == script.generator);
  CHECK(script.step_code(script.client->next_generator("arm", "count", index, {}, script.now)) ==
        ErrorCode::invalid_operation);
}

TEST_CASE("generators take a value with each step, and return one or none") {
  Script script;
  const auto scale = script.open("scale", {Value(2.0)});
  CHECK(script.next("scale", scale, Value(3.0), Value(1.5)).value() == Value(3.0));
  const auto first = script.generator;
  const auto sink = script.open("sink");
  CHECK(script.next("sink", sink, Value{}, Value("line")).value().is_null());

  CHECK(script.step_code(script.client->next_generator("arm", "scale", scale, {}, script.now)) ==
        ErrorCode::invalid_argument);
  CHECK(script.step_code(script.client->next_generator("arm", "scale", scale, Value("text"), script.now)) ==
        ErrorCode::data_type_mismatch);
  CHECK(script.step_code(script.client->next_generator("arm", "count", scale, Value(1.0), script.now)) ==
        ErrorCode::invalid_argument);
  CHECK_FALSE(script.service->poll_event());  // nothing was sent
  script.generator = first;
  CHECK(script.next("scale", scale, Value(4.0), Value(2.0)).value() == Value(4.0));
}

TEST_CASE("close and abort are requests: the application hears them once, later steps are answered for it") {
  Script script;
  const auto closed = script.open("count");
  auto id = script.client->close_generator("arm", "count", closed, script.now);
  script.expect_step(CallKind::generator_close, {}, Value{});
  CHECK(script.completion(id).value().is_null());
  CHECK(script.next_service<GeneratorEnded>().id == script.generator);
  CHECK(script.completion(script.client->close_generator("arm", "count", closed, script.now)).value().is_null());
  CHECK(script.step_code(script.client->next_generator("arm", "count", closed, {}, script.now)) ==
        ErrorCode::stop_iteration);
  CHECK(script.step_code(script.client->next_generator("arm", "count", closed, {}, script.now)) ==
        ErrorCode::invalid_operation);

  const auto aborted = script.open("count");
  id = script.client->abort_generator("arm", "count", aborted, script.now);
  script.expect_step(CallKind::generator_abort, {}, Value{});
  CHECK(script.completion(id).value().is_null());
  CHECK(script.next_service<GeneratorEnded>().id == script.generator);
  CHECK(script.step_code(script.client->next_generator("arm", "count", aborted, {}, script.now)) ==
        ErrorCode::operation_aborted);
  CHECK_FALSE(script.service->poll_event());
}

TEST_CASE("the application may answer later, and a close overtakes a next") {
  Script script;
  const auto index = script.open("count");
  const auto next = script.client->next_generator("arm", "count", index, {}, script.now);
  const auto close = script.client->close_generator("arm", "count", index, script.now);
  script.pump();
  const auto waiting = script.next_service<Called>();
  script.expect_step(CallKind::generator_close, {}, Value{});
  CHECK(script.completion(close).value().is_null());
  script.service->reply(waiting.id, Value(std::int32_t{5}), script.now);
  CHECK(script.completion(next).value() == Value(std::int32_t{5}));
}

TEST_CASE("a function that fails opens nothing, a value that does not fit ends the generator") {
  Script script;
  const auto id = script.client->open_generator("arm", "count", {}, script.now);
  script.pump();
  const auto called = script.next_service<Called>();
  script.service->reply(called.id, make_error(ErrorCode::operation_failed, "jammed"), script.now);
  CHECK(script.completion(id).error().message == "jammed");
  CHECK(script.next_service<GeneratorEnded>().id == called.generator);

  const auto index = script.open("count");
  CHECK(script.next("count", index, Value("text")).error().code == ErrorCode::data_type_mismatch);
  CHECK(script.next_service<GeneratorEnded>().id == script.generator);
}

TEST_CASE("call_function and open_generator name each other") {
  Script script;
  const auto called = script.completion(script.client->call_function("arm", "count", {}, script.now));
  CHECK(called.error().code == ErrorCode::invalid_operation);
  CHECK_THAT(called.error().message, Contains("open_generator"));
  const auto opened = script.completion(script.client->open_generator("arm", "stop", {}, script.now));
  CHECK(opened.error().code == ErrorCode::invalid_operation);
  CHECK_THAT(opened.error().message, Contains("'stop' is a function"));
}

TEST_CASE("steps of bad clients are refused, and leave generators as they are") {
  Script script;
  const auto index = script.open("count");
  CHECK(script.answer_to_step("count", index ^ 1).code == ErrorCode::invalid_operation);
  CHECK(script.answer_to_step("sink", index, ErrorCode::stop_iteration).code == ErrorCode::invalid_operation);
  CHECK(script.answer_to_step("stop", index).code == ErrorCode::invalid_operation);
  CHECK(script.answer_to_step("speed", index).code == ErrorCode::member_not_found);
  CHECK(script.answer_to_step("count", {}).code == ErrorCode::message_element_not_found);
  CHECK(script.answer_to_step("sink", index).code == ErrorCode::message_element_not_found);  // no parameter
  const auto wrong = script.answer_to([&](Message& message) {
    message.begin_entry(EntryType::generator_next_req, "arm", "count", 9);
    message.add("index", DataType::int32_t, 0, {});
  });
  CHECK(wrong.code == ErrorCode::data_type_mismatch);
  CHECK(wrong.message == "generator 'count': 'index' is int32[0], expected int32[1]");
  CHECK_FALSE(script.service->poll_event());
  CHECK(script.next("count", index, Value(std::int32_t{1})).has_value());
}

TEST_CASE("any error but StopIteration aborts") {
  Script script;
  const auto index = script.open("count");
  script.forge(*script.client, [&](Message& message) {
    message.begin_entry(EntryType::generator_next_req, "arm", "count", 9).error = ErrorCode::operation_failed;
    message.add_scalar("index", DataType::int32_t, index);
  });
  script.expect_step(CallKind::generator_abort, {}, Value{});
}

TEST_CASE("replies of bad services fail the request, and nothing else") {
  Script script;
  const auto reply = [&](EntryType type, RequestId id, const char* name, double number) {
    script.lose_requests();
    script.forge(*script.service, [&](Message& message) {
      message.begin_entry(type, "arm", "count", id);
      message.add_scalar(name, DataType::double_t, number);
    });
    return script.completion(id).error().code;
  };
  const auto open = script.client->open_generator("arm", "count", {}, script.now);
  CHECK(reply(EntryType::function_call_res, open, "return", 1) == ErrorCode::message_element_not_found);
  const auto again = script.client->open_generator("arm", "count", {}, script.now);
  CHECK(reply(EntryType::function_call_res, again, "index", 1) == ErrorCode::data_type_mismatch);
  const auto next = script.client->next_generator("arm", "count", 3, {}, script.now);
  CHECK(reply(EntryType::generator_next_res, next, "return", 1.5) == ErrorCode::data_type_mismatch);
  const auto empty = script.client->next_generator("arm", "count", 3, {}, script.now);
  CHECK(reply(EntryType::generator_next_res, empty, "value", 1) == ErrorCode::message_element_not_found);
  // What close returns is nobody's business.
  const auto close = script.client->close_generator("arm", "count", 3, script.now);
  script.lose_requests();
  script.forge(*script.service,
               [&](Message& message) { message.begin_entry(EntryType::generator_next_res, "arm", "count", close); });
  CHECK(script.completion(close).value().is_null());
}

TEST_CASE("generators end with the session's patience, with their object, and with the client") {
  Script script;
  const auto index = script.open("count");
  SECTION("ten minutes without a step, which the timer knows") {
    for (int i = 0; i < 59; ++i) {
      script.advance(10s);
      script.client->handle_timeout(script.now);
      script.service->handle_timeout(script.now);
      script.pump();
    }
    CHECK_FALSE(script.service->poll_event());
    CHECK(script.service->poll_timeout() <= script.now.steady + 10s);
    script.advance(10s);
    script.service->handle_timeout(script.now);
    CHECK(script.next_service<GeneratorEnded>().id == script.generator);
    CHECK(script.step_code(script.client->next_generator("arm", "count", index, {}, script.now)) ==
          ErrorCode::invalid_operation);
  }
  SECTION("the object is released") {
    script.service->release_path("arm", script.now);
    CHECK(script.next_service<GeneratorEnded>().id == script.generator);
  }
  SECTION("the client goes: that says it all") {
    script.client->disconnect(script.now);
    script.pump();
    script.next_service<ClientGone>();
    CHECK_FALSE(script.service->poll_event());
  }
}

TEST_CASE("one client runs a bounded number of generators") {
  Script script;
  ServiceSessionOptions options;
  options.max_generators = 1;
  script.service = std::make_unique<ServiceSession>(script.directory, options, script.now);
  ClientOptions client;
  client.connection.self = {client_id, ""};
  client.service = "arm";
  script.client = std::make_unique<ClientSession>(client, script.now);
  script.connect();
  const auto index = script.open("count");
  CHECK(script.step_code(script.client->open_generator("arm", "count", {}, script.now)) ==
        ErrorCode::out_of_system_resource);
  script.next("count", index, stop);
  script.next_service<GeneratorEnded>();
  script.open("count");
}

TEST_CASE("a generator that is opened when nobody waits for it any more is closed") {
  Script script;
  script.client->set_request_timeout(1s);
  const auto id = script.client->open_generator("arm", "count", {}, script.now);
  script.pump();
  script.called = script.next_service<Called>();
  script.generator = script.called.generator;
  const bool is_cancelled = GENERATE(false, true);
  if (is_cancelled) {
    script.client->cancel(id);
  } else {
    script.advance(1s);
    script.client->handle_timeout(script.now);
    CHECK(script.next_client<Completed>().result.error().code == ErrorCode::request_timeout);
  }
  script.service->reply(script.called.id, Value{}, script.now);
  script.expect_step(CallKind::generator_close, {}, Value{});
  script.pump();
  CHECK(script.next_service<GeneratorEnded>().id == script.generator);
  CHECK_FALSE(script.client->poll_event());
  CHECK(script.client->pending_requests() == 0);
}
