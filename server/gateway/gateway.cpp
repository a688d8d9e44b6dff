#include "server/gateway/gateway.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/session/service/service_index.hpp"
#include "node/transport/accept_all.hpp"
#include "node/transport/socket_stream.hpp"
#include "server/access/replay_name.hpp"
#include "server/config/access_options.hpp"
#include "server/front/front_door.hpp"
#include "server/gateway/routes.hpp"
#include "server/log/log.hpp"
#include "server/recordings/recordings.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// After connections were told to end: close frames leave, answers come, sockets close.
constexpr std::chrono::milliseconds last_wait{2000};
/// How often it is looked whether the devices have heard the last.
constexpr std::chrono::milliseconds closing_look_period{10};

/// How often the files of certificates, CAs, users and rights are looked at.
constexpr std::chrono::milliseconds files_watch_period{500};

/// What only changes when the clock is set.
std::chrono::nanoseconds ahead_of_steady_clock() {
  return std::chrono::system_clock::now().time_since_epoch() - std::chrono::steady_clock::now().time_since_epoch();
}

}  // namespace

Gateway::Gateway(asio::io_context& io, Config config)
    : GatewayState(io, std::move(config)),
      io_(io),
      clock_ahead_(ahead_of_steady_clock()),
      files_watch_(io),
      drained_(io) {
  router_ = make_routes(*this);
}

Gateway::~Gateway() = default;

/// "::" leaves IPv4 to the other addresses of its port: both would be in each other's way.
std::vector<Gateway::Place> Gateway::places_of(const std::vector<rr::HostPort>& listen) {
  std::vector<Place> out;
  for (const auto& address : listen) {
    const auto has_its_port = [&](const rr::HostPort& other) { return other.port == address.port; };
    rr::error_code is_name;
    const auto literal = asio::ip::make_address(address.host, is_name);
    const bool is_all_of_ipv6 = !is_name && literal.is_v6() && literal.is_unspecified();
    out.push_back({address, is_all_of_ipv6 && std::count_if(listen.begin(), listen.end(), has_its_port) == 1});
  }
  return out;
}

rr::Result<Gateway::Listener> Gateway::open(const Place& place, std::vector<rr::HostPort>& bound) {
  Listener out{place, std::make_unique<rr::TcpListener>(io_.get_executor())};
  const auto opened = out.socket->open(place.address, place.takes_both);
  if (!opened) return opened.error();
  bound.insert(bound.end(), opened->begin(), opened->end());
  return out;
}

void Gateway::serve(Listener listener) {
  listener.socket->start([this](asio::ip::tcp::socket socket) { accept(std::move(socket)); },
                         [this](const std::string& problem) { note_unaccepted(problem); });
  listeners_.push_back(std::move(listener));
}

rr::Result<> Gateway::adopt(int socket, std::vector<rr::HostPort>& bound) {
  const auto acceptor = std::make_shared<Acceptor>(io_);
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  int listens = 0;
  socklen_t flag_size = sizeof(listens);
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
      (address.ss_family != AF_INET && address.ss_family != AF_INET6) ||
      ::getsockopt(socket, SOL_SOCKET, SO_ACCEPTCONN, &listens, &flag_size) != 0 || listens == 0)
    return rr::make_error(rr::ErrorCode::connection_error,
                          "socket " + std::to_string(socket) + " was handed over: expected a TCP socket that listens");
  rr::error_code error;
  acceptor->assign(address.ss_family == AF_INET ? asio::ip::tcp::v4() : asio::ip::tcp::v6(), socket, error);
  if (error) return rr::make_error(rr::ErrorCode::connection_error, "socket that was handed over: " + error.message());
  const auto local = acceptor->local_endpoint(error);
  bound.push_back({local.address().to_string(), local.port()});
  adopted_.push_back(acceptor);
  return {};
}

rr::Result<std::vector<rr::HostPort>> Gateway::start(const std::vector<int>& sockets) {
  if (auto loaded = access_.load(); !loaded) return loaded.error();
  if (web_tls_)
    if (auto loaded = web_tls_->load(); !loaded) return loaded.error();
  if (auto loaded = devices_.load_tls(); !loaded) return loaded.error();
  if (config_.discover.is_enabled) {
    auto tls = FoundDevices::load_tls(config_.discover);
    if (!tls) return tls.error();
    found_ = std::make_unique<FoundDevices>(io_, config_, devices_, std::move(*tls));
  }
  std::vector<rr::HostPort> bound;
  for (const int socket : sockets)
    if (auto adopted = adopt(socket, bound); !adopted) return adopted.error();
  std::vector<Listener> opened;
  if (adopted_.empty())
    for (const auto& place : places_of(config_.listen)) {
      auto listener = open(place, bound);
      if (!listener) return listener.error();
      opened.push_back(std::move(*listener));
    }
  if (const auto problem = exposure(bound, config_); !problem.empty() && !config_.insecure)
    return rr::make_error(rr::ErrorCode::invalid_configuration, problem);
  for (auto& listener : opened) serve(std::move(listener));
  for (const auto& acceptor : adopted_) {
    auto accepting = rr::accept_all(
        acceptor, [this](asio::ip::tcp::socket socket) { accept(std::move(socket)); },
        [this](const std::string& problem) { note_unaccepted(problem); });
    asio::co_spawn(io_, std::move(accepting), asio::detached);
  }
  devices_.start();
  tell_of_nodes();
  devices_.on_change([this] { note_devices(); });
  note_devices();
  own_service_ = std::make_unique<GatewayService>(io_, *this);
  own_service_->start();
  shared_.add_own(own_service_->device(), std::string(GatewayService::name));
  if (found_) found_->start();
  issuer_keys_.start();
  recordings_->follow_config();
  asio::co_spawn(io_, watch_files(), asio::detached);
  return bound;
}

/// The service index leads to all devices: to a shared one by the node that stands for it, to others through the relay.
/// Not to those that play recordings: who looks for services of a type wants what is there now.
void Gateway::tell_of_nodes() {
  auto& directory = shared_.node().directory();
  const auto index_url = [](std::string_view base_url, const rr::NodeIdentity& node) {
    return std::string(base_url) + "?nodeid=" + rr::format_node_id(node.id, rr::NodeIdFormat::dashes) +
           "&service=" + std::string(rr::service_index_name);
  };
  const auto routed = [this, index_url](std::string_view base_url) {
    std::vector<rr::KnownNode> out;
    for (const auto& device : devices_.all()) {
      if (is_replay(device->config().name)) continue;
      auto* shared = shared_.find(*device);
      const auto& identity = device->identity();
      if (!shared && !identity) continue;
      const auto node = shared ? shared->node().identity() : rr::NodeIdentity{identity->node_id, identity->node_name};
      out.push_back({node, {}, device->config().name});
      if (!base_url.empty()) out.back().index_urls.push_back(index_url(base_url, node));
    }
    return out;
  };
  directory.set_routed_nodes(routed);
  directory.set_detected_nodes([this, routed](std::string_view base_url) {
    auto out = routed(base_url);
    if (!found()) return out;
    for (const auto& entry : found()->list()) {
      if (entry.device) continue;
      rr::KnownNode node{{entry.node.node_id, entry.node.node_name}, {}, {}};
      for (const auto& each : entry.node.urls) node.index_urls.push_back(each.url);
      out.push_back(std::move(node));
    }
    return out;
  });
}

/// Says if somebody sets the clock of the machine: logins, tickets and the audit log go by it.
void Gateway::watch_clock() {
  const auto ahead = ahead_of_steady_clock();
  const auto by = std::chrono::duration_cast<std::chrono::seconds>(ahead - std::exchange(clock_ahead_, ahead));
  if (by.count() == 0) return;
  ++metrics_.clock_jumps;
  log(LogLevel::warning, "the clock was set", {{"by_seconds", by.count()}});
}

rr::awaitable<void> Gateway::watch_files() {
  while (!is_stopping_) {
    files_watch_.expires_after(files_watch_period);
    co_await files_watch_.async_wait(asio::as_tuple(asio::use_awaitable));
    if (is_stopping_) break;
    watch_clock();
    access_.reload(false);
    access_.tend_audit();
    tend_log();
    end_those_not_good();
    if (web_tls_ && web_tls_->has_changed()) web_tls_->reload();
    devices_.reload_tls(false);
    if (found_) found_->reload_tls(false);
  }
}

rr::Result<> Gateway::reconfigure(Config next) {
  // All that can fail comes first.
  std::unique_ptr<TlsFiles> web_tls;
  const bool has_other_tls =
      next.tls.certificates != config_.tls.certificates || next.access.clients != config_.access.clients;
  if (has_other_tls && !next.tls.certificates.empty()) {
    web_tls = std::make_unique<TlsFiles>(next.tls.certificates, next.access.clients);
    if (auto loaded = web_tls->load(); !loaded) return loaded;
  }
  std::shared_ptr<TlsFiles> found_tls;
  if (next.discover.is_enabled) {
    auto loaded = FoundDevices::load_tls(next.discover);
    if (!loaded) return loaded.error();
    found_tls = std::move(*loaded);
  }
  auto devices = devices_.prepare(next);
  if (!devices) return devices.error();
  auto access = load_access(next.access);
  if (!access) return access.error();
  const auto has = [](const std::vector<Place>& places, const Place& place) {
    return std::find(places.begin(), places.end(), place) != places.end();
  };
  const auto places_before = places_of(config_.listen);
  const auto places = places_of(next.listen);
  std::vector<Listener> opened;
  std::vector<rr::HostPort> bound;
  for (const auto& acceptor : adopted_) {
    rr::error_code ignored;
    const auto local = acceptor->local_endpoint(ignored);
    bound.push_back({local.address().to_string(), local.port()});
  }
  if (const auto problem = exposure(bound, next); !problem.empty() && !next.insecure)
    return rr::make_error(rr::ErrorCode::invalid_configuration, problem);
  bound.clear();
  // Who listens on all addresses of a port is in the way of who wants one of them, and the other way round.
  std::vector<Place> yielded;
  const auto fail = [&](const rr::Error& error) {
    opened.clear();
    for (const auto& place : yielded)
      if (auto again = open(place, bound))
        serve(std::move(*again));
      else
        log(LogLevel::error, "no longer listening", {{"error", again.error().message}});
    return error;
  };
  if (adopted_.empty())
    for (const auto& place : places) {
      if (has(places_before, place)) continue;
      auto listener = open(place, bound);
      if (!listener) {
        std::erase_if(listeners_, [&](const Listener& other) {
          const bool is_in_the_way = other.place.address.port == place.address.port && !has(places, other.place);
          if (!is_in_the_way) return false;
          other.socket->close();
          yielded.push_back(other.place);
          return true;
        });
        if (!yielded.empty()) listener = open(place, bound);
      }
      if (!listener) return fail(listener.error());
      opened.push_back(std::move(*listener));
    }
  if (auto replaced = access_.replace(std::move(*access)); !replaced) return fail(replaced.error());

  const auto before = std::exchange(config_, std::move(next));
  if (before.node != config_.node)
    log(LogLevel::warning, "the gateway's node has its new name and id after a restart",
        {{"name", shared_.node().identity().name}});
  if (before.access.jwt != config_.access.jwt) issuer_keys_.start();
  if (has_other_tls) web_tls_ = std::move(web_tls);
  std::erase_if(listeners_, [&](const Listener& listener) {
    const bool is_gone = !has(places, listener.place);
    if (is_gone) listener.socket->close();
    return is_gone;
  });
  for (auto& listener : opened) serve(std::move(listener));
  for (const auto& address : bound)
    log(LogLevel::info, "listening", {{"address", rr::format_host_port(address.host, address.port)}});
  admission_.set_limits(config_.limits.clients, config_.limits.clients_per_address);
  memory_.set_total(memory_total(config_));
  devices_.replace(std::move(*devices));
  note_devices();
  shared_.renew_judges();
  if (found_) {
    found_->note_change(before.discover, std::move(found_tls));
  } else if (config_.discover.is_enabled) {
    found_ = std::make_unique<FoundDevices>(io_, config_, devices_, std::move(found_tls));
    found_->start();
  }
  recordings_->follow_config();
  router_ = make_routes(*this);
  // Clients of a found device that is gone stay as long as it lets them, unless a configured one has its name.
  const auto is_still_there = [this](const Device& device) {
    if (!device.config().is_found) return devices_.has(device);
    const auto* now = devices_.find(device.config().name);
    return !now || now->config().is_found;
  };
  for (auto it = connections_.begin(); it != connections_.end();) {
    auto& connection = *it++;
    if (connection.device && !is_still_there(*connection.device))
      connection.stop({1001, "the device has left the configuration, or is another one there"});
  }
  clients_.close_all_but(is_still_there);
  end_those_not_good();
  return {};
}

void Gateway::note_devices() {
  shared_.sync(devices_);
  if (own_service_) own_service_->look_soon();
}

void Gateway::end_those_not_good() {
  for (const auto& [key, holder] : lease_holders_)
    holder.client->review_locks();  // others are reviewed with their connection
  for (auto it = connections_.begin(); it != connections_.end();) {
    auto& connection = *it++;
    if (!connection.is_good || connection.is_good()) continue;
    log(LogLevel::info, "client ended: what it has shown was revoked or has expired", {{"peer", connection.client}});
    connection.stop({1008, "what you have shown was revoked or has expired"});
  }
}

void Gateway::reload_files() {
  access_.reload(true);
  if (web_tls_) web_tls_->reload();
  devices_.reload_tls(true);
  if (found_) found_->reload_tls(true);
}

void Gateway::note_unaccepted(const std::string& problem) {
  ++metrics_.unaccepted;
  log_refusal(LogLevel::error, "connection waits", "those that could not be accepted", {{"error", problem}});
}

void Gateway::accept(asio::ip::tcp::socket socket) {
  rr::error_code error;
  const auto peer = socket.remote_endpoint(error);
  if (error) return;  // gone already
  const auto local = socket.local_endpoint(error);
  ++metrics_.connections;
  const bool is_proxy = config_.proxy.trust.trusts(peer.address());
  auto ticket = admission_.admit(is_proxy ? std::nullopt : std::optional(peer.address()));
  if (!ticket) {
    reject(Rejection::too_many);
    log_refusal(LogLevel::warning, "connection refused: too many", peer.address().to_string(),
                {{"peer", peer.address().to_string()}, {"open", admission_.open()}});
    return;
  }
  serve(rr::make_tcp_stream(std::move(socket), config_.timeouts.send_stall), peer, local, std::move(*ticket));
}

rr::Result<std::unique_ptr<rr::ByteStream>> Gateway::connect_inside() {
  int pair[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
    return rr::make_error(rr::ErrorCode::system_resource_error,
                          "no pair of sockets: " + std::error_code(errno, std::system_category()).message());
  const auto stream_of = [this](int socket) {
    return std::make_unique<rr::SocketStream>(rr::SocketStream::Socket(io_, {AF_UNIX, 0}, socket), "this process",
                                              config_.timeouts.send_stall);
  };
  auto ours = stream_of(pair[0]);
  auto theirs = stream_of(pair[1]);
  auto ticket = admission_.admit(std::nullopt);
  if (!ticket) return rr::make_error(rr::ErrorCode::out_of_system_resource, "too many connections");
  const asio::ip::tcp::endpoint here(asio::ip::address_v4::loopback(), 0);
  serve(std::move(ours), here, here, std::move(*ticket));
  return theirs;
}

void Gateway::serve(std::unique_ptr<rr::ByteStream> stream, const asio::ip::tcp::endpoint& peer,
                    const asio::ip::tcp::endpoint& local, Admission::Ticket ticket) {
  ++open_connections_;
  auto serving = serve_connection(*this, std::move(stream), peer, local, std::move(ticket));
  asio::co_spawn(io_, std::move(serving), [this](const std::exception_ptr& failure) {
    --open_connections_;
    if (is_stopping_) drained_.cancel();
    if (!failure) return;
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& exception) {  // out of memory, or a mistake of ours: this connection only
      log(LogLevel::error, "connection failed", {{"error", exception.what()}});
    }
  });
}

void Gateway::stop(std::function<void()> on_stopped) {
  if (is_stopping_) {
    ends_at_once_ = true;
    drained_.cancel();
    return;
  }
  is_stopping_ = true;
  on_stopped_ = std::move(on_stopped);
  give_adopted_back();
  if (on_stop_) on_stop_();
  if (found_) found_->stop();
  issuer_keys_.stop();
  recordings_->stop();
  devices_.stop();
  clients_.stop();
  devices_.on_change(nullptr);
  files_watch_.cancel();
  asio::co_spawn(io_, drain(), asio::detached);
}

/// Whoever handed a socket over keeps it: who connects from now on waits in it for the next gateway. Released before it
/// is closed, since the kernel forgets what is watched at the last close only, which is not this one.
void Gateway::give_adopted_back() {
  for (const auto& acceptor : adopted_) {
    rr::error_code error;
    const int socket = acceptor->release(error);
    if (!error) ::close(socket);
  }
}

bool Gateway::has_session() const {
  return std::any_of(connections_.begin(), connections_.end(), [](const auto& each) { return each.has_session; });
}

void Gateway::end_all(const rr::EndReason& reason) {
  for (auto it = connections_.begin(); it != connections_.end();) {
    auto& connection = *it++;
    connection.stop(reason);
  }
}

rr::awaitable<void> Gateway::drain() {
  for (auto it = connections_.begin(); it != connections_.end();) {
    auto& connection = *it++;
    if (!connection.has_session) connection.stop({1001, "the gateway is stopping"});
  }
  log(LogLevel::info, "stopping", {{"connections", open_connections_}, {"drain_ms", config_.timeouts.drain.count()}});
  const auto wait_until = [this](std::chrono::steady_clock::time_point deadline) -> rr::awaitable<void> {
    drained_.expires_at(deadline);
    co_await drained_.async_wait(asio::as_tuple(asio::use_awaitable));
  };
  auto deadline = std::chrono::steady_clock::now() + config_.timeouts.drain;
  while (has_session() && !ends_at_once_ && std::chrono::steady_clock::now() < deadline) co_await wait_until(deadline);
  for (const auto& listener : listeners_) listener.socket->close();
  shared_.stop();
  if (own_service_) own_service_->stop();
  const rr::EndReason reason{1001, "the gateway is stopping"};
  end_all(reason);
  deadline = std::chrono::steady_clock::now() + last_wait;
  for (auto now = std::chrono::steady_clock::now(); now < deadline; now = std::chrono::steady_clock::now()) {
    if (devices_.are_closing())  // the last that they are told may be what makes them safe
      co_await wait_until(std::min(deadline, now + closing_look_period));
    else if (open_connections_ > 0)
      co_await wait_until(deadline);
    else
      break;
  }
  log(LogLevel::info, "stopped", {{"connections_cut", open_connections_}});
  on_stopped_();
}

}  // namespace rrgate
