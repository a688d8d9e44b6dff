#include "server/upstream/service_locks.hpp"

#include "server/log/log.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

namespace {

rr::TimePoint steady_now() {
  return std::chrono::steady_clock::now();
}

}  // namespace

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
  std::erase_if(requests_, [id](const auto& request) { return request.first.first == id; });
  if (left) leaving_[id] = std::move(left);
  table_.remove(id, steady_now());
  settle();
}

void ServiceLocks::handle_wanted(const UpstreamClient& client, const rr::LockWanted& wanted,
                                 std::function<void(const rr::Result<>&)> done) {
  const auto known = clients_.find(&client);
  if (known == clients_.end()) return;
  requests_[{known->second, wanted.id}] = std::move(done);
  table_.handle_wanted(known->second, wanted, steady_now());
  settle();
}

rr::Result<> ServiceLocks::check(const UpstreamClient& client, std::string_view path, bool is_exempt) {
  if (table_.is_empty()) return {};
  const auto known = clients_.find(&client);
  auto allowed = table_.check(known == clients_.end() ? 0 : known->second, path, is_exempt, steady_now());
  settle();
  return allowed;
}

void ServiceLocks::handle_lost(const Upstream& upstream) {
  table_.handle_lost(upstream.number(), steady_now());
  settle();
}

void ServiceLocks::handle_released(std::string_view path) {
  table_.handle_released(path, steady_now());
  settle();
}

void ServiceLocks::settle() {
  const auto self = shared_from_this();
  while (auto event = table_.poll_event()) std::visit([this](auto& happened) { handle(std::move(happened)); }, *event);
  const auto next = table_.poll_timeout();
  if (next == timeout_.expiry()) return;
  timeout_.expires_at(next);
  if (next == rr::TimePoint::max()) return;
  timeout_.async_wait([weak = weak_from_this()](const boost::system::error_code& cancelled) {
    const auto still_there = weak.lock();
    if (cancelled || !still_there) return;
    still_there->table_.handle_timeout(steady_now());
    still_there->settle();
  });
}

void ServiceLocks::handle(LockAsked&& asked) {
  auto answered = [weak = weak_from_this(), id = asked.id](const rr::Result<rr::Value>& result) {
    const auto self = weak.lock();
    if (!self) return;
    self->table_.handle_answer(id, result ? rr::Result<>() : rr::Result<>(result.error()), steady_now());
    self->settle();
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
