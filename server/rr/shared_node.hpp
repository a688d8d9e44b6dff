// A node that is the gateway: its own, or the one that stands for a shared device. Layer: server/rr.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "server/limits/memory_budget.hpp"
#include "server/rr/shared_client.hpp"

namespace rrgate {

/// What a connection brings with it.
struct SharedArrival {
  ClientOrigin from;
  std::string base_url;  ///< of the node, as this client reaches it: "rr+tcp://10.0.0.5:52222/"
  std::function<rr::Result<>(const rr::MemberAccess&)> admit;  ///< none: everything is allowed
  /// See ServiceSessionOptions.
  std::function<rr::Result<std::shared_ptr<rr::RequestPass>>(const rr::MemberAccess&)> enter;
  /// See ServiceSessionOptions.
  std::function<std::optional<rr::Error>(std::string_view service)> why_missing;
  std::shared_ptr<SessionRights> lock_rights;  ///< null: everything is allowed
  bool is_encrypted = false;
  MemoryBudget::Charge memory;  ///< what is held for it
};

class SharedNode final : public ServiceBoard {
 public:
  /// `config` and `logins` outlive it.
  SharedNode(rr::NodeIdentity identity, const Config& config, Logins& logins)
      : config_(config), logins_(logins), directory_(std::move(identity)) {}
  ~SharedNode() { close(); }
  SharedNode(const SharedNode&) = delete;
  SharedNode& operator=(const SharedNode&) = delete;

  rr::ServiceDirectory& directory() { return directory_; }
  const rr::NodeIdentity& identity() const { return directory_.identity(); }

  /// A client on a stream, from now until one of the two ends; `ended` is called then.
  std::shared_ptr<SharedClient> add(std::unique_ptr<rr::ByteStream> stream, SharedArrival arrival,
                                    std::function<void()> ended);
  const std::map<SharedClient*, std::shared_ptr<SharedClient>>& clients() const { return clients_; }
  /// Tells all clients that their services end.
  void close();

  /// The name of the device that a service is of; empty where there is no such service, or the index.
  std::string device_of(std::string_view service) const;
  /// Null: the service index.
  std::shared_ptr<SharedService> find_service(std::string_view name) const;
  Logins& logins() { return logins_; }
  /// Called by a client of the node when it has ended.
  void client_ended(SharedClient& client);

  std::shared_ptr<const rr::Authenticator> authenticator() const override { return logins_.authenticator(); }
  void publish(const std::shared_ptr<rr::HostedService>& hosted, SharedService& service) override;
  void withdraw(const rr::HostedService& hosted) override;

 private:
  const Config& config_;
  Logins& logins_;
  rr::ServiceDirectory directory_;
  std::map<std::string, std::pair<const rr::HostedService*, std::weak_ptr<SharedService>>, std::less<>> services_;
  std::set<const rr::HostedService*> refused_;  ///< their names are taken, and that was told
  std::map<SharedClient*, std::shared_ptr<SharedClient>> clients_;
  std::map<SharedClient*, std::function<void()>> ended_;
};

}  // namespace rrgate
