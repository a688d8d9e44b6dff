// What connections need of the gateway: who may do what, the devices, the counters. Layer: server/state.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/intrusive/list.hpp>
#include <memory>

#include "node/tls/tls_context.hpp"
#include "server/access/access.hpp"
#include "server/access/approvals.hpp"
#include "server/access/logins.hpp"
#include "server/config/config.hpp"
#include "server/config/tls_files.hpp"
#include "server/http/router.hpp"
#include "server/limits/bounded_table.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/limits/workers.hpp"
#include "server/log/log.hpp"
#include "server/log/metrics.hpp"
#include "server/rr/shared_devices.hpp"
#include "server/state/admission.hpp"
#include "server/state/agent_requests.hpp"
#include "server/state/agent_sessions.hpp"
#include "server/state/agent_subscriptions.hpp"
#include "server/state/connection.hpp"
#include "server/state/handshake_turns.hpp"
#include "server/state/http_access.hpp"
#include "server/upstream/device_registry.hpp"
#include "server/upstream/found_devices.hpp"
#include "server/upstream/value_clients.hpp"

namespace rrgate {

class Recordings;

/// The parts of a gateway. Uses one thread: that of the io_context. Gateway alone starts, changes and stops them.
class GatewayState {
 public:
  GatewayState(const GatewayState&) = delete;
  GatewayState& operator=(const GatewayState&) = delete;

  const Config& config() const { return config_; }
  DeviceRegistry& devices() { return devices_; }
  ValueClients& clients() { return clients_; }
  Recordings& recordings() { return *recordings_; }
  SharedDevices& shared() { return shared_; }
  /// Null where the configuration has no "discover", and before start().
  FoundDevices* found() { return config_.discover.is_enabled ? found_.get() : nullptr; }
  /// Pages that are devices.
  PageLinks& pages() { return pages_; }
  Metrics& metrics() { return metrics_; }
  void reject(Rejection why) { metrics_.reject(why); }
  /// For an error of Access::check().
  void reject(const rr::Error& why) {
    reject(why.code == rr::ErrorCode::out_of_system_resource ? Rejection::audit : Rejection::forbidden);
  }
  /// A line about a refusal that anybody can cause as often as he likes: of a network few a minute are written, and the
  /// others are counted. `client`  as logs name it.
  void log_refusal(LogLevel level, std::string_view event, std::string_view client,
                   std::initializer_list<LogField> fields);
  /// Writes how many such lines were left out, where a minute is over. To be called now and then.
  void tend_log();
  Admission& admission() { return admission_; }
  /// Documents about devices that were asked for lately, by what they are made of.
  using Documents = BoundedTable<std::string, Response>;
  Documents& documents() { return documents_; }
  /// A client that holds a lease for requests of HTTP.
  struct LeaseHolder {
    std::shared_ptr<ValueClient> client;
    std::string url_path;  ///< by which the lease was asked for
  };
  /// By the key that the requests show; each until its lease ends.
  std::map<std::string, LeaseHolder, std::less<>>& lease_holders() { return lease_holders_; }
  /// Of whom TLS handshakes go on.
  HandshakeTurns& handshakes() { return handshakes_; }
  /// What would take long on this thread.
  Workers& workers() { return workers_; }
  /// What clients make the gateway hold.
  MemoryBudget& memory() { return memory_; }
  /// Who may do what.
  Access& access() { return access_; }
  /// What agents ask a person for.
  Approvals& approvals() { return approvals_; }
  /// What agents wait for.
  AgentRequests& agent_requests() { return agent_requests_; }
  /// Which agents have been here, and what they have commanded.
  AgentSessions& agent_sessions() { return agent_sessions_; }
  /// What agents want to be told of.
  AgentSubscriptions& agent_subscriptions() { return agent_subscriptions_; }
  /// Agents that read recordings now.
  RateGate& recording_readers() { return recording_readers_; }
  /// Who is judged for what he logs in as.
  Logins& logins() { return logins_; }
  /// How clients of HTTP show who they are, and how much they may ask for.
  HttpAccess& http_access() { return http_access_; }
  const Router& router() const { return router_; }
  /// What new connections are encrypted with; null: TLS is not served.
  rr::TlsContextPtr tls() const { return web_tls_ ? web_tls_->context() : nullptr; }
  /// Our own node id, for answers to native clients that no device takes.
  const rr::NodeId& node_id() { return shared_.node().identity().id; }
  void add(Connection& connection) { connections_.push_back(connection); }
  bool is_stopping() const { return is_stopping_; }

 protected:
  GatewayState(boost::asio::io_context& io, Config config);
  ~GatewayState();

  /// As the configuration says.
  static std::size_t memory_total(const Config& config) {
    return config.limits.memory == 0 ? machine_memory() / 4 : config.limits.memory;
  }

  Config config_;
  MemoryBudget memory_;
  Access access_;
  Approvals approvals_;
  AgentRequests agent_requests_;
  AgentSessions agent_sessions_;
  AgentSubscriptions agent_subscriptions_;
  RateGate recording_readers_;
  Logins logins_;
  IssuerKeys issuer_keys_;
  HttpAccess http_access_;
  std::unique_ptr<TlsFiles> web_tls_;
  DeviceRegistry devices_;
  ValueClients clients_;
  std::unique_ptr<Recordings> recordings_;
  std::map<std::string, LeaseHolder, std::less<>> lease_holders_;
  std::unique_ptr<FoundDevices> found_;
  PageLinks pages_;
  Admission admission_;
  HandshakeTurns handshakes_;
  SharedDevices shared_;
  Router router_;
  Documents documents_{32};
  Metrics metrics_;
  boost::intrusive::list<Connection, boost::intrusive::constant_time_size<false>> connections_;
  RefusalDigest refusals_{20};
  bool is_stopping_ = false;
  Workers workers_;  ///< goes first
};

}  // namespace rrgate
