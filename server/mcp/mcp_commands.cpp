// What agents command: found, judged, shown to a person, judged again, given under a lease. Layer: server/mcp. See
// docs/mcp.md.
#include <chrono>

#include "server/http/endpoints/call_log.hpp"
#include "server/http/endpoints/leases.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/mcp/mcp_describe.hpp"
#include "server/mcp/mcp_tools.hpp"

namespace rrgate {

namespace {

/// What a device may take to answer; it is the lease that bounds it.
constexpr std::chrono::seconds longest_call{50};
/// The gateway holds the lease for the agent as long as its request is there; both parts of it take less.
constexpr milliseconds agent_deadman{60'000};

std::chrono::system_clock::time_point wall_now() {
  return std::chrono::system_clock::now();
}

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
  ~AgentLease() {
    holder_->on_lease_ended(nullptr);
    const auto command = wanted_lease(rr::LockCommand::release_lease, path_);
    holder_->upstream()->lock(*holder_, command, [](const rr::Result<>&) {});
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

/// The function or property that a command is for.
const rr::MemberDefinition& commanded_member(const Target& target, Verb verb) {
  const bool is_call = verb == Verb::call;
  const auto* member = target.member;
  if (!member || member->kind != (is_call ? rr::MemberKind::function : rr::MemberKind::property))
    refuse(rr::ErrorCode::invalid_operation,
           rr::quote(name_of(target)) + " is a " +
               (member ? std::string(member_kind_name(member->kind)) : std::string("object")) +
               "; agents call functions and set properties, and write to nothing else");
  if (is_call && member->is_generator())
    refuse(rr::ErrorCode::invalid_operation,
           rr::quote(member->name) + " is a generator, which goes on for longer than one request; agents call none");
  expect_direction(*member, rr::MemberDirection::readonly);
  return *member;
}

}  // namespace

/// What is judged, shown and sent is this, once read.
struct McpTools::Command {  // NOLINT(bugprone-exception-escape): the JSON of its values throws nothing in moves
  TargetPtr target;
  rr::Called called = {};
  rr::OrderedJson values = {};  ///< of `called`, by the names of parameters or of the property
  WantedCommand wanted = {};
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
  has_asked_device_ = false;  // from here on these are the gateway's words, until the device is asked
  const auto& target = *command.target;
  allow(target, verb);
  const auto& member = commanded_member(target, verb);
  const rr::JsonForm form;
  command.called = target.request(verb == Verb::call ? rr::CallKind::function : rr::CallKind::property_set);
  if (verb == Verb::call) {
    command.called.arguments = arguments_of(*arguments, target, form);
    command.values = value_or_throw(arguments_to_json(command.called.arguments, member, target.types(), form));
  } else {
    command.called.arguments.push_back(value_of(*arguments, target, member.type, member.name, form));
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
  const bool is_approved = !terms.needs_approval || approvals.is_granted(command.wanted, wall_now());
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
  if (gateway_.approvals().is_stopped(wall_now()))
    refuse(rr::ErrorCode::permission_denied,
           "a person has stopped all agents; nothing is commanded until that is over");
  const auto what = command.wanted.what();
  const auto allowed = standing_.check(what);
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
  const auto now = wall_now();
  const auto asked = value_or_throw(gateway_.approvals().ask(command.wanted, reply_.waker(), now + longest, now));
  record("approval_asked", command.wanted.why);
  const std::function<bool()> is_answered = [&] {
    go_on(*command.target, command.wanted.verb);
    return asked->state() != ApprovalState::pending;
  };
  const std::string nobody = "nobody has answered in time, and so it is refused";
  std::optional<rr::Error> failed;
  try {
    co_await reply_.wait(longest, is_answered, nobody);
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
  struct Answered {
    std::optional<rr::Result<rr::Value>> result;
  };
  const auto& target = *command.target;
  const auto trace = trace_id_of(reply_.request().header("traceparent"));
  const auto stopped = std::make_shared<bool>(false);
  const auto watching = gateway_.approvals().watch_stop([stopped, wake = reply_.waker()] {
    *stopped = true;
    wake();
  });
  auto client = target.client;
  std::optional<AgentLease> lease;
  if (terms.needs_lease) {
    auto asker = target.client;
    auto identity = standing_.identity();
    auto path = target.path();
    const auto begun = gateway_.access().begin(
        identity, {command.wanted.device, command.wanted.service, command.wanted.path, {}, Verb::lock}, trace, "lease");
    client = co_await hold_lease(gateway_, std::move(asker), std::move(identity), std::move(path),
                                 rr::LockCommand::acquire_lease, agent_deadman);
    if (begun) begun->finish({});
    lease.emplace(client, target.path(), reply_.waker());
  }
  const auto check = [&] {
    if (*stopped) refuse(rr::ErrorCode::operation_aborted, "a person has stopped all agents");
    go_on(target, command.wanted.verb);
    if (lease) lease->check();
  };
  check();
  const auto entry = gateway_.access().begin(standing_.identity(), command.wanted.what(), trace);
  const auto answered = std::make_shared<Answered>();
  client->upstream()->request(*client, command.called,
                              [answered, entry, client, wake = reply_.waker()](const rr::Result<rr::Value>& result) {
                                if (entry) entry->finish(result ? rr::Result<>() : rr::Result<>(result.error()));
                                answered->result = result;
                                wake();
                              });
  const std::function<bool()> is_answered = [&] {
    check();
    return answered->result.has_value();
  };
  const std::string late = "the device has not answered in time" + std::string(lease ? "; it was made safe" : "");
  co_await reply_.wait(longest_call, is_answered, late);
  if (!*answered->result) {
    has_asked_device_ = true;
    throw rr::Exception(answered->result->error());
  }
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "member") = name_of(target);
  rr::add_key(out, "sent") = command.values;
  if (command.wanted.verb == Verb::call) rr::add_key(out, from_device) = to_json(target, **answered->result, {});
  if (!lease) co_return out;
  lease->renew();
  const std::function<bool()> is_over = [&] {
    check();
    return false;
  };
  std::optional<rr::Error> ended;
  try {
    co_await reply_.wait(terms.hold, is_over, "");
  } catch (const rr::Exception& exception) {
    if (exception.error().code != rr::ErrorCode::operation_timeout) ended = exception.error();
  }
  if (ended) throw rr::Exception(*ended);
  rr::add_key(out, "made_safe") = "the lease was held for " + std::to_string(terms.hold.count()) + " s";
  co_return out;
}

McpTools::Answer McpTools::stop(JsonRequestPtr arguments) {
  const auto target = co_await find(arguments, true);
  has_asked_device_ = false;
  const auto trace = trace_id_of(reply_.request().header("traceparent"));
  const auto entry = gateway_.access().begin(who(), access_request(*target, Verb::call), trace, "stop");
  const auto stopped = target->client->upstream()->stop_object(target->path());
  if (entry) entry->finish(stopped);
  if (!stopped) throw rr::Exception(stopped.error());
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "stopped") = target->path();
  co_return out;
}

}  // namespace rrgate
