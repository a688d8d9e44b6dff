#include "server/node/tcp_connect.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <list>
#include <memory>
#include <vector>

namespace rr {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

constexpr std::chrono::milliseconds head_start{250};

/// IPv6 and IPv4 in turns, beginning with what the resolver prefers.
std::vector<tcp::endpoint> in_turns(const tcp::resolver::results_type& results) {
  std::vector<tcp::endpoint> preferred, other, endpoints;
  for (const auto& result : results) {
    const tcp::endpoint endpoint = result.endpoint();
    const bool is_preferred = preferred.empty() || endpoint.protocol() == preferred.front().protocol();
    (is_preferred ? preferred : other).push_back(endpoint);
  }
  for (std::size_t i = 0; i < std::max(preferred.size(), other.size()); ++i) {
    if (i < preferred.size()) endpoints.push_back(preferred[i]);
    if (i < other.size()) endpoints.push_back(other[i]);
  }
  return endpoints;
}

class Dial : public std::enable_shared_from_this<Dial> {
 public:
  Dial(asio::io_context& io, std::string host, std::uint16_t port, TcpConnected done)
      : io_(io), resolver_(io), deadline_(io), next_(io), host_(std::move(host)), port_(port), done_(std::move(done)) {}

  void start(std::chrono::milliseconds timeout) {
    deadline_.expires_after(timeout);
    deadline_.async_wait([this, self = shared_from_this()](const error_code& error) {
      if (!error) finish(failure(ErrorCode::request_timeout, "no answer in time"));
    });
    resolver_.async_resolve(host_, std::to_string(port_), tcp::resolver::numeric_service,
                            [this, self = shared_from_this()](const error_code& error, const auto& results) {
                              if (error) return finish(failure(ErrorCode::connection_error, error.message()));
                              endpoints_ = in_turns(results);
                              try_next();
                            });
  }

 private:
  void try_next() {
    if (!done_ || tried_ == endpoints_.size()) return;
    const tcp::endpoint endpoint = endpoints_[tried_++];
    const auto socket = sockets_.emplace(sockets_.end(), io_);
    socket->async_connect(endpoint, [this, self = shared_from_this(), socket](const error_code& error) {
      if (!done_) return;
      if (!error) return finish(std::move(*socket));
      ++failed_;
      if (failed_ == endpoints_.size()) return finish(failure(ErrorCode::connection_error, error.message()));
      try_next();
    });
    next_.expires_after(head_start);
    next_.async_wait([this, self = shared_from_this()](const error_code& error) {
      if (!error) try_next();
    });
  }

  Error failure(ErrorCode code, const std::string& why) const {
    return make_error(code, "connect to " + quoted(host_) + " port " + std::to_string(port_) + ": " + why);
  }

  void finish(Result<tcp::socket> result) {
    if (!done_) return;
    const TcpConnected done = std::exchange(done_, nullptr);
    resolver_.cancel();
    deadline_.cancel();
    next_.cancel();
    error_code ignored;
    for (tcp::socket& socket : sockets_) socket.close(ignored);  // the winner was moved out
    done(std::move(result));
  }

  asio::io_context& io_;
  tcp::resolver resolver_;
  asio::steady_timer deadline_;
  asio::steady_timer next_;
  std::string host_;
  std::uint16_t port_;
  TcpConnected done_;
  std::vector<tcp::endpoint> endpoints_;
  std::list<tcp::socket> sockets_;
  std::size_t tried_ = 0;
  std::size_t failed_ = 0;
};

}  // namespace

void tcp_connect(asio::io_context& io, const std::string& host, std::uint16_t port, std::chrono::milliseconds timeout,
                 TcpConnected done) {
  std::make_shared<Dial>(io, host, port, std::move(done))->start(timeout);
}

}  // namespace rr
