#include "server/socket/json_questions.hpp"

#include <boost/asio/post.hpp>

#include "node/transport/watchdog.hpp"
#include "server/http/endpoints/member_values.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::size_t max_waiting = 64;
/// What the client may take to answer the device.
constexpr std::chrono::seconds answer_time{10};

/// What a client answers instead of a result. A name is one of Robot Raconteur's, or of an exception of a definition.
rr::Error read_error(const rr::Json& given) {
  const auto text = [&given](const char* key) {
    const auto found = given.is_object() ? given.find(key) : given.end();
    return found != given.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  const auto name = text("name");
  if (name.empty()) return rr::make_error(rr::ErrorCode::operation_failed, text("message"));
  for (auto code = 1u; code <= unsigned(rr::ErrorCode::permission_denied); ++code)
    if (auto error = rr::make_error(rr::ErrorCode(code), {}); error.qualified_name() == name) {
      error.message = text("message");
      return error;
    }
  return rr::declared_error(name, text("message"));
}

}  // namespace

rr::Error client_gone() {
  return rr::make_error(rr::ErrorCode::operation_aborted, "the client has gone");
}

struct JsonQuestions::Question {
  Question(TargetPtr of, Reply to, const asio::any_io_executor& executor, std::function<void()> expired)
      : target(std::move(of)), reply(std::move(to)), limit(executor, std::move(expired)) {}

  TargetPtr target;
  Reply reply;
  rr::Deadline limit;
};

JsonQuestions::JsonQuestions(asio::any_io_executor executor, rr::JsonForm form, std::shared_ptr<Outbox> outbox)
    : executor_(std::move(executor)), form_(form), outbox_(std::move(outbox)) {}

void JsonQuestions::ask(const std::string& id, const TargetPtr& target, std::span<const rr::Value> arguments,
                        Reply reply) {
  auto args = arguments_to_json(arguments, *target->member, target->types(), form_);
  if (!args) return reply(args.error());
  if (waiting_.size() >= max_waiting)
    return reply(rr::make_error(rr::ErrorCode::out_of_system_resource,
                                "the client has " + std::to_string(max_waiting) + " questions to answer already"));
  const auto number = ++last_;
  const auto expired = [this, number, executor = executor_] {
    const auto late = waiting_.extract(number);
    if (!late) return;
    late.mapped()->reply(rr::make_error(rr::ErrorCode::operation_timeout, "the client has not answered in time"));
    asio::post(executor, [kept = late.mapped()] {});  // this function is part of it
  };
  const auto asked = std::make_shared<Question>(target, std::move(reply), executor_, expired);
  asked->limit.arm(answer_time);
  waiting_[number] = asked;
  auto question = rr::OrderedJson::object();
  rr::add_key(question, "call") = number;
  rr::add_key(question, "args") = std::move(*args);
  outbox_->add("{\"callback\":" + id + "," + rr::write_json(question).substr(1));
}

void JsonQuestions::answer(const JsonRequest& request) {
  const auto& number = request.at("call");
  const auto found = waiting_.find(number.is_number_integer() ? number.get<std::int64_t>() : 0);
  if (found == waiting_.end())
    refuse(rr::ErrorCode::invalid_argument, "\"call\" is no question that waits; perhaps its time is over");
  const auto asked = found->second;
  waiting_.erase(found);
  const auto& member = *asked->target->member;
  if (const auto* error = request.find("error"); error && !error->is_null()) return asked->reply(read_error(*error));
  static const rr::Json none;
  const auto* result = request.find("result");
  const auto value =
      rr::value_from_json(result ? *result : none, member.type, asked->target->types(), form_, member.name);
  asked->reply(value);
  value_or_throw(value);
}

void JsonQuestions::end_of(std::string_view path, std::string_view member, const rr::Error& why) {
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    const auto asked = it->second;
    const bool is_of_it = asked->target->path() == path && asked->target->member->name == member;
    it = is_of_it ? waiting_.erase(it) : std::next(it);
    if (is_of_it) asked->reply(why);
  }
}

void JsonQuestions::end_all() {
  for (const auto& [number, asked] : std::exchange(waiting_, {})) asked->reply(client_gone());
}

}  // namespace rrgate
