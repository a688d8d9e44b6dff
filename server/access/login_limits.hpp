// How often one may guess a password. Layer: server/access.
#pragma once

#include <chrono>
#include <string>

#include "core/session/service/authenticator.hpp"
#include "server/limits/bounded_table.hpp"
#include "server/limits/client_network.hpp"

namespace rrgate {

/// By network, and by user within a network: who floods the gateway with wrong passwords keeps nobody else out, and not
/// the user either whose password he guesses, unless they come from one network. A site of IPv6 has 65,536 networks:
/// together they may guess ten times as much as one.
class LoginLimits {
 public:
  /// Kept while a login is being judged.
  struct Ticket {
    rr::LoginLimit::Ticket of_site;
    rr::LoginLimit::Ticket of_network;
    rr::LoginLimit::Ticket of_user;
  };

  /// Errors   authentication_error: too many have failed; out_of_system_resource: too many are being judged.
  rr::Result<Ticket> begin(const std::string& user, const std::string& network, rr::Now now) {
    auto of_site = sites_.at(site_name(network), max_failures_of_site, max_judged_of_site).begin(now);
    if (!of_site) return of_site.error();
    auto of_network = networks_.at(network).begin(now);
    if (!of_network) return of_network.error();
    auto of_user = users_.at(key(user, network), max_failures_of_user).begin(now);
    if (!of_user) return of_user.error();
    return Ticket{std::move(*of_site), std::move(*of_network), std::move(*of_user)};
  }
  void handle_failure(const std::string& user, const std::string& network, rr::Now now) {
    sites_.at(site_name(network), max_failures_of_site, max_judged_of_site).handle_failure(now);
    networks_.at(network).handle_failure(now);
    users_.at(key(user, network), max_failures_of_user).handle_failure(now);
    failed_.at(network) = now.steady;
  }
  bool has_failed_lately(const std::string& network, rr::Now now) {
    const auto* failed = failed_.find(network);
    return failed && now.steady < *failed + failure_memory;
  }

 private:
  static constexpr std::size_t max_failures_of_user = 20;   ///< in a row; one is forgotten each second
  static constexpr std::size_t max_failures_of_site = 600;  ///< likewise
  static constexpr std::size_t max_judged_of_site = 640;
  static constexpr std::size_t max_kept = 10'000;
  static constexpr std::chrono::minutes failure_memory{1};

  static std::string key(const std::string& user, const std::string& network) { return network + ' ' + user; }

  BoundedTable<std::string, rr::LoginLimit> sites_{max_kept};
  BoundedTable<std::string, rr::LoginLimit> networks_{max_kept};
  BoundedTable<std::string, rr::LoginLimit> users_{max_kept};
  BoundedTable<std::string, rr::TimePoint> failed_{max_kept};  ///< the last time, by network
};

}  // namespace rrgate
