#include "server/access/approvals.hpp"

#include <algorithm>

#include "node/tls/digest.hpp"
#include "server/access/base64url.hpp"

namespace rrgate {

std::string Approvals::key_of(const WantedCommand& command) {
  std::string out;
  const auto verb = to_string(command.verb);
  for (const auto part : {std::string_view(command.who.credential), std::string_view(command.device),
                          std::string_view(command.path), std::string_view(command.member), verb})
    out.append(part).push_back('\0');
  return out + command.who.subject().key();
}

std::vector<std::shared_ptr<Approvals::Asked>> Approvals::pending(Time now) const {
  std::vector<std::shared_ptr<Asked>> out;
  for (const auto& each : asked_)
    if (auto asked = each.lock(); asked && asked->state_ == ApprovalState::pending && now < asked->approval_.ends)
      out.push_back(std::move(asked));
  return out;
}

rr::Result<Approvals::AskedPtr> Approvals::ask(WantedCommand command, Wake wake, Time ends, Time now) {
  if (command.values.size() > max_values || command.why.size() > max_why)
    return rr::make_error(rr::ErrorCode::invalid_argument,
                          "too much for a person to judge: expected values of at most " + std::to_string(max_values) +
                              " bytes, and at most " + std::to_string(max_why) + " of \"why\"");
  std::erase_if(asked_, [](const auto& each) { return each.expired(); });
  const auto waiting = pending(now);
  const auto of_subject = std::count_if(waiting.begin(), waiting.end(), [&](const auto& each) {
    return each->approval_.command.who.subject() == command.who.subject();
  });
  if (waiting.size() >= max_pending || static_cast<std::size_t>(of_subject) >= max_of_subject)
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "too many commands wait for approval; a person must answer them first");
  auto asked = std::make_shared<Asked>();
  asked->approval_ = {encode_base64url(rr::random_bytes(9)), std::move(command), ends};
  asked->wake_ = std::move(wake);
  asked_.push_back(asked);
  return AskedPtr(std::move(asked));
}

bool Approvals::is_granted(const WantedCommand& command, Time now) const {
  const auto found = grants_.find(key_of(command));
  return found != grants_.end() && now < found->second;
}

std::vector<Approval> Approvals::list(Time now) const {
  std::vector<Approval> out;
  for (const auto& each : pending(now)) out.push_back(each->approval_);
  return out;
}

rr::Result<Approval> Approvals::answer(const std::string& id, const Identity& by, bool is_allowed,
                                       std::chrono::minutes grant, Time now) {
  const auto waiting = pending(now);
  const auto found =
      std::find_if(waiting.begin(), waiting.end(), [&](const auto& each) { return each->approval_.id == id; });
  if (found == waiting.end())
    return rr::make_error(rr::ErrorCode::resource_not_found,
                          "no such command waits: it was answered, is too old, or its client has gone");
  auto& asked = **found;
  if (is_allowed && asked.approval_.command.who.subject() == by.subject())
    return rr::make_error(rr::ErrorCode::permission_denied, "a user cannot approve their own command");
  asked.state_ = is_allowed ? ApprovalState::allowed : ApprovalState::denied;
  std::erase_if(grants_, [now](const auto& each) { return each.second <= now; });
  const bool is_somebody = !asked.approval_.command.who.subject().is_nobody();  // else it would be for everybody
  if (is_allowed && is_somebody && grant > std::chrono::minutes(0) && grants_.size() < 1000)
    grants_[key_of(asked.approval_.command)] = now + std::min(grant, longest_grant);
  auto out = asked.approval_;
  asked.wake_();
  return out;
}

Approvals::Stopped Approvals::stop(std::chrono::minutes time, Time now) {
  Stopped out;
  stopped_until_ = time == time.zero() ? now : std::max(now + time, stopped_until_);
  grants_.clear();
  for (const auto& each : asked_)
    if (const auto asked = each.lock()) {  // also what was allowed just now, and is not begun
      if (asked->state_ == ApprovalState::pending) ++out.commands;
      asked->state_ = ApprovalState::denied;
      asked->wake_();
    }
  for (const auto& each : running_)
    if (const auto end = each.lock()) {
      if (auto answer = (*end)()) out.answers.push_back(std::move(answer));
      ++out.commands;
    }
  return out;
}

std::shared_ptr<const void> Approvals::watch_stop(End end) {
  std::erase_if(running_, [](const auto& each) { return each.expired(); });
  auto kept = std::make_shared<const End>(std::move(end));
  running_.push_back(kept);
  return kept;
}

}  // namespace rrgate
