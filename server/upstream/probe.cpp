#include "server/upstream/probe.hpp"

#include <algorithm>

#include "core/session/service/service_index.hpp"
#include "node/discovery/service_query.hpp"

namespace rrgate {

rr::awaitable<rr::Result<ProbeResult>> probe(rr::ConnectionUrl url, ProbeOptions options) {
  rr::ServiceQueryOptions query;
  query.self_name = gateway_node_name;
  query.self_id = options.self_id;
  query.dial = std::move(options.dial);
  query.definitions = std::move(options.definitions);
  query.max_answer_bytes = 12u * 1024 * 1024;  // somebody has named this device: it may have much to say
  const auto service_of_url = url.service;
  auto answer = co_await rr::query_services(std::move(url), std::move(query));
  if (!answer) co_return answer.error();
  ProbeResult result{answer->node.id, answer->node.name, {}};
  for (const auto& service : answer->services)
    result.services.push_back({service.name, service.root_object_type, service.root_object_implements});
  // A small device may have no service index, another gateway tells strangers of no service: what the URL names is all
  // that is known.
  const auto is_index = [](const DeviceService& service) { return service.name == rr::service_index_name; };
  if (!service_of_url.empty() && std::all_of(result.services.begin(), result.services.end(), is_index))
    result.services.push_back({service_of_url, {}, {}});
  co_return result;
}

}  // namespace rrgate
