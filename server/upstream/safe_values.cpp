#include "server/upstream/safe_values.hpp"

#include <algorithm>
#include <utility>

#include "core/session/service_path.hpp"
#include "server/json/value_from_json.hpp"
#include "server/log/log.hpp"
#include "server/upstream/device.hpp"
#include "server/upstream/lock_path.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

namespace {

std::string safe_member(const SafeAction& action) {
  return action.path + "." + action.member;
}

rr::Error misfit(const SafeAction& action, const std::string& why) {
  return rr::make_error(rr::ErrorCode::invalid_configuration,
                        "safe value " + rr::quote(safe_member(action)) + " of the gateway: " + why);
}

rr::MemberKind member_kind(SafeAction::Kind kind) {
  return kind == SafeAction::Kind::call   ? rr::MemberKind::function
         : kind == SafeAction::Kind::wire ? rr::MemberKind::wire
                                          : rr::MemberKind::property;
}

/// The JSON in the declared types.
rr::Result<SafeRequest> read_action(const SafeAction& action, const rr::EntityDefinition& type,
                                    const rr::TypeRegistry& types) {
  const auto* member = type.find_member(action.member);
  if (!member || member->kind != member_kind(action.kind) || member->is_generator())
    return misfit(
        action, type.qualified_name + " has " +
                    (member ? "a " + std::string(member_kind_name(member->kind)) + " of this name" : "no such member") +
                    ", expected a " + std::string(member_kind_name(member_kind(action.kind))));
  if (member->direction() == rr::MemberDirection::readonly) return misfit(action, "it can only be read");
  const auto json = rr::read_json(action.json);
  if (!json) return misfit(action, json.error().message);
  SafeRequest out{action.kind, action.path, action.member, {}};
  const auto add = [&](const rr::Json& each, const rr::TypeDefinition& of, const std::string& name) -> rr::Result<> {
    auto value = rr::value_from_json(each, of, types, {}, name);
    if (!value) return misfit(action, value.error().message);
    out.values.push_back(std::move(*value));
    return {};
  };
  if (action.kind != SafeAction::Kind::call) {
    if (auto added = add(*json, member->type, member->name); !added) return added.error();
    return out;
  }
  if (json->size() != member->parameters.size())
    return misfit(action,
                  std::to_string(json->size()) + " arguments, expected " + std::to_string(member->parameters.size()));
  for (std::size_t i = 0; i < json->size(); ++i)
    if (auto added = add((*json)[i], member->parameters[i].type, member->parameters[i].name); !added)
      return added.error();
  return out;
}

/// What has become of all that was sent at once.
class Answers {
 public:
  explicit Answers(SafeValues::Answered all) : all_(std::move(all)) {}

  void expect_one() { ++open_; }
  void add(const rr::Result<>& answer) {
    if (result_ && !answer) result_ = answer;
    if (--open_ == 0 && all_) all_(result_);
  }

 private:
  SafeValues::Answered all_;
  std::size_t open_ = 0;
  rr::Result<> result_;
};

}  // namespace

SafeValues::SafeValues(std::string device, std::string_view service, const std::vector<SafeAction>& actions)
    : device_(std::move(device)) {
  for (auto action : actions) {
    if (!rr::is_within(action.path, service)) continue;
    action.path = canonical_lock_path(action.path);  // as leases and locks know it
    items_.push_back({action, misfit(action, "not checked yet")});
  }
}

SafeValues::~SafeValues() {
  for (const auto& path : owed_)
    log(LogLevel::warning, "the device was not made safe: it was away, and the gateway stops or leaves it",
        {{"device", device_}, {"path", path}});
  for (const auto& item : items_)
    if (item.open != Open::no)
      log(LogLevel::warning,
          "the device may not be safe: it has not taken a safe value, and the gateway stops or leaves it",
          {{"device", device_}, {"member", safe_member(item.action)}});
}

void SafeValues::handle_opened(const std::shared_ptr<Upstream>& upstream) {
  for (auto& item : items_) item.is_checked = false;
  handle_lost(upstream->number());  // its session before this one may have been closed while it rested
  for (auto& item : items_)
    if (item.open == Open::refused) owe(item);  // this one may be let in
  for (std::size_t i = 0; i < items_.size(); ++i) look_up(i, upstream);
  pay(upstream);
}

void SafeValues::check_again(std::string_view path, const std::shared_ptr<Upstream>& upstream) {
  for (std::size_t i = 0; i < items_.size(); ++i)
    if (rr::is_within(items_[i].action.path, path)) look_up(i, upstream);
}

void SafeValues::look_up(std::size_t index, const std::shared_ptr<Upstream>& upstream) {
  auto& item = items_[index];
  if (upstream->object_type(item.action.path)) {
    item.is_checked = true;
    return read(item, *upstream);
  }
  auto looked_up = [weak = weak_from_this(), index, upstream](const rr::Result<rr::Value>& found) {
    const auto self = weak.lock();
    if (!self) return;
    auto& wanted = self->items_[index];
    wanted.is_checked = true;
    if (found)
      self->read(wanted, *upstream);
    else if (!upstream->is_lost() && !(wanted.request && is_refusal(found.error())))
      self->take(wanted, misfit(wanted.action, found.error().message));
    self->pay(upstream);
  };
  upstream->find_object(item.action.path, std::move(looked_up));
}

void SafeValues::read(Item& item, Upstream& upstream) {
  const auto* type = upstream.object_type(item.action.path);
  if (type) take(item, read_action(item.action, *type, *upstream.types()));
}

void SafeValues::take(Item& item, rr::Result<SafeRequest> request) {
  const bool is_known = !request && !item.request && request.error().message == item.request.error().message;
  item.request = std::move(request);
  if (item.request) item.last = *item.request;
  if (!item.request && !is_known)
    log(LogLevel::error, "no leases where this would have to be safe",
        {{"device", device_}, {"error", item.request.error().message}});
}

rr::Result<> SafeValues::check(std::string_view path) const {
  for (const auto& item : items_)
    if (rr::is_within(item.action.path, path) && !item.request) return item.request.error();
  return {};
}

bool SafeValues::has(std::string_view path) const {
  return std::any_of(items_.begin(), items_.end(),
                     [&](const Item& item) { return rr::is_within(item.action.path, path); });
}

bool SafeValues::is_checked(std::string_view path) const {
  return std::all_of(items_.begin(), items_.end(),
                     [&](const Item& item) { return item.is_checked || !rr::is_within(item.action.path, path); });
}

/// What was owed when the session was lost: first what has been looked at, then, as objects are found, the rest.
void SafeValues::pay(const std::shared_ptr<Upstream>& upstream) {
  pay_due(upstream, [this](const std::string& path) { return is_checked(path); });
}

void SafeValues::pay_around(std::string_view path, const std::shared_ptr<Upstream>& upstream) {
  const auto is_around = [&](const std::string& owed) {
    return rr::is_within(owed, path) || rr::is_within(path, owed);
  };
  for (auto& item : items_)
    if (item.open == Open::refused && is_around(item.action.path)) item.open = Open::owed;
  pay_due(upstream, is_around);
}

void SafeValues::pay_due(const std::shared_ptr<Upstream>& upstream,
                         const std::function<bool(const std::string&)>& is_due) {
  std::vector<std::string> due;
  std::copy_if(owed_.begin(), owed_.end(), std::back_inserter(due), is_due);
  std::erase_if(owed_, is_due);
  for (const auto& path : due)
    send(path, upstream, Why::lease_ended, [device = device_, path](const rr::Result<>& answer) {
      if (answer)
        log(LogLevel::warning, "the device is back, and was made safe: a lease had ended while it was away",
            {{"device", device}, {"path", path}});
    });
  for (auto& item : items_)
    if (item.open == Open::owed && is_due(item.action.path))
      send_item(item, upstream, Why::lease_ended,
                [device = device_, member = safe_member(item.action)](const rr::Result<>& answer) {
                  if (answer)
                    log(LogLevel::warning, "the device was made safe: it had not taken a safe value before",
                        {{"device", device}, {"member", member}});
                });
}

bool SafeValues::is_owing() const {
  return !owed_.empty() ||
         std::any_of(items_.begin(), items_.end(), [](const Item& item) { return item.open != Open::no; });
}

bool SafeValues::has_open(Open open) const {
  return std::any_of(items_.begin(), items_.end(), [open](const Item& item) { return item.open == open; });
}

void SafeValues::handle_lost(std::uint64_t upstream) {
  for (auto& item : items_)
    if ((item.open == Open::unanswered || item.open == Open::refused) && item.upstream == upstream) owe(item);
  end_waiting();
  if (has_open(Open::owed)) links_.owed();
}

void SafeValues::send_again() {
  again_.reset();
  for (auto& item : items_)
    if (item.open == Open::refused) owe(item);
  if (has_open(Open::owed)) links_.owed();
}

void SafeValues::owe(Item& item) {
  item.open = links_.is_leased(item.action.path) ? Open::no : Open::owed;
}

bool SafeValues::send(const std::string& path, const std::shared_ptr<Upstream>& by, Why why, Answered answered) {
  if (!by || by->is_lost()) {
    if (std::find(owed_.begin(), owed_.end(), path) == owed_.end()) owed_.push_back(path);
    links_.owed();
    if (answered)
      answered(rr::make_error(rr::ErrorCode::connection_error, "the device is away; it is made safe when it is back"));
    return false;
  }
  by->forget_commands(path);
  const auto answers = std::make_shared<Answers>(std::move(answered));
  answers->expect_one();  // the end of this
  for (auto& item : items_) {
    if (!rr::is_within(item.action.path, path) || !item.last) continue;
    item.failure.reset();
    item.refused_since.reset();
    answers->expect_one();
    send_item(item, by, why, [answers](const rr::Result<>& answer) { answers->add(answer); });
  }
  answers->add({});
  return !by->is_lost();
}

void SafeValues::send_item(Item& item, const std::shared_ptr<Upstream>& by, Why why, const Answered& answered) {
  item.open = Open::no;
  const auto number = ++item.sendings;
  auto done = [weak = weak_from_this(), &item, number, by, why, answered](const rr::Result<rr::Value>& result) {
    const auto answer = result ? rr::Result<>() : rr::Result<>(result.error());
    const auto self = weak.lock();
    if (!self) return answered(answer);
    const bool is_last = number == item.sendings;
    const bool is_locked = !answer && answer.error().code == rr::ErrorCode::object_locked_error;
    const bool may_follow = why == Why::stop || (is_last && !self->links_.is_leased(item.action.path));
    const auto holder = is_locked && may_follow ? self->links_.locked_by(item.action.path) : nullptr;
    if (holder && holder != by) {
      note_refused(item, *by);
      holder->forget_commands(item.action.path);
      return self->send_item(item, holder, why, answered);
    }
    if (is_last) self->handle_answer(item, *by, answer);
    answered(answer);
  };
  by->make_safe(*item.last, std::move(done));
}

void SafeValues::note_refused(Item& item, const Upstream& by) {
  item.upstream = by.number();
  if (!item.refused_since) item.refused_since = std::chrono::steady_clock::now();
}

void SafeValues::handle_answer(Item& item, const Upstream& by, const rr::Result<>& answer) {
  if (answer)
    item.refused_since.reset();
  else
    handle_failed(item, by, answer.error());
  end_waiting();
  if (!has_open(Open::refused)) backoff_.reset();
}

void SafeValues::handle_failed(Item& item, const Upstream& by, const rr::Error& error) {
  if (std::exchange(item.failure, error.message) != error.message)
    log(LogLevel::error, "the device did not take a safe value",
        {{"device", device_}, {"member", safe_member(item.action)}, {"error", error.message}});
  if (by.is_lost()) {
    owe(item);
    if (item.open == Open::owed) links_.owed();
    return;
  }
  if (error.code == rr::ErrorCode::request_timeout) {
    item.upstream = by.number();
    item.open = Open::unanswered;
    return;
  }
  // connection_error: another gateway has lost the device, and may have it again with our session as it is.
  if (error.code == rr::ErrorCode::object_locked_error || error.code == rr::ErrorCode::connection_error)
    note_refused(item, by);
  else if (!item.refused_since || item.upstream == by.number())
    return;  // else another session has its own reasons, as a right that its user lacks
  if (std::chrono::steady_clock::now() - *item.refused_since > longest_refused) {
    log(LogLevel::error, "the device may not be safe: it has not taken a safe value for too long",
        {{"device", device_}, {"member", safe_member(item.action)}});
    return;
  }
  item.open = Open::refused;
  send_again_later(by.device());
}

void SafeValues::send_again_later(Device& device) {
  if (again_) return;
  if (!backoff_) backoff_.emplace(device.retry().min, device.retry().max);
  again_.emplace(device.executor(), backoff_->next());
  again_->async_wait([weak = weak_from_this()](const boost::system::error_code& cancelled) {
    const auto self = weak.lock();
    if (!cancelled && self) self->send_again();
  });
}

void SafeValues::end_waiting() {
  if (!has_open(Open::refused)) again_.reset();
}

}  // namespace rrgate
