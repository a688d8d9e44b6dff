#include "server/upstream/service_locks.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "core/support/glob.hpp"
#include "server/log/log.hpp"
#include "server/upstream/lock_path.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

namespace {

rr::TimePoint steady_now() {
  return std::chrono::steady_clock::now();
}

/// Sets a flag for as long as it lives.
class Settling {
 public:
  explicit Settling(bool& flag) : flag_(flag) { flag_ = true; }
  ~Settling() { flag_ = false; }
  Settling(const Settling&) = delete;
  Settling& operator=(const Settling&) = delete;

 private:
  bool& flag_;
};

/// Whether object locks leave it alone.
bool is_exempt(const rr::MemberDefinition& member, MemberUse use) {
  return member.has_modifier("nolock") || (use == MemberUse::read && member.has_modifier("nolockread"));
}

}  // namespace

ServiceLocks::ServiceLocks(Device& device, std::string service)
    : device_(device),
      service_(std::move(service)),
      safe_(std::make_shared<SafeValues>(device.config().name, service_, device.config().leases.safe)),
      timeout_(device.executor()) {}

void ServiceLocks::add(const UpstreamClient& client, Upstream& upstream) {
  const auto id = ++last_client_;
  clients_[&client] = id;
  std::erase_if(upstreams_, [](const auto& known) { return known.second.expired(); });
  upstreams_[upstream.number()] = upstream.weak_from_this();
  table_.add(id, {client.lock_user(), upstream.number(), upstream.is_for_one_client()});
}

void ServiceLocks::remove(const UpstreamClient& client, std::function<void()> left) {
  const auto known = clients_.extract(&client);
  if (!known) {
    if (left) left();
    return;
  }
  const auto id = known.mapped();
  const auto first = requests_.lower_bound({id, 0});
  std::vector<std::function<void(const rr::Result<>&)>> open;
  for (auto it = first; it != requests_.end() && it->first.first == id;) {
    open.push_back(std::move(it->second));
    it = requests_.erase(it);
  }
  if (left) leaving_[id] = std::move(left);
  table_.remove(id, steady_now());
  leases_.handle_gone(id);
  settle();
  const auto why = rr::make_error(rr::ErrorCode::invalid_operation, "the user has changed, or the client has left");
  for (const auto& done : open) done(why);
}

void ServiceLocks::handle_wanted(const UpstreamClient& client, const rr::LockWanted& wanted,
                                 std::function<void(const rr::Result<>&)> done) {
  const auto known = clients_.find(&client);
  if (known == clients_.end()) return;
  if (rr::is_of_lease(wanted.command)) return done(handle_lease(client, known->second, wanted));
  const bool takes = wanted.command != rr::LockCommand::unlock && wanted.command != rr::LockCommand::exit_monitor;
  if (const auto free = leases_.check_lock(known->second, wanted.path, steady_now()); takes && !free) return done(free);
  requests_[{known->second, wanted.id}] = std::move(done);
  table_.handle_wanted(known->second, wanted, steady_now());
  settle();
}

void ServiceLocks::review(const UpstreamClient& client) {
  const auto known = clients_.find(&client);
  if (known == clients_.end()) return;
  const auto id = known->second;
  for (const auto& path : table_.paths_of(id))
    if (!client.may_lock(path)) table_.handle_right_lost(id, path, steady_now());
  for (const auto& lease : leases_.held()) {
    if (lease.holder != id) continue;
    if (!client.may_lock(lease.path))
      leases_.handle_lost(lease.path, "its holder has no right to it any more");
    else if (holders_[lease.path].could_command && !client.may_command(lease.path))  // it would renew it for ever
      leases_.handle_lost(lease.path, "its holder may neither write nor call anything there any more");
  }
  settle();
}

bool ServiceLocks::has_at(const UpstreamClient& client, std::string_view path) const {
  const auto known = clients_.find(&client);
  return known != clients_.end() && (table_.has_at(known->second, path) || leases_.has_at(known->second, path));
}

rr::Result<> ServiceLocks::check(const UpstreamClient& client, std::string_view path,
                                 const rr::MemberDefinition& member, MemberUse use) {
  const bool is_leased = use == MemberUse::command && device_.config().leases.is_offered;
  if (table_.is_empty() && !is_leased) return {};
  const auto need = is_leased ? need_of(path, member) : LeaseNeed::covered;
  if (need == LeaseNeed::never) return {};
  const auto known = clients_.find(&client);
  const auto id = known == clients_.end() ? 0 : known->second;
  auto allowed = table_.check(id, path, is_exempt(member, use), steady_now());
  if (allowed && is_leased) allowed = leases_.check(id, path, need, steady_now());
  settle();
  return allowed;
}

rr::Result<> ServiceLocks::check_packet(const UpstreamClient& client, std::string_view path,
                                        const rr::MemberDefinition& member) {
  if (!device_.config().leases.is_offered) return {};
  const auto need = need_of(path, member);
  if (need == LeaseNeed::never) return {};
  const auto known = clients_.find(&client);
  auto allowed = leases_.check(known == clients_.end() ? 0 : known->second, path, need, steady_now());
  settle();
  return allowed;
}

LeaseNeed ServiceLocks::need_of(std::string_view path, const rr::MemberDefinition& member) const {
  return device_.config().leases.need_of(std::string(path) + "." + member.name);
}

bool ServiceLocks::is_urgent(std::string_view path, const rr::MemberDefinition& member) const {
  return device_.config().leases.is_offered && need_of(path, member) == LeaseNeed::never;
}

// --- leases ---

rr::Result<> ServiceLocks::handle_lease(const UpstreamClient& client, LockClient id, const rr::LockWanted& wanted) {
  const auto& config = device_.config().leases;
  if (!config.is_offered)
    return rr::make_error(rr::ErrorCode::not_implemented_error, "the gateway gives no leases of device " +
                                                                    rr::quote(device_.config().name) +
                                                                    ": its configuration has no \"leases\" there");
  const auto now = steady_now();
  rr::Result<> result;
  if (wanted.command == rr::LockCommand::renew_lease) {
    result = leases_.renew(id, wanted.path, now);
  } else if (wanted.command == rr::LockCommand::release_lease) {
    result = leases_.release(id, wanted.path, now);
  } else {
    const bool takes_over = wanted.command == rr::LockCommand::take_lease;
    const auto may_take = [&](const std::string& role) { return role == "*" || client.has_role(role); };
    if (takes_over && std::none_of(config.takeover.begin(), config.takeover.end(), may_take))
      return rr::make_error(rr::ErrorCode::permission_denied,
                            "this client has none of the roles that may take a lease over (\"takeover\")");
    if (auto fits = safe_->check(canonical_lock_path(wanted.path)); !fits) {
      // Objects may have come since, of which the device tells nobody: who asks again finds that out.
      if (const auto upstream = open_upstream(client.upstream_in_use())) check_safe_values(wanted.path, upstream);
      return fits;
    }
    if (auto allowed = table_.check(id, wanted.path, false, now); !allowed) return allowed;
    if (auto allowed = table_.check_below(id, wanted.path); !allowed) return allowed;
    result = leases_.acquire(id, client.lock_user(), wanted.path, wanted.timeout, takes_over, now);
  }
  end_leases();
  const bool is_new =
      result && (wanted.command == rr::LockCommand::acquire_lease || wanted.command == rr::LockCommand::take_lease);
  if (is_new) {
    if (safe_->is_owing())
      if (const auto open = open_upstream(client.upstream_in_use()))
        safe_->pay_around(canonical_lock_path(wanted.path), open);
    table_.handle_leased(id, wanted.path, leases_.check_lock(0, wanted.path, now).error());
    const auto key = canonical_lock_path(wanted.path);
    auto& holder = holders_[key];
    holder.upstream = client.upstream_in_use();
    holder.could_command = holder.could_command || client.may_command(key);
    if (!holder.end) holder.end = client.begin_lease_end(wanted.path);
    for (auto& lease : leases_.held())
      if (lease.path == key) device_.tell_lease({service_, std::move(lease), true, {}});
  }
  settle();
  return result;
}

void ServiceLocks::end_leases() {
  while (auto ended = leases_.poll_event()) {
    const auto holder = holders_.extract(ended->lease.path);
    const auto upstream = open_upstream(holder ? holder.mapped().upstream.lock() : nullptr);
    const auto safe = std::make_shared<SafeAnswer>(device_.executor(), device_.config().name, ended->lease.path);
    const bool is_safe =
        safe_->send(ended->lease.path, upstream, SafeValues::Why::lease_ended,
                    [safe, why = ended->why, end = holder ? holder.mapped().end : nullptr](const rr::Result<>& answer) {
                      if (end && answer) end->finish(Outcome::ok, why);
                      if (end && !answer) end->finish(Outcome::error, why + "; " + answer.error().message);
                      safe->set(answer);
                    });
    const auto what = ended->why + (is_safe ? "" : "; the device is made safe when it is back");
    log(is_safe ? LogLevel::info : LogLevel::warning, "lease ended",
        {{"device", device_.config().name},
         {"path", ended->lease.path},
         {"user", ended->lease.by.name},
         {"reason", what}});
    const auto client = std::find_if(clients_.begin(), clients_.end(),
                                     [&](const auto& each) { return each.second == ended->lease.holder; });
    if (client != clients_.end()) client->first->lease_ended(ended->lease.path, what, safe);
    device_.tell_lease({service_, std::move(ended->lease), false, what});
  }
}

/// The holder's session, where it is open still; else any other with the service.
std::shared_ptr<Upstream> ServiceLocks::open_upstream(const std::shared_ptr<Upstream>& first) {
  if (first && first->may_act()) return first;
  for (const auto& [number, known] : upstreams_)
    if (auto upstream = known.lock(); upstream && upstream->may_act()) return upstream;
  return nullptr;
}

std::shared_ptr<Upstream> ServiceLocks::locked_by(const std::string& path) {
  const auto session = table_.locked_by(path);
  const auto known = session ? upstreams_.find(*session) : upstreams_.end();
  auto upstream = known == upstreams_.end() ? nullptr : known->second.lock();
  return upstream && upstream->may_act() ? upstream : nullptr;
}

void ServiceLocks::make_safe(std::string_view path, std::function<void(const rr::Result<>&)> done) {
  const auto key = canonical_lock_path(path);
  if (!device_.config().leases.is_offered || !safe_->has(key))
    return done(rr::make_error(rr::ErrorCode::not_implemented_error,
                               "the gateway knows nothing that makes " + rr::quote(key) +
                                   " safe: the configuration of device " + rr::quote(device_.config().name) +
                                   " declares no \"leases\" with \"safe\" there"));
  safe_->send(
      key, open_upstream(nullptr), SafeValues::Why::stop,
      [fits = safe_->check(key), done = std::move(done)](const rr::Result<>& answer) { done(answer ? fits : answer); });
}

void ServiceLocks::end_leases(const std::string& why) {
  leases_.handle_lost(why);
  settle();
}

void ServiceLocks::handle_opened(const std::shared_ptr<Upstream>& upstream) {
  if (!device_.config().leases.is_offered || !upstream->may_act()) return;
  upstreams_[upstream->number()] = upstream;
  const auto weak = weak_from_this();
  safe_->link({.owed =
                   [weak] {
                     if (const auto self = weak.lock()) self->pay_or_wake();
                   },
               .is_leased =
                   [weak](const std::string& path) {
                     const auto self = weak.lock();
                     return self && self->leases_.is_held(path);
                   },
               .locked_by =
                   [weak](const std::string& path) {
                     const auto self = weak.lock();
                     return self ? self->locked_by(path) : nullptr;
                   }});
  safe_->handle_opened(upstream);
}

/// What is owed is not to wait until somebody wants something of the device.
void ServiceLocks::pay_or_wake() {
  if (const auto open = open_upstream(nullptr)) return safe_->pay(open);
  for (const auto& [number, known] : upstreams_)
    if (const auto upstream = known.lock()) upstream->wake();
}

void ServiceLocks::handle_lost(const Upstream& upstream) {
  table_.handle_lost(upstream.number(), steady_now());
  safe_->handle_lost(upstream.number());
  std::vector<std::string> lost;
  for (const auto& [path, holder] : holders_)
    if (holder.upstream.lock().get() == &upstream) lost.push_back(path);
  for (const auto& path : lost) leases_.handle_lost(path, "the connection to the device was lost");
  settle();
}

void ServiceLocks::handle_closed(const Upstream& upstream) {
  safe_->handle_lost(upstream.number());
}

void ServiceLocks::handle_released(std::string_view path) {
  table_.handle_released(path, steady_now());
  settle();
}

void ServiceLocks::check_safe_values(std::string_view path, const std::shared_ptr<Upstream>& upstream) {
  if (device_.config().leases.is_offered && upstream->may_act())
    safe_->check_again(canonical_lock_path(path), upstream);
}

void ServiceLocks::settle() {
  if (is_settling_) return;  // what is told to one brings more: whoever tells goes on with that, one after the other
  const auto self = shared_from_this();
  {
    const Settling settling(is_settling_);
    while (auto event = table_.poll_event())
      std::visit([this](auto& happened) { handle(std::move(happened)); }, *event);
  }
  end_leases();
  const auto next = std::min(table_.poll_timeout(), leases_.poll_timeout());
  if (next == timeout_.expiry()) return;
  timeout_.expires_at(next);
  if (next == rr::TimePoint::max()) return;
  timeout_.async_wait([weak = weak_from_this()](const boost::system::error_code& cancelled) {
    const auto still_there = weak.lock();
    if (cancelled || !still_there) return;
    still_there->table_.handle_timeout(steady_now());
    still_there->leases_.handle_timeout(steady_now());
    still_there->settle();
  });
}

void ServiceLocks::handle(LockAsked&& asked) {
  auto answered = [weak = weak_from_this(), id = asked.id,
                   command = asked.command](const rr::Result<rr::Value>& result) {
    const auto self = weak.lock();
    if (!self) return;
    self->table_.handle_answer(id, result ? rr::Result<>() : rr::Result<>(result.error()), steady_now());
    self->settle();
    if (result && command == rr::LockCommand::unlock) self->safe_->send_again();
  };
  const auto upstream = upstreams_[asked.session].lock();
  if (!upstream) return answered(rr::make_error(rr::ErrorCode::connection_error, "the session has ended"));
  upstream->ask_for_lock(asked.command, asked.path, asked.timeout, std::move(answered));
}

void ServiceLocks::handle(LockAnswered&& answered) {
  const auto request = requests_.extract({answered.client, answered.request});
  if (request) request.mapped()(answered.result);
}

void ServiceLocks::handle(LockClientLeft&& left) {
  const auto waiting = leaving_.extract(left.client);
  if (waiting) waiting.mapped()();
}

void ServiceLocks::handle(LockSessionInDoubt&& doubtful) {
  const auto upstream = upstreams_[doubtful.session].lock();
  if (!upstream) return;
  log(LogLevel::warning, "session ended: the device does not say whether it has taken a lock back", {});
  upstream->break_off();
}

}  // namespace rrgate
