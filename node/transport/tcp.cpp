#include "node/transport/tcp.hpp"

#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/tcp.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <set>

#include "node/transport/accept_all.hpp"
#include "node/transport/await_tuple.hpp"
#include "node/transport/socket_stream.hpp"

namespace rr {

namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

/// Bytes that the kernel may hold unsent for one socket. More would only make data older: what the peer can't take yet
/// waits at its source instead. In-flight data is not limited by it, so long fat links keep their throughput.
constexpr int unsent_low_mark = 256 * 1024;

/// A peer that vanished without a word, with nothing on its way to it, is noticed after a minute: nobody else may.
void watch_for_dead_peers(int socket) {
  const auto set = [&](int level, int name, int value) { ::setsockopt(socket, level, name, &value, sizeof(value)); };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 30);   // seconds without a byte from the peer, then
  set(IPPROTO_TCP, TCP_KEEPINTVL, 10);  // so often,
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);     // so many times
}

std::string describe(const tcp::endpoint& endpoint) {
  return format_host_port(endpoint.address().to_string(), endpoint.port());
}

}  // namespace

std::unique_ptr<ByteStream> make_tcp_stream(tcp::socket socket, std::chrono::milliseconds send_stall) {
  error_code error;
  socket.set_option(tcp::no_delay(true), error);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_low_mark, sizeof(unsent_low_mark));
  watch_for_dead_peers(socket.native_handle());
  const auto endpoint = socket.remote_endpoint(error);
  std::string peer = error ? "(gone)" : describe(endpoint);
  return std::make_unique<SocketStream>(std::move(socket), std::move(peer), send_stall);
}

Result<std::vector<HostPort>> TcpListener::open(const HostPort& address, bool takes_both) {
  const auto fail = [&](const error_code& error) {
    close();
    return make_error(ErrorCode::connection_error,
                      "listen on " + format_host_port(address.host, address.port) + ": " + error.message());
  };
  error_code error;
  tcp::resolver resolver(executor_);
  // A name may stand for addresses of a family that this machine has not.
  const auto is_not_here = [](const error_code& why) {
    return why == std::errc::address_family_not_supported || why == std::errc::address_not_available;
  };
  const auto endpoints = resolver.resolve(address.host, std::to_string(address.port), tcp::resolver::passive, error);
  if (error) return fail(error);
  // A port that is free at one address may be taken at the next.
  for (int attempts = address.port == 0 ? 8 : 1; attempts > 0; --attempts) {
    std::vector<HostPort> bound;
    error_code unusable;
    for (const auto& entry : endpoints) {
      auto endpoint = entry.endpoint();
      if (!bound.empty()) endpoint.port(bound.front().port);
      const auto acceptor = std::make_shared<Acceptor>(executor_);
      acceptor->open(endpoint.protocol(), error);
      if (!error) acceptor->set_option(Acceptor::reuse_address(true), error);
      if (!error && endpoint.address().is_v6())
        acceptor->set_option(asio::ip::v6_only(!(takes_both && endpoints.size() == 1)), error);
      if (!error) acceptor->bind(endpoint, error);
      if (!error) acceptor->listen(asio::socket_base::max_listen_connections, error);
      if (is_not_here(error)) {
        unusable = std::exchange(error, {});
        continue;
      }
      if (error) break;
      const auto local = acceptor->local_endpoint(error);
      bound.push_back({local.address().to_string(), local.port()});
      acceptors_.push_back(acceptor);
    }
    if (!error && bound.empty()) error = unusable;
    if (!error) return bound;
    if (error != asio::error::address_in_use) break;
    close();
  }
  return fail(error);
}

void TcpListener::start(const OnAccept& on_accept, const OnProblem& on_problem) {
  for (const auto& acceptor : acceptors_)
    asio::co_spawn(executor_, accept_all(acceptor, on_accept, on_problem), asio::detached);
}

void TcpListener::close() {
  for (const auto& acceptor : acceptors_) {
    error_code ignored;
    acceptor->close(ignored);
  }
  acceptors_.clear();
}

namespace {

constexpr std::chrono::milliseconds stagger{5};

/// Attempts that run side by side. Shared by them, since the losers outlive the call.
struct Race {
  explicit Race(const asio::any_io_executor& executor) : changed(executor) {}

  asio::steady_timer changed;  ///< cancelled when an attempt ends
  std::vector<std::unique_ptr<tcp::socket>> sockets;
  std::size_t failed = 0;
  std::optional<std::size_t> winner;
  std::string failures;  ///< "127.0.0.1: Connection refused; ::1: ..."

  void close_losers() {
    for (std::size_t i = 0; i < sockets.size(); ++i) {
      error_code ignored;
      if (i != winner) sockets[i]->close(ignored);
    }
  }
};

/// Ends the attempts when the race is over, also when it is given up.
class RaceGuard {
 public:
  explicit RaceGuard(std::shared_ptr<Race> race) : race_(std::move(race)) {}
  RaceGuard(const RaceGuard&) = delete;
  RaceGuard& operator=(const RaceGuard&) = delete;
  ~RaceGuard() { race_->close_losers(); }

 private:
  std::shared_ptr<Race> race_;
};

awaitable<void> attempt(std::shared_ptr<Race> race, std::size_t index, tcp::endpoint endpoint) {
  auto [error] = co_await race->sockets[index]->async_connect(endpoint, await_tuple);
  if (error) {
    ++race->failed;
    if (error != asio::error::operation_aborted)
      race->failures += (race->failures.empty() ? "" : "; ") + endpoint.address().to_string() + ": " + error.message();
  } else if (!race->winner) {
    race->winner = index;
  }
  race->changed.cancel();
}

Error connect_error(const std::string& host, std::uint16_t port, const std::string& cause) {
  return make_error(ErrorCode::connection_error, "connect to " + format_host_port(host, port) + ": " + cause);
}

/// A name look-up. Shared, since getaddrinfo can't be interrupted and may outlive the patience of its caller.
struct Lookup {
  explicit Lookup(const asio::any_io_executor& executor) : resolver(executor), finished(executor) {}

  tcp::resolver resolver;
  asio::steady_timer finished;  ///< cancelled when the answer is there
  bool is_done = false;
  error_code error;
  tcp::resolver::results_type found;
};

awaitable<void> look_up(std::shared_ptr<Lookup> lookup, std::string host, std::string port) {
  auto [error, found] = co_await lookup->resolver.async_resolve(host, port, await_tuple);
  lookup->is_done = true;
  lookup->error = error;
  lookup->found = found;
  lookup->finished.cancel();
}

/// The interfaces with a link-local IPv6 address of their own.
std::set<unsigned> link_local_zones() {
  std::set<unsigned> zones;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return zones;
  for (const auto* each = all; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET6) continue;
    const auto* address = reinterpret_cast<const sockaddr_in6*>(each->ifa_addr);
    if (IN6_IS_ADDR_LINKLOCAL(&address->sin6_addr)) zones.insert(address->sin6_scope_id);
  }
  ::freeifaddrs(all);
  return zones;
}

/// A literal, in all zones that it may mean.
std::vector<tcp::endpoint> endpoints_of(const asio::ip::address& literal, std::uint16_t port) {
  std::vector<tcp::endpoint> endpoints;
  if (literal.is_v6() && literal.to_v6().is_link_local() && literal.to_v6().scope_id() == 0) {
    auto address = literal.to_v6();
    for (const auto zone : link_local_zones()) {
      address.scope_id(zone);
      endpoints.emplace_back(address, port);
    }
  }
  if (endpoints.empty()) endpoints.emplace_back(literal, port);
  return endpoints;
}

/// IPv4 first, order kept otherwise; a literal needs no look-up.
awaitable<Result<std::vector<tcp::endpoint>>> resolve(std::string host, std::uint16_t port,
                                                      std::chrono::milliseconds timeout) {
  std::vector<tcp::endpoint> endpoints;
  error_code error;
  if (const auto literal = asio::ip::make_address(host, error); !error) {
    endpoints = endpoints_of(literal, port);
    co_return endpoints;
  }
  if (host == "localhost") {  // no question for a name server
    endpoints = {{asio::ip::address_v4::loopback(), port}, {asio::ip::address_v6::loopback(), port}};
    co_return endpoints;
  }
  const auto executor = co_await asio::this_coro::executor;
  auto lookup = std::make_shared<Lookup>(executor);
  // What nobody waits for any more makes no others wait: all look-ups of a process go one after another.
  struct Guard {
    Lookup& lookup;
    ~Guard() { lookup.resolver.cancel(); }
  };
  const Guard guard{*lookup};
  lookup->finished.expires_after(timeout);
  asio::co_spawn(executor, look_up(lookup, host, std::to_string(port)), asio::detached);
  co_await lookup->finished.async_wait(await_tuple);
  if (!lookup->is_done) co_return connect_error(host, port, "the name look-up takes too long");
  if (lookup->error) co_return connect_error(host, port, lookup->error.message());
  for (const bool want_v4 : {true, false})
    for (const auto& entry : lookup->found)
      if (entry.endpoint().address().is_v4() == want_v4) endpoints.push_back(entry.endpoint());
  co_return endpoints;
}

}  // namespace

awaitable<Result<tcp::socket>> connect_tcp(std::string host, std::uint16_t port, std::chrono::milliseconds timeout) {
  const auto executor = co_await asio::this_coro::executor;
  const auto give_up = std::chrono::steady_clock::now() + timeout;
  auto endpoints = co_await resolve(host, port, timeout);
  if (!endpoints) co_return endpoints.error();

  auto race = std::make_shared<Race>(executor);
  const RaceGuard guard(race);
  std::size_t started = 0;
  std::string cause;
  while (!race->winner) {
    const bool all_started = started == endpoints->size();
    if (all_started && race->failed == started) {
      cause = race->failures;
      break;
    }
    const auto now = std::chrono::steady_clock::now();
    if (now >= give_up) {
      cause = "no answer within " + std::to_string(timeout.count()) + " ms";
      if (!race->failures.empty()) cause += "; " + race->failures;
      break;
    }
    if (!all_started) {
      race->sockets.push_back(std::make_unique<tcp::socket>(executor));
      asio::co_spawn(executor, attempt(race, started, (*endpoints)[started]), asio::detached);
      ++started;
    }
    // Until the next attempt is due, one ends, or time is up.
    race->changed.expires_at(started < endpoints->size() ? std::min(give_up, now + stagger) : give_up);
    co_await race->changed.async_wait(await_tuple);
  }
  // A literal address was named already.
  if (const auto literal = host + ": "; cause.starts_with(literal)) cause.erase(0, literal.size());
  if (!race->winner) co_return connect_error(host, port, cause);
  co_return std::move(*race->sockets[*race->winner]);
}

}  // namespace rr
