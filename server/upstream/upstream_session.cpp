// How a session with a service of a device is opened, kept open, rested and lost. Layer: server/upstream.
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "node/client/async_object.hpp"
#include "node/driver/backoff.hpp"
#include "server/log/log.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr auto wait_token = asio::as_tuple(asio::use_awaitable);

/// So many first waits long a session has to live for the next one to be attempted as soon as after a first failure.
constexpr int lasting = 10;
/// What the device may take to be made safe by a session that ends.
constexpr std::chrono::milliseconds longest_farewell{1000};

using ConnectionPtr = std::shared_ptr<rr::ClientConnection>;

rr::awaitable<ConnectionPtr> begin_session(std::unique_ptr<rr::ByteStream> stream, rr::ClientOptions options) {
  const auto executor = stream->executor();
  constexpr asio::use_awaitable_t<> token;
  return asio::async_initiate<const asio::use_awaitable_t<>, void(std::exception_ptr, ConnectionPtr)>(
      [executor, stream = std::move(stream), options = std::move(options)](auto handler) mutable {
        const rr::detail::CompleteOnce<ConnectionPtr, decltype(handler)> complete(std::move(handler), executor);
        rr::ClientConnection::open(std::move(stream), std::move(options), complete);
      },
      token);
}

/// Clients know their own logins, not the one that the gateway has for all of them.
rr::Error with_whose_login(rr::Error error) {
  if (error.code == rr::ErrorCode::authentication_error)
    error.message = "the device refuses the gateway's login: " + error.message;
  return error;
}

}  // namespace

rr::awaitable<rr::Result<>> Upstream::open() {
  const auto self = shared_from_this();
  const bool has_login = !login_.username.empty();
  // One login is for all services of a device, which may want it while they are connected to, later, or not at all:
  // that is found out without it.
  const bool is_for_all = has_login && use_ == UpstreamUse::all_clients;
  // Named: g++ 12 destroys twice what is made for a coroutine within the co_await expression.
  const std::string nobody;
  const std::string user = login_.username;
  const auto& first = is_for_all || login_.is_late ? nobody : user;
  auto opened = co_await open_connection(first, false);
  const bool wants_user = !opened && opened.error().code == rr::ErrorCode::authentication_error;
  // Whoever has no login may look at the service, and so may his clients; what they do is for the device to refuse.
  requires_user_ = wants_user && !has_login;
  if (requires_user_) opened = co_await open_connection(nobody, true);
  if (wants_user && is_for_all) opened = co_await open_connection(user, false);
  if (!opened) co_return is_for_all ? with_whose_login(opened.error()) : opened.error();
  if (login_.is_late || (is_for_all && !wants_user)) {
    const auto done = co_await log_in(*opened);
    const bool knows_no_users = !done && done.error().code == rr::ErrorCode::invalid_operation;
    if (!done && !(is_for_all && knows_no_users)) {
      (*opened)->disconnect();
      co_return is_for_all ? with_whose_login(done.error()) : done.error();
    }
  }
  if (is_closed_) {
    (*opened)->disconnect();
    co_return rr::make_error(rr::ErrorCode::connection_error, "the session is not wanted any more");
  }
  connection_ = std::move(*opened);
  connection_->on_closed(
      [weak = weak_from_this(), which = connection_.get(), in_use = device_->begin_session()](const rr::Error& reason) {
        const auto still_there = weak.lock();
        if (still_there && still_there->connection_.get() == which) still_there->lost(reason);
      });
  connection_->on_path_released([weak = weak_from_this()](const std::string& path) {
    if (const auto still_there = weak.lock()) still_there->handle_released(path);
  });
  loss_.reset();
  take_over_definitions(connection_->session().types());
  if (const auto* root = object_type(service_)) watch_object(service_, *root);
  look_up_again();
  locks_->handle_opened(self);
  co_return rr::Result<>();
}

rr::awaitable<rr::Result<std::shared_ptr<rr::ClientConnection>>> Upstream::open_connection(std::string username,
                                                                                           bool is_stepwise) {
  auto stream = co_await device_->connect();
  if (!stream) co_return rr::make_error(rr::ErrorCode::connection_error, device_->offline_text(stream.error()));
  const auto& url = device_->config().url;
  rr::ClientOptions options;
  options.service = service_;
  options.read_definitions = device_->definitions();
  options.request_timeout = device_->request_timeout();
  options.connection.self.name = gateway_node_name;
  options.connection.target = {url.node_id.value_or(rr::NodeId{}), url.node_name};
  if (is_stepwise) options.connection.features.combined_v2 = options.connection.features.combined_v4 = false;
  if (!username.empty()) {
    options.username = std::move(username);
    options.credentials = rr::Value(login_.credentials);
  }
  try {
    co_return co_await begin_session(std::move(*stream), std::move(options));
  } catch (const rr::Exception& exception) {
    co_return exception.error();
  }
}

/// Errors   also invalid_operation: the service knows no users.
rr::awaitable<rr::Result<>> Upstream::log_in(std::shared_ptr<rr::ClientConnection> connection) {
  const rr::AsyncObject root(connection, service_);
  const rr::Value credentials(login_.credentials);
  try {
    co_await root.authenticate(login_.username, credentials);
  } catch (const rr::Exception& exception) {
    co_return exception.error();
  }
  co_return rr::Result<>();
}

void Upstream::close(std::function<void()> closed) {
  is_closed_ = true;
  wake_.cancel();
  attempted_.cancel();
  const auto connection = std::exchange(connection_, nullptr);
  const auto reason = lost_error();
  std::vector<MemberKey> unanswered;  // wires whose clients wait for an answer, which does not come any more
  for (const auto& [key, wire] : wires_)
    if (wire->state != AttachState::attached) unanswered.push_back(key);
  for (const auto& key : unanswered) drop_wire(key, &reason);
  if (!connection) {
    if (closed) closed();
    return;
  }
  connection->on_closed([until_known = device_->begin_closing(), closed = std::move(closed)](const rr::Error&) {
    if (closed) closed();
  });
  disconnect_when_safe(connection);
  locks_->handle_closed(*this);
  tell_lost(lost_error());
}

/// A device may drop with a session what it has not done yet: what makes it safe is answered first.
void Upstream::disconnect_when_safe(const std::shared_ptr<rr::ClientConnection>& connection) {
  if (unanswered_->count == 0) return connection->disconnect();
  const auto wait = std::make_shared<asio::steady_timer>(device_->executor(), longest_farewell);
  wait->async_wait([connection, wait, unanswered = unanswered_](const rr::error_code&) {
    unanswered->on_none = nullptr;
    connection->disconnect();
  });
  unanswered_->on_none = [wait] { wait->cancel(); };
}

void Upstream::keep_open(std::function<rr::Result<>()> is_used) {
  asio::co_spawn(device_->executor(), run(shared_from_this(), std::move(is_used)), asio::detached);
}

rr::awaitable<void> Upstream::run(std::shared_ptr<Upstream> self, std::function<rr::Result<>()> is_used) {
  const std::string device = self->device_->config().name;
  auto retry = self->device_->retry();
  rr::Backoff backoff(retry.min, retry.max);
  while (!self->is_closed_) {
    rr::Result<> done;
    self->stage_ = Stage::attempting;
    if (!self->is_open()) done = co_await self->open();
    if (done && is_used && !self->is_closed_) done = is_used();
    self->stage_ = Stage::waiting;
    self->is_waking_ = false;
    self->last_attempt_ = done;
    ++self->attempts_;
    self->attempted_.cancel();
    if (self->is_closed_) break;
    if (done) {
      log(LogLevel::info, "session open", {{"device", device}, {"service", self->service_}});
      const auto opened_at = std::chrono::steady_clock::now();
      self->stage_ = Stage::watched;
      const bool may_rest = co_await self->watch_use();
      self->stage_ = Stage::waiting;
      // A device that accepts and drops at once is as good as away.
      if (std::chrono::steady_clock::now() - opened_at >= lasting * retry.min) backoff.reset();
      if (may_rest) {
        log(LogLevel::info, "session rests", {{"device", device}, {"service", self->service_}});
        co_await self->rest();
        continue;
      }
      if (self->is_closed_) break;
      log(LogLevel::info, "session lost",
          {{"device", device}, {"service", self->service_}, {"clients", self->clients_.size()}});
    } else {
      self->break_off();
      self->tell_lost(self->lost_error(done.error()));  // who came while it was being opened has not heard of it
      const auto level = self->use_ == UpstreamUse::all_clients ? LogLevel::warning : LogLevel::debug;
      log(level, "session can't be opened",
          {{"device", device}, {"service", self->service_}, {"error", done.error().message}});
    }
    if (retry != self->device_->retry()) {
      retry = self->device_->retry();
      backoff = rr::Backoff(retry.min, retry.max);
    }
    self->wake_.expires_after(backoff.next());
    co_await self->wake_.async_wait(wait_token);
  }
}

rr::awaitable<bool> Upstream::watch_use() {
  while (is_open() && !is_closed_) {
    const bool may_rest = !is_held_ && clients_.empty() && rests_after_ > rests_after_.zero();
    // Where leases are offered, what makes the device safe is still being checked.
    if (may_rest && !is_wanted_ && !device_->config().leases.is_offered) co_return true;
    wake_.expires_at(may_rest ? std::chrono::steady_clock::now() + rests_after_
                              : asio::steady_timer::time_point::max());
    const auto [cancelled] = co_await wake_.async_wait(wait_token);
    if (may_rest && !cancelled && clients_.empty() && is_open() && !locks_->is_owing()) co_return true;
  }
  co_return false;
}

rr::awaitable<void> Upstream::rest() {
  disconnect_when_safe(std::exchange(connection_, nullptr));
  stage_ = Stage::resting;
  wake_.expires_at(asio::steady_timer::time_point::max());
  while (stage_ == Stage::resting && !is_closed_) co_await wake_.async_wait(wait_token);
  stage_ = Stage::waiting;
}

void Upstream::wake() {
  is_wanted_ = true;
  if (stage_ == Stage::watched) wake_.cancel();  // it does not rest just when the client comes
  if (stage_ != Stage::resting) return;
  stage_ = Stage::waiting;
  is_waking_ = true;
  wake_.cancel();
}

void Upstream::hold(bool is_held) {
  is_held_ = is_held;
  if (is_held) wake();
  if (stage_ == Stage::watched) wake_.cancel();
}

void Upstream::retry_now() {
  if (!is_open() && stage_ == Stage::waiting) wake_.cancel();
}

rr::awaitable<rr::Result<>> Upstream::opened() {
  const auto self = shared_from_this();
  if (is_open() && !is_attempting()) co_return rr::Result<>();
  const auto before = attempts_;
  wake();
  wake_.cancel();
  while (attempts_ == before && !is_closed_) co_await attempted_.async_wait(wait_token);
  if (connection_) co_return rr::Result<>();
  co_return last_attempt_ ? lost_error() : last_attempt_.error();  // else it was lost before this one's turn
}

void Upstream::break_off() {
  if (const auto connection = connection_) connection->disconnect();
}

rr::Error Upstream::lost_error() const {
  return lost_error(loss_);
}

rr::Error Upstream::lost_error(const std::optional<rr::Error>& reason) const {
  return rr::make_error(rr::ErrorCode::connection_error,
                        "connection_lost: device " + rr::quote(device_->config().name) +
                            (reason ? ": " + quotable(reason->message) : std::string(" is not connected")));
}

std::optional<rr::Error> Upstream::failure() const {
  if (is_open() || last_attempt_) return std::nullopt;
  const auto& error = last_attempt_.error();
  if (error.code == rr::ErrorCode::service_not_found) return std::nullopt;
  return rr::make_error(rr::ErrorCode::connection_error,
                        "the gateway has no session with service " + rr::quote(service_) + " of device " +
                            rr::quote(device_->config().name) + ": " + quotable(error.message));
}

bool Upstream::is_lost() const {
  return !connection_ || connection_->session().state() == rr::ClientState::closed;
}

void Upstream::lost(const rr::Error& reason) {
  connection_.reset();
  loss_ = reason;
  generators_.clear();
  for (const auto& [key, wire] : wires_) {
    wire->state = AttachState::detached;
    wire->newest.reset();  // no value of before is one of now
    wire->outgoing.reset();
    for (auto& follower : wire->followers) follower.count = wire->count;
  }
  for (auto& [number, pipe] : pipes_) {
    pipe.state = AttachState::detached;
    pipe.is_held = false;
  }
  for_each_client([&](UpstreamClient& client) { end_sent_pipes(client); });
  locks_->handle_lost(*this);
  device_->note_trouble();
  tell_lost(lost_error());
  // Else an attempt is over that has failed, or the next one waits for its time.
  if (stage_ == Stage::watched) wake_.cancel();
}

void Upstream::tell_lost(const rr::Error& reason) {
  const auto self = shared_from_this();
  for_each_client([&](UpstreamClient& client) { client.connection_lost(reason); });
}

}  // namespace rrgate
