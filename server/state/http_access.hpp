// Who sends a request, and how much he may ask for. Layer: server/state.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/access/access.hpp"
#include "server/access/access_requests.hpp"
#include "server/access/authorization.hpp"
#include "server/access/logins.hpp"
#include "server/config/config.hpp"
#include "server/http/request.hpp"
#include "server/limits/bounded_table.hpp"
#include "server/limits/rate_gate.hpp"
#include "server/state/issuer_keys.hpp"

namespace rrgate {

struct Connection;

class HttpAccess {
 public:
  HttpAccess(Access& access, Logins& logins, IssuerKeys& issuer_keys)
      : access_(access), logins_(logins), issuer_keys_(issuer_keys) {}
  HttpAccess(const HttpAccess&) = delete;
  HttpAccess& operator=(const HttpAccess&) = delete;

  /// What the request shows, in this order: the headers of a trusted proxy, Authorization, a ticket where it becomes a
  /// WebSocket, the cookie of a sign-in, the certificate of the connection. All are borrowed until the answer. A cookie
  /// that is not good any more shows nothing: no page can take it away.
  /// Errors   authentication_error: what it shows is wrong; out_of_system_resource: too many tries; invalid_argument:
  /// two proxies in one, see IdentityHeaders.
  rr::awaitable<rr::Result<Identity>> identify(const Request& request, const Connection& connection,
                                               const Config& config);
  /// What an Authorization header shows; of nobody where the gateway knows none of its schemes. Errors   as above.
  rr::awaitable<rr::Result<Identity>> by_authorization(std::string header, ClientOrigin from);
  /// Whether Basic credentials are for the gateway; else they are for the device.
  bool takes_basic() const { return access_.state().users != nullptr; }

  /// 401 where showing who one is may help, 403, 503, or 400. As application/problem+json. A page that asks with
  /// X-Requested-With has a form of its own: its browser is not told of passwords, so that it opens no dialog.
  Response refusal(const Request& request, const rr::Error& error) const;

  /// What lets one request pass, as long as it is answered; or what it is refused with.
  struct Admitted {
    std::optional<RateGate::Pass> client = {};
    std::optional<RateGate::Pass> user = {};
    std::optional<Response> refusal = {};
  };
  /// Finds out who sends a request, and whether he asks for too much; both are noted in it.
  /// `passes`  whether it goes through though it be too much, by who sends it; empty: for nobody.
  rr::awaitable<Admitted> admit(Request& request, const Connection& connection, const Config& config,
                                std::function<bool(const Identity&)> passes);
  /// Set-Cookie that takes the sign-in further by which the request was admitted. Empty: there is none, it has ended
  /// meanwhile, or its cookie is good for long still.
  std::string renewed_cookie(const Request& request) const;
  std::optional<RateGate::Pass> enter_device(const std::string& device, const Rates& rates);
  /// Refuses it, which is recorded. `of`  as in Request::too_much.
  Response refuse_too_much(const Identity& who, const AccessRequest* what, const std::string& of);
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
  /// As Access::renew(). An identity by a key that is not here yet waits for those that the issuer has now.
  rr::awaitable<std::optional<Identity>> renew(Identity who);
  rr::Result<Identity> by_token(std::string_view token) const;
  rr::awaitable<rr::Result<Identity>> by_password(BasicCredentials credentials, ClientOrigin from);

  Access& access_;
  Logins& logins_;
  IssuerKeys& issuer_keys_;
  AccessRequests requests_;
  RateGate clients_;
  RateGate users_;
  RateGate devices_;
};

}  // namespace rrgate
