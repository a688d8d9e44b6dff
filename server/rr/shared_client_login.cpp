// Logins of a client of a shared device: by the gateway's users, or, where it has none, by the device, in a session of
// this client's own. Layer: server/rr.
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>

#include "server/rr/shared_access.hpp"
#include "server/rr/shared_client.hpp"
#include "server/rr/shared_node.hpp"

namespace rrgate {

namespace asio = boost::asio;

void SharedClient::handle(const rr::LoginRequested& login) {
  const auto service = service_ ? service_ : node_.find_service(login.attempt.service);
  if (!service)
    return session_.answer_login(login.id, rr::make_error(rr::ErrorCode::authentication_error, "Authentication Failed"),
                                 rr::read_clocks());
  const auto self = std::static_pointer_cast<SharedClient>(shared_from_this());
  if (!service->is_for_device(*login.authenticator)) {
    const auto answer = [login, weak = std::weak_ptr(self)](const Logins::Judged& result) {
      if (const auto still_there = weak.lock()) still_there->answer_login(login, result);
    };
    return node_.logins().judge(login.attempt, from_, Logins::Of::session, answer);
  }
  // A login at the device adds no right here: who has none does not even get to try.
  if (!session_.admits(rr::EntryType::object_type_name, login.attempt.service, nullptr))
    return session_.answer_login(login.id, rr::make_error(rr::ErrorCode::authentication_error, "Authentication Failed"),
                                 rr::read_clocks());
  asio::co_spawn(executor(), log_in_at_device(self, service, login), asio::detached);
}

rr::awaitable<void> SharedClient::log_in_at_device(std::shared_ptr<SharedClient> self,
                                                   std::shared_ptr<SharedService> service, rr::LoginRequested login) {
  if (self->is_closed()) co_return;
  auto& logins = self->node_.logins();
  const DeviceLogin tried{login.attempt.username, service->device()->config().name, service->name(), self->from_};
  const auto ticket = logins.begin_at_device(tried);
  if (!ticket) {
    self->session_.answer_login(login.id, ticket.error(), rr::read_clocks());
    self->settle();
    co_return;
  }
  const bool is_late = !service->upstream()->requires_user() && self->service_;
  const auto upstream = service->make_own_upstream({login.attempt.username, login.attempt.credentials, is_late});
  const auto opened = co_await upstream->open();
  logins.finish_at_device(tried, opened);
  auto& client = *self;
  if (client.is_closed()) {
    upstream->close();
    co_return;
  }
  if (!opened) {
    client.session_.answer_login(login.id, opened.error(), rr::read_clocks());
    client.settle();
    co_return;
  }
  if (client.login_) client.leave_login();
  if (client.is_closed()) {  // it could not be told
    upstream->close();
    co_return;
  }
  client.login_ = upstream;
  if (client.service_) client.move_to(upstream);
  upstream->keep_open();
  client.session_.answer_login(login.id, rr::AuthenticatedUser{login.attempt.username}, rr::read_clocks());
  client.settle();
}

void SharedClient::move_to(std::shared_ptr<Upstream> upstream) {
  home_->end_sent_pipes(*this);
  if (!service_) return;  // it has gone
  home_->remove(*this);
  home_ = std::move(upstream);
  home_->add(*this);
  // What is sent meanwhile may end the client.
  for (const auto& [key, member] : std::map(wires_))
    if (service_) home_->join_wire(*this, key.first, *member);
  for (const auto& [id, pipe] : std::unordered_map(pipes_))
    if (service_) home_->join_pipe(*this, id, pipe.path, *pipe.member);
}

void SharedClient::leave_login() {
  const auto left = std::exchange(login_, nullptr);
  if (service_) move_to(service_->upstream());
  left->close();
}

void SharedClient::handle(const rr::UserChanged&) {
  // Nobody's now, or a user's whom the gateway has judged: not the device's any more.
  if (login_ && lock_user().kind != Subject::Kind::device_user) return leave_login();
  if (service_) home_->change_user(*this);
}

void SharedClient::answer_login(const rr::LoginRequested& login, rr::Result<rr::AuthenticatedUser> result) {
  if (is_closed()) return;  // its node may be gone, too
  const auto service = result ? node_.find_service(login.attempt.service) : nullptr;
  if (service && (service->upstream()->is_resting() || !service->upstream()->has_tried())) {
    const auto self = std::static_pointer_cast<SharedClient>(shared_from_this());
    asio::co_spawn(executor(), answer_when_open(self, service->upstream(), login.id, std::move(*result)),
                   asio::detached);
    return;
  }
  session_.answer_login(login.id, std::move(result), rr::read_clocks());
  settle();
}

/// Before it had logged in, the client could wake nothing.
rr::awaitable<void> SharedClient::answer_when_open(std::shared_ptr<SharedClient> self,
                                                   std::shared_ptr<Upstream> upstream, rr::LoginId login,
                                                   rr::AuthenticatedUser user) {
  (void)co_await upstream->opened();  // where the device is away, the client hears so later, as others do
  self->session_.answer_login(login, std::move(user), rr::read_clocks());
  self->settle();
}

}  // namespace rrgate
