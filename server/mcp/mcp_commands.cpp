// What agents command: found, judged, shown to a person, judged again, given under a lease. Layer: server/mcp. See
// docs/mcp.md.
#include <chrono>

#include "core/types/value_size.hpp"
#include "server/http/endpoints/call_log.hpp"
#include "server/http/endpoints/large_json.hpp"
#include "server/http/endpoints/leases.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/mcp/mcp_describe.hpp"
#include "server/mcp/mcp_tools.hpp"

namespace rrgate {

namespace {

/// Results of a generator that an agent gets.
constexpr std::size_t most_results = 100;
constexpr std::size_t usual_results = 10;
constexpr std::size_t largest_results = 1024u * 1024;  // bytes of values; as JSON they may be longer

/// What a device may take to answer; it is the lease that bounds it.
constexpr std::chrono::seconds longest_call{50};
/// What a sign of life may take: while one is written, nobody looks whether the lease has to end.
constexpr milliseconds longest_sign{500};
/// The gateway holds the lease for the agent as long as its request is there; both parts of it take less.
constexpr milliseconds agent_deadman{60'000};

rr::LockWanted wanted_lease(rr::LockCommand command, const std::string& path) {
  rr::LockWanted out;
  out.command = command;
  out.path = path;
  return out;
}

/// A lease that ends with this, and the device is safe then.
class AgentLease {
 public:
  AgentLease(std::shared_ptr<ValueClient> holder, std::string path, std::function<void()> wake)
      : holder_(std::move(holder)), path_(std::move(path)), lost_(std::make_shared<std::string>()) {
    holder_->on_lease_ended([lost = lost_, wake = std::move(wake)](const std::string&, const std::string& why) {
      *lost = why;
      wake();
    });
  }
  AgentLease(const AgentLease&) = delete;
  AgentLease& operator=(const AgentLease&) = delete;
  ~AgentLease() { release(); }

  /// Ends it now. What the device answers to that; null: it is not known.
  SafeAnswerPtr release() {
    if (!std::exchange(is_released_, true)) {
      holder_->on_lease_ended(nullptr);
      const auto command = wanted_lease(rr::LockCommand::release_lease, path_);
      holder_->upstream()->lock(*holder_, command, [](const rr::Result<>&) {});
    }
    return holder_->safe_answer();
  }

  /// Throws   rr::Exception: it was taken over, or the device is away.
  void check() const {
    if (!lost_->empty()) refuse(rr::ErrorCode::object_locked_error, "the lease has ended: " + *lost_);
  }
  void renew() {
    const auto command = wanted_lease(rr::LockCommand::renew_lease, path_);
    holder_->upstream()->lock(*holder_, command, [lost = lost_](const rr::Result<>& renewed) {
      if (!renewed && lost->empty()) *lost = renewed.error().message;
    });
  }

 private:
  std::shared_ptr<ValueClient> holder_;
  std::string path_;
  std::shared_ptr<std::string> lost_;  ///< why; empty: it is held
  bool is_released_ = false;
};

/// A command that is being given.
struct Running {
  bool is_stopped = false;
  std::optional<AgentLease> lease;
};

std::string why_of(const JsonRequest& arguments) {
  (void)arguments.at("why");
  return arguments.text("why", "");
}

bool is_dry_run(const JsonRequest& arguments) {
  const auto* given = arguments.find("dry_run");
  if (given && !given->is_boolean()) refuse(rr::ErrorCode::invalid_argument, "\"dry_run\" is true or false");
  return given && given->get<bool>();
}

[[noreturn]] void refuse_late() {
  refuse(rr::ErrorCode::operation_timeout, "the device has not answered in time");
}

/// The function or property that a command is for.
const rr::MemberDefinition& commanded_member(const Target& target, Verb verb) {
  const bool is_call = verb == Verb::call;
  const auto* member = target.member;
  if (!member || member->kind != (is_call ? rr::MemberKind::function : rr::MemberKind::property))
    refuse(rr::ErrorCode::invalid_operation,
           rr::quote(name_of(target)) + " is a " +
               (member ? std::string(member_kind_name(member->kind)) : std::string("object")) +
               "; agents call functions and set properties, and write to nothing else");
  if (is_call && member->step_parameter())
    refuse(rr::ErrorCode::invalid_operation,
           rr::quote(member->name) + " is a generator that is sent a value for each step; agents call none of these");
  expect_direction(*member, rr::MemberDirection::readonly);
  return *member;
}

/// A generator that the device is told of the end of, whatever that comes by. One that is at its end hears nothing.
class OpenGenerator {
 public:
  OpenGenerator(std::shared_ptr<ValueClient> client, const Target& target)
      : client_(std::move(client)), end_(target.request(rr::CallKind::generator_abort)) {
    end_.generator = client_->next_generator();
  }
  OpenGenerator(const OpenGenerator&) = delete;
  OpenGenerator& operator=(const OpenGenerator&) = delete;
  ~OpenGenerator() {
    client_->upstream()->request(*client_, end_, [](const rr::Result<rr::Value>&) {});
  }

  rr::GeneratorId id() const { return end_.generator; }
  /// It will end in good order.
  void close_at_end() { end_.kind = rr::CallKind::generator_close; }

 private:
  std::shared_ptr<ValueClient> client_;
  rr::Called end_;
};

}  // namespace

/// What is judged, shown and sent is this, once read.
struct McpTools::Command {  // NOLINT(bugprone-exception-escape): the JSON of its values throws nothing in moves
  TargetPtr target;
  rr::Called called = {};
  rr::OrderedJson values = {};  ///< of `called`, by the names of parameters or of the property
  WantedCommand wanted = {};
  std::size_t most = usual_results;  ///< of a generator
};

McpTools::Answer McpTools::call_function(JsonRequestPtr arguments) {
  return command(std::move(arguments), Verb::call);
}

McpTools::Answer McpTools::set_property(JsonRequestPtr arguments) {
  return command(std::move(arguments), Verb::write);
}

McpTools::Answer McpTools::command(JsonRequestPtr arguments, Verb verb) {
  const auto why = why_of(*arguments);
  const bool is_dry = is_dry_run(*arguments);
  Command command;
  command.target = co_await find(arguments);
  const auto& target = *command.target;
  allow(target, verb);
  const auto& member = commanded_member(target, verb);
  const JsonMaking making{gateway_.workers(), {}};
  const auto& form = making.form;
  if (const auto* most = arguments->find("most")) command.most = count_of(*most, "most", most_results);
  command.called = target.request(verb == Verb::call ? rr::CallKind::function : rr::CallKind::property_set);
  if (verb == Verb::call) {
    command.called.arguments = co_await arguments_of(*arguments, target, making);
    command.values = value_or_throw(arguments_to_json(command.called.arguments, member, target.types(), form));
  } else {
    auto given = co_await value_of(*arguments, target, member.type, member.name, making);
    command.called.arguments.push_back(std::move(given));
    command.values = rr::OrderedJson::object();
    rr::add_key(command.values, member.name) = to_json(target, command.called.arguments.front(), form);
  }
  const auto what = access_request(target, verb);
  command.wanted = {who(),
                    std::string(what.device),
                    std::string(what.service),
                    std::string(what.path),
                    member.name,
                    verb,
                    rr::write_json(command.values),
                    why};
  auto terms = judge(command);
  auto& approvals = gateway_.approvals();
  const bool is_approved = !terms.needs_approval || approvals.is_granted(command.wanted, Approvals::Clock::now());
  if (is_dry) {
    auto out = rr::OrderedJson::object();
    rr::add_key(out, "member") = name_of(target);
    rr::add_key(out, "would_send") = command.values;
    rr::add_key(out, "would_ask_a_person") = !is_approved;
    rr::add_key(out, "would_hold_lease") = terms.needs_lease;
    co_return out;
  }
  if (!is_approved) {
    co_await ask_person(command);
    terms = judge(command);  // while the person was asked rights may have changed
  }
  co_return co_await give(command, terms);
}

AgentTerms McpTools::judge(const Command& command) {
  if (gateway_.approvals().is_stopped(Approvals::Clock::now()))
    refuse(rr::ErrorCode::permission_denied,
           "a person has stopped all agents; nothing is commanded until that is over");
  const auto what = command.wanted.what();
  const auto allowed = standing_.check(access_request(*command.target, command.wanted.verb));
  if (!allowed) {
    gateway_.reject(allowed.error());
    throw rr::Exception(allowed.error());
  }
  const auto terms = gateway_.access().state().rules.terms(standing_.identity(), what);
  if (!terms) refuse(rr::ErrorCode::permission_denied, "no rule says on which terms an agent may do this");
  if (const auto fits = terms->check(command.values); !fits) {
    gateway_.reject(Rejection::forbidden);
    gateway_.access().record_refusal({.event = "refused",
                                      .who = &standing_.identity(),
                                      .what = &what,
                                      .detail = fits.error().message,
                                      .outcome = Outcome::refused});
    throw rr::Exception(fits.error());
  }
  return *terms;
}

rr::awaitable<void> McpTools::ask_person(const Command& command) {
  const auto what = command.wanted.what();
  const auto record = [&](std::string_view event, std::string_view detail, Outcome outcome = Outcome::ok) {
    gateway_.access().record({.event = event, .who = &who(), .what = &what, .detail = detail, .outcome = outcome});
  };
  const auto longest = gateway_.config().mcp.longest_approval;
  const auto now = Approvals::Clock::now();
  const auto asked = value_or_throw(gateway_.approvals().ask(command.wanted, reply_.waker(), now + longest, now));
  record("approval_asked", command.wanted.why);
  const std::function<bool()> is_answered = [&] {
    go_on(*command.target, command.wanted.verb);
    return asked->state() != ApprovalState::pending;
  };
  std::optional<rr::Error> failed;
  reply_.note("a person is asked");
  try {
    if (!co_await reply_.wait(longest, is_answered))
      failed = rr::make_error(rr::ErrorCode::operation_timeout, "nobody has answered in time, and so it is refused");
  } catch (const rr::Exception& exception) {
    failed = exception.error();
  }
  if (!failed && asked->state() != ApprovalState::allowed)
    failed = rr::make_error(rr::ErrorCode::permission_denied, "a person has denied it");
  else if (failed)
    record("approval_expired", failed->message, Outcome::refused);
  if (failed) throw rr::Exception(*failed);
}

McpTools::Answer McpTools::give(const Command& command, const AgentTerms& terms) {
  const auto& target = *command.target;
  const auto trace = trace_id_of(reply_.request().header("traceparent"));
  const auto running = std::make_shared<Running>();
  const auto watching = gateway_.approvals().watch_stop([running, wake = reply_.waker()] {
    running->is_stopped = true;
    wake();
    return running->lease ? running->lease->release() : nullptr;
  });
  auto client = target.client;
  auto& lease = running->lease;
  if (terms.needs_lease) {
    reply_.writer().set_patience(longest_sign);
    auto asker = target.client;
    auto identity = standing_.identity();
    auto path = target.path();
    const auto begun = gateway_.access().begin(
        identity, {command.wanted.device, command.wanted.service, command.wanted.path, {}, Verb::lock}, trace, "lease");
    client = co_await hold_lease(gateway_, std::move(asker), std::move(identity), std::move(path),
                                 rr::LockCommand::acquire_lease, agent_deadman, LeaseNeeds::nothing);
    if (begun) begun->finish({});
    lease.emplace(client, target.path(), reply_.waker());
  }
  const std::function<void()> check = [&] {
    if (running->is_stopped) refuse(rr::ErrorCode::operation_aborted, "a person has stopped all agents");
    reply_.expect_client();
    go_on(target, command.wanted.verb);
    if (lease) lease->check();
  };
  check();
  reply_.note("the device is at work");
  const auto entry = gateway_.access().begin(standing_.identity(), command.wanted.what(), trace);
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "member") = name_of(target);
  rr::add_key(out, "sent") = command.values;
  rr::Value said;
  if (target.member->is_generator()) {
    const auto results = co_await run_generator(command, client, check, entry);
    out.update(results);
  } else {
    auto called = command.called;
    OnAnswer record = [entry](const rr::Result<rr::Value>& result) {
      if (entry) entry->finish(result ? rr::Result<>() : rr::Result<>(result.error()));
    };
    const auto answered = co_await ask(*client, std::move(called), longest_call, check, std::move(record));
    if (!answered) refuse_late();
    if (!*answered) {
      has_asked_device_ = true;
      throw rr::Exception(answered->error());
    }
    said = **answered;
  }
  if (lease) {
    lease->renew();
    const std::function<bool()> is_over = [&] {
      check();
      return false;
    };
    reply_.note("the lease is held");
    co_await reply_.wait(terms.hold, is_over);
    const auto safe = lease->release();
    const auto answer = co_await wait_for_answer(safe);
    if (!answer)
      rr::add_key(out, "unanswered") = unanswered_stop;
    else if (!*answer)
      rr::add_key(out, "not_made_safe") = error_for_agent(answer->error());
    else
      rr::add_key(out, "made_safe") = "the lease was held for " + std::to_string(terms.hold.count()) + " s";
  }
  if (target.member->is_generator() || command.wanted.verb != Verb::call) co_return out;
  // The device has done it: that there is no room for what it says of that is no failure, nor a reason to let go.
  try {
    co_await add_value(out, target, said);
  } catch (const rr::Exception& exception) {
    rr::add_key(out, result_left_out) = bounded_text(exception.error().message);
  }
  co_return out;
}

rr::awaitable<std::optional<rr::Result<rr::Value>>> McpTools::ask(ValueClient& client, rr::Called called,
                                                                  std::chrono::milliseconds longest,
                                                                  const std::function<void()>& check,
                                                                  OnAnswer on_answer) {
  struct Answered {
    std::optional<rr::Result<rr::Value>> result;
  };
  const auto answered = std::make_shared<Answered>();
  client.upstream()->request(client, called,
                             [answered, on_answer = std::move(on_answer), life = client.shared_from_this(),
                              wake = reply_.waker()](const rr::Result<rr::Value>& result) {
                               if (on_answer) on_answer(result);
                               answered->result = result;
                               wake();
                             });
  const std::function<bool()> is_answered = [&] {
    check();
    return answered->result.has_value();
  };
  (void)co_await reply_.wait(longest, is_answered);
  co_return std::move(answered->result);
}

McpTools::Answer McpTools::run_generator(const Command& command, std::shared_ptr<ValueClient> client,
                                         const std::function<void()>& check, AuditEntryPtr entry) {
  const auto& target = *command.target;
  const auto until = std::chrono::steady_clock::now() + longest_call;
  const auto generator = std::make_shared<OpenGenerator>(client, target);
  auto opening = command.called;
  opening.kind = rr::CallKind::generator_open;
  opening.generator = generator->id();
  std::optional<rr::Error> failed;
  OnAnswer keep = [generator](const rr::Result<rr::Value>&) {};  // who goes before it is open leaves its end to this
  const auto opened = co_await ask(*client, std::move(opening), longest_call, check, std::move(keep));
  if (!opened) refuse_late();
  if (!*opened) failed = opened->error();
  auto results = rr::OrderedJson::array();
  std::size_t bytes = 0;
  bool has_ended = false;
  std::string left_out;  // why the next result is not there, and no other is asked for
  rr::Result<> late;     // the step that was not answered in time
  while (!failed && left_out.empty() && results.size() < command.most && bytes < largest_results) {
    auto step = target.request(rr::CallKind::generator_next);
    step.generator = generator->id();
    const auto rest = std::chrono::duration_cast<milliseconds>(until - std::chrono::steady_clock::now());
    const auto stepped = co_await ask(*client, std::move(step), rest, check, nullptr);
    // What the device may take is also bounded by the configuration.
    if (!stepped || (!*stepped && stepped->error().code == rr::ErrorCode::request_timeout)) {
      left_out = "the time for an answer was over";
      late = rr::make_error(rr::ErrorCode::request_timeout, left_out);
      break;
    }
    const auto& next = *stepped;
    has_ended = !next && next.error().code == rr::ErrorCode::stop_iteration;
    if (has_ended) break;
    if (!next) {
      failed = next.error();
      break;
    }
    if (bytes + rr::held_bytes(*next) > largest_results) {
      left_out =
          "the results have more than " + std::to_string(largest_results) + " bytes, all that an answer has room for";
      break;
    }
    try {
      results.push_back(to_json(target, *next, {}));
      bytes += held_bytes(results.back());
    } catch (const rr::Exception& exception) {
      left_out = bounded_text(exception.error().message);
    }
    reply_.note(std::to_string(results.size()) + " results so far");
  }
  if (entry) entry->finish(failed ? rr::Result<>(*failed) : late);
  if (!late && results.empty()) refuse_late();
  if (!failed && late) generator->close_at_end();  // a step under way is aborted: a close would wait for its end
  if (failed) {
    has_asked_device_ = true;
    throw rr::Exception(*failed);
  }
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "has_ended") = has_ended;
  rr::add_key(out, from_device) = std::move(results);
  if (!left_out.empty()) rr::add_key(out, result_left_out) = left_out;
  co_return out;
}

McpTools::Answer McpTools::stop(JsonRequestPtr arguments) {
  const auto target = co_await find(arguments, true);
  const auto trace = trace_id_of(reply_.request().header("traceparent"));
  const auto entry = gateway_.access().begin(who(), access_request(*target, Verb::call), trace, "stop");
  const auto& upstream = target->client->upstream();
  const auto safe =
      std::make_shared<SafeAnswer>(reply_.writer().executor(), upstream->device().config().name, target->path());
  upstream->stop_object(target->path(), [safe, entry](const rr::Result<>& result) {
    if (entry) entry->finish(result);
    safe->set(result);
  });
  const auto answer = co_await wait_for_answer(safe);
  if (answer && !*answer) throw rr::Exception(answer->error());
  co_return stop_to_json(*safe);
}

rr::awaitable<std::optional<rr::Result<>>> McpTools::wait_for_answer(SafeAnswerPtr safe) {
  if (!safe) co_return std::nullopt;
  if (!safe->result()) has_asked_device_ = true;
  co_await safe->wait();
  co_return safe->result();
}

}  // namespace rrgate
