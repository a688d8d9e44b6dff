// Callbacks between client and service sessions: answers, errors, and what becomes of calls that nobody answers.
#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

struct Callbacks : Loopback {
  Callbacks() { connect(); }

  const MemberDefinition& member(std::string_view name) { return *service->service()->root_type().find_member(name); }
  CallbackId ask(const char* question = "how much?") {
    const std::vector<Value> arguments{Value(question)};
    return service->call_callback("arm", member("ask"), arguments, now).value();
  }
  /// What the service hears of a call, after pumping.
  Result<Value> answer_to(CallbackId id) {
    pump();
    auto completed = next_service<CallbackCompleted>();
    CHECK(completed.id == id);
    return completed.result;
  }
  /// A call that the client answers by itself, for a path or member that is not there.
  Result<Value> call_by_hand(std::string_view path, std::string_view name) {
    MemberDefinition definition = member("notice");
    definition.name = name;
    const std::vector<Value> arguments{Value(std::int32_t{1})};
    const auto id = service->call_callback(path, definition, arguments, now).value();
    return answer_to(id);
  }
};

}  // namespace

TEST_CASE("a callback brings arguments to the client and its answer back") {
  Callbacks pair;
  const auto id = pair.ask();
  pair.pump();
  const auto called = pair.next_client<CallbackCalled>();
  CHECK(called.path == "arm");
  CHECK(called.member == "ask");
  CHECK(called.arguments == std::vector<Value>{Value("how much?")});
  pair.client->reply_callback(called.id, Value(12.5), pair.now);
  pair.client->reply_callback(called.id, Value(13.5), pair.now);  // answered already
  CHECK(pair.answer_to(id).value() == Value(12.5));
  CHECK_FALSE(pair.service->poll_event());

  const std::vector<Value> arguments{Value(std::int32_t{7})};
  const auto notice = pair.service->call_callback("arm", pair.member("notice"), arguments, pair.now).value();
  pair.pump();
  pair.client->reply_callback(pair.next_client<CallbackCalled>().id, Value("whatever"), pair.now);
  CHECK(pair.answer_to(notice).value().is_null());
}

TEST_CASE("calls are answered in any order, also while a request of the client waits") {
  Callbacks pair;
  const auto request = pair.client->call_function("arm", "stop", {}, pair.now);
  pair.pump();
  const auto function = pair.next_service<Called>();
  const auto first = pair.ask("first");
  const auto second = pair.ask("second");
  pair.pump();
  const auto first_call = pair.next_client<CallbackCalled>();
  const auto second_call = pair.next_client<CallbackCalled>();
  CHECK(second_call.arguments == std::vector<Value>{Value("second")});
  pair.client->reply_callback(second_call.id, Value(2.0), pair.now);
  CHECK(pair.answer_to(second).value() == Value(2.0));
  pair.client->reply_callback(first_call.id, Value(1.0), pair.now);
  CHECK(pair.answer_to(first).value() == Value(1.0));
  pair.service->reply(function.id, Value{}, pair.now);
  CHECK(pair.completion(request));
}

TEST_CASE("the client's error reaches the service, and so does an answer that does not fit") {
  Callbacks pair;
  auto id = pair.ask();
  pair.pump();
  pair.client->reply_callback(pair.next_client<CallbackCalled>().id,
                              Error{ErrorCode::remote_error, "joint 3", "experimental.loopback.ArmJammed"}, pair.now);
  const auto error = pair.answer_to(id).error();
  CHECK(error.qualified_name() == "experimental.loopback.ArmJammed");
  CHECK(error.message == "joint 3");
  id = pair.ask();
  pair.pump();
  Error jammed{ErrorCode::remote_error, "joint 3", "experimental.loopback.ArmJammed"};
  const Structure pose{"experimental.loopback.Pose",
                       {{"x", Value(1.0)}, {"joints", Value(Array::take(std::vector<double>{2.0}))}}};
  jammed.param = std::make_shared<const Value>(pose);
  pair.client->reply_callback(pair.next_client<CallbackCalled>().id, jammed, pair.now);
  const auto told = pair.answer_to(id).error().param;
  REQUIRE(told);
  CHECK(*told == Value(pose));
  id = pair.ask();
  pair.pump();
  pair.client->reply_callback(pair.next_client<CallbackCalled>().id, Value("much"), pair.now);
  CHECK(pair.answer_to(id).error().code == ErrorCode::data_type_mismatch);
}

TEST_CASE("the client answers what it cannot hand out") {
  Callbacks pair;
  CHECK(pair.call_by_hand("arm.tool", "notice").error().code == ErrorCode::service_error);
  CHECK(pair.call_by_hand("arm", "note").error().code == ErrorCode::member_not_found);
  CHECK(pair.call_by_hand("arm", "bumped").error().code == ErrorCode::member_not_found);
  CHECK(pair.call_by_hand("arm", "ask").error().code == ErrorCode::message_element_not_found);
  CHECK_FALSE(pair.client->poll_event());
}

TEST_CASE("a callback without answer ends after its time; a late answer is ignored") {
  Callbacks pair;
  const auto id = pair.ask();
  pair.pump();
  const auto called = pair.next_client<CallbackCalled>();
  pair.advance(std::chrono::seconds(8));
  const auto second = pair.ask();
  CHECK(pair.service->poll_timeout() <= pair.now.steady + std::chrono::seconds(7));
  pair.advance(std::chrono::seconds(7));
  pair.service->handle_timeout(pair.now);
  const auto completed = pair.next_service<CallbackCompleted>();
  CHECK(completed.id == id);
  CHECK(completed.result.error().code == ErrorCode::request_timeout);
  CHECK(completed.result.error().message == "callback 'ask': the client did not answer in time");
  CHECK_FALSE(pair.service->poll_event());
  pair.client->reply_callback(called.id, Value(1.0), pair.now);
  pair.pump();
  CHECK_FALSE(pair.service->poll_event());
  pair.client->reply_callback(pair.next_client<CallbackCalled>().id, Value(2.0), pair.now);
  CHECK(pair.answer_to(second).value() == Value(2.0));
}

TEST_CASE("a client that goes ends its callbacks before it is gone") {
  Callbacks pair;
  const auto id = pair.ask();
  pair.service->handle_closed({ErrorCode::connection_error, "broken"}, pair.now);
  const auto completed = pair.next_service<CallbackCompleted>();
  CHECK(completed.id == id);
  CHECK(completed.result.error().message == "callback 'ask': broken");
  pair.next_service<ClientGone>();
  const std::vector<Value> arguments{Value("anybody?")};
  CHECK(pair.service->service() == nullptr);
  const auto types = pair.client->object_type("arm");
  CHECK(pair.service->call_callback("arm", *types->find_member("ask"), arguments, pair.now).error().code ==
        ErrorCode::connection_error);
}

TEST_CASE("open callbacks are bounded on both sides") {
  Callbacks pair;
  const std::vector<Value> arguments{Value("again?")};
  CallbackId last = 0;
  Result<CallbackId> called = last;
  std::size_t count = 0;
  for (; (called = pair.service->call_callback("arm", pair.member("ask"), arguments, pair.now)); ++count)
    last = *called;
  CHECK(count == 1024);
  CHECK(called.error().code == ErrorCode::out_of_system_resource);
  pair.pump();

  Loopback strict;
  ClientOptions options;
  options.connection.self = {client_id, ""};
  options.service = "arm";
  options.max_open_callbacks = 1;
  strict.client = std::make_unique<ClientSession>(options, strict.now);
  strict.connect();
  const auto& ask = *strict.service->service()->root_type().find_member("ask");
  REQUIRE(strict.service->call_callback("arm", ask, arguments, strict.now));
  const auto second = strict.service->call_callback("arm", ask, arguments, strict.now).value();
  strict.pump();
  const auto completed = strict.next_service<CallbackCompleted>();
  CHECK(completed.id == second);
  CHECK(completed.result.error().code == ErrorCode::out_of_system_resource);
}

TEST_CASE("arguments that do not fit are refused where the callback is called") {
  Callbacks pair;
  CHECK(pair.service->call_callback("arm", pair.member("ask"), {}, pair.now).error().message ==
        "callback 'ask': 0 arguments given, 1 expected");
  const std::vector<Value> arguments{Value(5)};
  CHECK_FALSE(pair.service->call_callback("arm", pair.member("ask"), arguments, pair.now));
  pair.pump();
  CHECK_FALSE(pair.client->poll_event());
}
