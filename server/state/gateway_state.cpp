#include "server/state/gateway_state.hpp"

#include <utility>

#include "core/support/random.hpp"
#include "server/limits/client_network.hpp"
#include "server/recordings/recordings.hpp"

namespace rrgate {

GatewayState::GatewayState(boost::asio::io_context& io, Config config)
    : config_(std::move(config)),
      memory_(memory_total(config_)),
      access_(config_.access),
      logins_(io.get_executor(), access_),
      issuer_keys_(io.get_executor(), access_),
      http_access_(access_, logins_, issuer_keys_),
      web_tls_(config_.tls.certificates.empty()
                   ? nullptr
                   : std::make_unique<TlsFiles>(config_.tls.certificates, config_.access.clients)),
      devices_(io.get_executor(), config_),
      clients_(io.get_executor(), memory_.charge("")),
      recordings_(std::make_unique<Recordings>(io.get_executor(), config_, devices_, clients_, workers_,
                                               memory_.charge("recordings"))),
      admission_(config_.limits.clients, config_.limits.clients_per_address),
      shared_(config_.node.id.is_any() ? rr::random_node_id() : config_.node.id, config_, logins_) {}

GatewayState::~GatewayState() = default;

void GatewayState::log_refusal(LogLevel level, std::string_view event, std::string_view client,
                               std::initializer_list<LogField> fields) {
  if (refusals_.note(network_name_of(client), std::chrono::steady_clock::now())) log(level, event, fields);
}

void GatewayState::tend_log() {
  for (const auto& [network, count] : refusals_.take(std::chrono::steady_clock::now()))
    log(LogLevel::info, "more refusals within a minute",
        {{"network", network.empty() ? "others" : network}, {"count", count}});
}

}  // namespace rrgate
