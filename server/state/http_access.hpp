// Who sends a request, and how much he may ask for. Layer: server/state.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>
#include <memory>
#include <optional>
#include <string>

#include "server/access/access.hpp"
#include "server/access/access_requests.hpp"
#include "server/access/logins.hpp"
#include "server/config/config.hpp"
#include "server/http/request.hpp"
#include "server/limits/bounded_table.hpp"
#include "server/limits/rate_gate.hpp"

namespace rrgate {

struct Connection;

class HttpAccess {
 public:
  HttpAccess(Access& access, Logins& logins) : access_(access), logins_(logins) {}
  HttpAccess(const HttpAccess&) = delete;
  HttpAccess& operator=(const HttpAccess&) = delete;

  /// What the request shows, in this order: the headers of a trusted proxy, Authorization, a ticket where it becomes a
  /// WebSocket, the certificate of the connection. All are borrowed until the answer.
  /// Errors   authentication_error: what it shows is wrong; out_of_system_resource: too many tries; invalid_argument:
  /// two proxies in one, see IdentityHeaders.
  rr::awaitable<rr::Result<Identity>> identify(const Request& request, const Connection& connection,
                                               const Config& config);
  /// Whether Basic credentials are for the gateway; else they are for the device.
  bool takes_basic() const { return access_.state().users != nullptr; }

  /// 401 where showing who one is may help, 403, 503, or 400. As application/problem+json.
  Response refusal(const Identity& who, const rr::Error& error) const;

  /// What lets one request pass, as long as it is answered; or what it is refused with.
  struct Admitted {
    std::optional<RateGate::Pass> client = {};
    std::optional<RateGate::Pass> user = {};
    std::optional<Response> refusal = {};
  };
  /// Finds out who sends a request, which is noted in it, and whether he asks for too much.
  rr::awaitable<Admitted> admit(Request& request, const Connection& connection, const Config& config);
  std::optional<RateGate::Pass> enter_device(const std::string& device, const Rates& rates);
  static Response too_much(std::string_view what);
  struct Passes {
    std::optional<RateGate::Pass> client = {};
    std::optional<RateGate::Pass> user = {};
    std::optional<RateGate::Pass> device = {};
  };
  /// Lets one request pass that is not one of HTTP's, until it is answered. `device`  empty: none.
  /// Errors   out_of_system_resource: too much is asked for; again in a second.
  rr::Result<std::shared_ptr<const Passes>> enter(const std::string& network, const Subject& user,
                                                  const std::string& device, const Rates& rates);

  AccessRequests& requests() { return requests_; }

 private:
  rr::Result<Identity> by_token(std::string_view token) const;
  rr::awaitable<rr::Result<Identity>> by_password(std::string credentials, ClientOrigin from);

  Access& access_;
  Logins& logins_;
  AccessRequests requests_;
  RateGate clients_;
  RateGate users_;
  RateGate devices_;
};

}  // namespace rrgate
