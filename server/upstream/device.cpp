#include "server/upstream/device.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/session/connection.hpp"
#include "core/support/random.hpp"
#include "core/support/utf8.hpp"
#include "node/driver/post_cancel.hpp"
#include "node/transport/race.hpp"
#include "server/log/log.hpp"
#include "server/upstream/service_locks.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr const char* circle = "its URL leads back to this gateway";

struct Reached {
  rr::ConnectionUrl url;
  ProbeResult answer;
};

rr::awaitable<rr::Result<Reached>> probe_at(rr::ConnectionUrl url, ProbeOptions options) {
  auto answer = co_await probe(url, std::move(options));
  if (!answer) co_return answer.error();
  Reached reached{std::move(url), std::move(*answer)};
  co_return reached;
}

rr::awaitable<rr::Result<Reached>> probe_any(std::vector<rr::ConnectionUrl> urls, ProbeOptions options) {
  std::vector<rr::Runner<Reached>> runners;
  for (auto& url : urls) {
    rr::Runner<Reached> runner;
    runner.name = rr::format_url(url);
    runner.run = [url = std::move(url), options] { return probe_at(url, options); };
    runners.push_back(std::move(runner));
  }
  const auto nothing = rr::make_error(rr::ErrorCode::connection_error, "no URL");
  co_return co_await rr::race(std::move(runners), rr::candidate_stagger, nothing);
}

/// Many gateways, or many devices of one, must not look in step: 75 to 125 percent.
milliseconds around(milliseconds wait) {
  return rr::random_between(wait * 3 / 4, wait * 5 / 4);
}

/// What a reload may change of a device that goes on.
void take_changeable(DeviceConfig& to, const DeviceConfig& from) {
  to.max_clients = from.max_clients;
  to.callbacks = from.callbacks;
  to.shares_reads = from.shares_reads;
}

}  // namespace

std::string_view to_string(DeviceState state) {
  switch (state) {
    case DeviceState::connecting:
      return "connecting";
    case DeviceState::online:
      return "online";
    case DeviceState::offline:
      return "offline";
  }
  return "unknown";
}

std::string quotable(std::string_view message) {
  constexpr std::size_t longest = 400;
  if (message.size() <= longest) return std::string(message);
  return std::string(rr::utf8_prefix(message, longest)) + "...";
}

Device::Device(const asio::any_io_executor& executor, DeviceConfig config, const Config& whole,
               std::shared_ptr<TlsFiles> tls, std::shared_ptr<PageLink> page)
    : config_(std::move(config)),
      dial_options_{whole.timeouts.connect, whole.timeouts.send_stall, config_.proxy, config_.headers},
      tls_(tls ? std::move(tls) : make_device_tls(config_)),
      https_(make_device_https(config_)),
      retry_(whole.retry),
      request_timeout_(whole.timeouts.request),
      backoff_(retry_.min, retry_.max),
      look_id_(rr::random_node_id()),
      wake_(executor) {
  if (page) dial_options_.reach = [page = std::move(page)] { return PageLink::dial(page); };
}

rr::DialOptions Device::dial_options(std::string_view way) const {
  auto options = dial_options_;
  const auto own = rr::format_node_id(look_id_, rr::NodeIdFormat::dashes);
  options.headers.emplace_back(way_header, way.empty() ? own : std::string(way) + ", " + own);
  if (tls_) options.tls = tls_->context();
  if (https_) options.web_tls = https_->context();
  return options;
}

rr::Result<> Device::load_tls() {
  for (const auto& files : {tls_, https_}) {
    if (!files) continue;
    const auto loaded = files->load();
    if (loaded) continue;
    const auto error = loaded.error();
    return rr::make_error(error.code, "device " + rr::quote(config_.name) + ": " + error.message);
  }
  return {};
}

void Device::reload_tls(bool is_forced) {
  for (const auto& files : {tls_, https_})
    if (files && (is_forced || files->has_changed()) && files->reload()) look_again();
}

template <class T>
rr::awaitable<rr::Result<T>> Device::until_stopped(rr::awaitable<rr::Result<T>> work) {
  const auto keep = shared_from_this();
  const auto given_up = rr::make_error(rr::ErrorCode::operation_aborted, "given up: the device is not wanted any more");
  if (is_stopping_) co_return given_up;
  const auto executor = co_await asio::this_coro::executor;
  const auto signal = *dialing_.insert(std::make_shared<asio::cancellation_signal>()).first;
  auto token = asio::bind_cancellation_slot(signal->slot(), asio::as_tuple(asio::use_awaitable));
  auto [failure, result] = co_await asio::co_spawn(executor, std::move(work), std::move(token));
  dialing_.erase(signal);
  if (is_stopping_) co_return given_up;
  if (failure) std::rethrow_exception(failure);
  co_return std::move(result);
}

bool Device::is_on_way(std::string_view way) const {
  return way.find(rr::format_node_id(look_id_, rr::NodeIdFormat::dashes)) != std::string_view::npos;
}

void Device::note_circle() {
  has_come_back_ = true;
  is_circle_ = state_ != DeviceState::online;  // one of several URLs may lead elsewhere
}

rr::awaitable<rr::Result<std::unique_ptr<rr::ByteStream>>> Device::connect(std::string way) {
  if (is_circle_) co_return rr::make_error(rr::ErrorCode::connection_error, circle);
  auto dialed = rr::dial_any(urls_to_try(), dial_options(way));
  auto stream = co_await until_stopped(std::move(dialed));
  // News either way: it was thought online and can't be reached, or it is back before the next look was due.
  const bool was_online = state_ == DeviceState::online;
  if (stream ? !was_online : was_online && sessions_ == 0) look_again();
  co_return stream;
}

void Device::share(const std::string& service, std::weak_ptr<Upstream> by) {
  std::erase_if(shared_, [](const auto& known) { return known.second.expired(); });  // devices choose the names
  shared_[service] = std::move(by);
}

rr::Result<std::shared_ptr<Upstream>> Device::find_shared(const std::string& service) const {
  const auto found = shared_.find(service);
  if (found != shared_.end())
    if (auto upstream = found->second.lock()) return upstream;
  if (identity_)
    return rr::make_error(rr::ErrorCode::service_not_found,
                          "device " + rr::quote(config_.name) + " has no service " + rr::quote(service));
  return away_error();
}

std::shared_ptr<ServiceLocks> Device::locks_of(const std::string& service) {
  std::erase_if(locks_, [](const auto& known) { return known.second.expired(); });  // clients choose the names
  auto& known = locks_[service];
  auto locks = known.lock();
  if (!locks) known = locks = std::make_shared<ServiceLocks>(*this, service);
  std::erase_if(owing_, [](const auto& each) { return !each->is_owing(); });
  return locks;
}

std::map<std::string, std::shared_ptr<ServiceLocks>> Device::locks() const {
  std::map<std::string, std::shared_ptr<ServiceLocks>> out;
  for (const auto& [service, known] : locks_)
    if (auto locks = known.lock()) out[service] = std::move(locks);
  return out;
}

bool Device::can_become(const DeviceConfig& config) const {
  auto changed = config_;
  take_changeable(changed, config);
  return changed == config;
}

void Device::become(const DeviceConfig& config, const Config& whole) {
  take_changeable(config_, config);
  dial_options_.timeout = whole.timeouts.connect;
  dial_options_.send_stall = whole.timeouts.send_stall;
  request_timeout_ = whole.timeouts.request;
  if (retry_ == whole.retry) return;
  retry_ = whole.retry;
  backoff_ = rr::Backoff(retry_.min, retry_.max);
  if (waits_for_end_) return;
  // The wait that is under way is not longer than those that follow.
  const auto wait = state_ == DeviceState::online ? around(retry_.online) : backoff_.next();
  wake_.expires_at(std::min(wake_.expiry(), std::chrono::steady_clock::now() + wait));
}

std::optional<Device::Seat> Device::take_seat() {
  if (is_full()) return std::nullopt;
  ++traffic_.sessions;
  return Seat(*this);
}

std::shared_ptr<const void> Device::begin_session() {
  ++sessions_;
  return {this, [self = shared_from_this()](const void*) {
            // Not at once: a small device needs a moment until it has room again.
            if (--self->sessions_ == 0 && self->waits_for_end_) self->wake_.expires_after(self->retry_.min);
          }};
}

std::shared_ptr<const void> Device::begin_closing() {
  ++closing_;
  return {this, [self = shared_from_this()](const void*) { --self->closing_; }};
}

std::string Device::full_text() const {
  return "device " + rr::quote(config_.name) + " has all the clients it may have (" + std::to_string(clients_) + ")";
}

std::string Device::offline_text(const rr::Error& error) const {
  return "device " + rr::quote(config_.name) + " is offline: " + quotable(error.message);
}

rr::Error Device::away_error() const {
  const auto error =
      rr::make_error(rr::ErrorCode::connection_error, last_error_.empty() ? "it has not answered yet" : last_error_);
  return rr::make_error(error.code, offline_text(error));
}

void Device::start() {
  const auto keep_watching = [](std::shared_ptr<Device> self) -> rr::awaitable<void> { co_await self->watch(); };
  asio::co_spawn(executor(), keep_watching(shared_from_this()), asio::detached);
}

rr::awaitable<void> Device::watch() {
  while (!is_stopping_) {
    co_await wait_for_turn();
    if (is_stopping_) break;
    looks_again_ = false;
    has_come_back_ = false;
    auto probed = probe_any(urls_to_try(), {look_id_, dial_options(), definitions_});
    auto reached = co_await until_stopped(std::move(probed));
    if (is_stopping_) break;
    rr::Result<ProbeResult> result = rr::Error{};
    if (reached) {
      config_.url = std::move(reached->url);
      result = std::move(reached->answer);
    } else {
      result = reached.error();
    }
    is_circle_ = has_come_back_ && !result;
    if (is_circle_) result = rr::make_error(rr::ErrorCode::connection_error, circle);
    // It has no room for another connection: the session that is open tells when it has gone. One that can't prove any
    // more who it is has room, and is not believed.
    waits_for_end_ =
        !result && result.error().code != rr::ErrorCode::authentication_error && sessions_ > 0 && identity_;
    if (waits_for_end_) result = *identity_;
    note(result);
    if (result) backoff_.reset();
    const auto looked = std::chrono::steady_clock::now();
    if (waits_for_end_)
      wake_.expires_at(asio::steady_timer::time_point::max());
    else
      wake_.expires_at(looked + (result ? around(retry_.online) : backoff_.next()));
    while (!is_stopping_) {
      // Looking again on demand keeps the shortest wait too, or a crowd of clients would make this loop spin.
      if (looks_again_) wake_.expires_at(std::min(wake_.expiry(), looked + retry_.min));
      if (std::chrono::steady_clock::now() >= wake_.expiry()) break;
      co_await wake_.async_wait(asio::as_tuple(asio::use_awaitable));
    }
  }
}

rr::awaitable<void> Device::wait_for_turn() {
  if (!pace_ || looks_again_) co_return;
  const auto look = state_ == DeviceState::connecting ? LookPace::Look::first : LookPace::Look::later;
  const auto turn = pace_->take_turn(look, std::chrono::steady_clock::now());
  while (!is_stopping_ && !looks_again_ && std::chrono::steady_clock::now() < turn) {
    wake_.expires_at(turn);  // the end of a session may have set it
    co_await wake_.async_wait(asio::as_tuple(asio::use_awaitable));
  }
}

std::vector<rr::ConnectionUrl> Device::urls_to_try() const {
  std::vector<rr::ConnectionUrl> out{config_.url};
  std::copy_if(urls_.begin(), urls_.end(), std::back_inserter(out),
               [&](const auto& url) { return url != config_.url; });
  return out;
}

void Device::set_urls(std::vector<rr::ConnectionUrl> urls) {
  if (urls == urls_ || urls.empty()) return;
  urls_ = std::move(urls);
  if (std::find(urls_.begin(), urls_.end(), config_.url) == urls_.end()) config_.url = urls_.front();
  look_again();
}

void Device::look_again() {
  looks_again_ = true;
  wake_.cancel();
}

void Device::stop() {
  is_stopping_ = true;
  for (const auto& each : dialing_) rr::post_cancel(executor(), each);
  wake_.cancel();
}

void Device::note(const rr::Result<ProbeResult>& result) {
  const auto before = state_;
  const auto known = identity_;
  note_answer(result, before);
  if (on_change_ && (state_ != before || identity_ != known)) on_change_();
}

void Device::note_answer(const rr::Result<ProbeResult>& result, DeviceState before) {
  if (result) {
    if (state_ != DeviceState::online || identity_ != *result)
      log(LogLevel::info, "device online",
          {{"device", config_.name},
           {"node_id", rr::format_node_id(result->node_id, rr::NodeIdFormat::dashes)},
           {"node_name", result->node_name}});
    state_ = DeviceState::online;
    identity_ = *result;
    last_error_.clear();
    if (before != state_)
      for (const auto& [service, known] : shared_)
        if (const auto upstream = known.lock()) upstream->retry_now();
    return;
  }
  state_ = DeviceState::offline;
  if (before != state_ || last_error_ != result.error().message)
    log(LogLevel::warning, "device offline", {{"device", config_.name}, {"error", result.error().message}});
  last_error_ = result.error().message;
}

}  // namespace rrgate
