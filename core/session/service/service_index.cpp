#include "core/session/service/service_index.hpp"

#include <cstdlib>

namespace rr {

const std::string_view service_index_definition = R"(service RobotRaconteurServiceIndex
struct NodeInfo
field string NodeName
field uint8[16] NodeID
field string{int32} ServiceIndexConnectionURL
end struct
struct ServiceInfo
field string Name
field string RootObjectType
field string{int32} RootObjectImplements
field string{int32} ConnectionURL
field varvalue{string} Attributes
end struct
object ServiceIndex
function ServiceInfo{int32} GetLocalNodeServices()
function NodeInfo{int32} GetRoutedNodes()
function NodeInfo{int32} GetDetectedNodes()
event LocalNodeServicesChanged()
end object
)";

namespace {

class ServiceIndexObject : public ServiceObject {
 public:
  const std::string& type_name() const override {
    static const std::string name = "RobotRaconteurServiceIndex.ServiceIndex";
    return name;
  }
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition&,
                                                    const std::optional<std::string>&) override {
    return make_error(ErrorCode::object_not_found, "the service index has no other objects");
  }
};

std::shared_ptr<TypeRegistry> read_index_types() {
  auto types = std::make_shared<TypeRegistry>();
  // The text is our own: that it is valid is what the tests of this file prove.
  if (!types->add({std::string(service_index_definition)}, RobdefMode::compat)) std::abort();
  return types;
}

Value describe(const HostedService& service, const NodeIdentity& node, std::string_view base_url) {
  MapInt32 implements;
  for (const auto& base : service.root_type().implements)
    implements.items.emplace_back(static_cast<std::int32_t>(implements.items.size()),
                                  Value(implements_name(service.root_type(), base)));
  std::string url(base_url);
  url += "?nodeid=" + format_node_id(node.id, NodeIdFormat::dashes) + "&service=" + service.name();
  MapInt32 urls;
  urls.items.emplace_back(1, Value(url));
  return Structure{"RobotRaconteurServiceIndex.ServiceInfo",
                   {{"Name", Value(service.name())},
                    {"RootObjectType", Value(service.root_type_name())},
                    {"RootObjectImplements", Value(std::move(implements))},
                    {"ConnectionURL", Value(std::move(urls))},
                    {"Attributes", service.attributes()}}};
}

Value describe(const std::vector<KnownNode>& nodes, const std::function<bool(EntryType, std::string_view)>& may_know) {
  MapInt32 out;
  for (const auto& [node, index_urls, known_as] : nodes) {
    if (!may_know(EntryType::get_node_info, known_as)) continue;
    MapInt32 urls;
    for (const auto& url : index_urls)
      urls.items.emplace_back(static_cast<std::int32_t>(urls.items.size()), Value(url));
    const std::vector<std::uint8_t> id(node.id.bytes.begin(), node.id.bytes.end());
    out.items.emplace_back(static_cast<std::int32_t>(out.items.size()),
                           Structure{"RobotRaconteurServiceIndex.NodeInfo",
                                     {{"NodeName", Value(node.name)},
                                      {"NodeID", Value(id)},
                                      {"ServiceIndexConnectionURL", Value(std::move(urls))}}});
  }
  return out;
}

}  // namespace

std::shared_ptr<HostedService> make_service_index() {
  // Once for all nodes of the program, of which a gateway has one for each shared device; for good.
  static const auto& types = *new auto(read_index_types());
  auto service = HostedService::make(std::string(service_index_name), std::make_shared<ServiceIndexObject>(), types);
  return std::move(service.value());
}

Result<Value> answer_service_index_call(std::string_view function, const ServiceDirectory& directory,
                                        std::string_view base_url,
                                        const std::function<bool(EntryType, std::string_view)>& may_know) {
  MapInt32 answer;
  if (function == "GetRoutedNodes") return describe(directory.routed_nodes(base_url), may_know);
  if (function == "GetDetectedNodes") return describe(directory.detected_nodes(base_url), may_know);
  if (function != "GetLocalNodeServices")
    return make_error(ErrorCode::member_not_found, "the service index has no function " + quote(function));
  if (base_url.empty()) return make_error(ErrorCode::service_error, "this transport has no URL");
  const auto add = [&](const HostedService& service) {
    answer.items.emplace_back(static_cast<std::int32_t>(answer.items.size()),
                              describe(service, directory.identity(), base_url));
  };
  for (const auto& [name, service] : directory.services())
    if (name != service_index_name && may_know(EntryType::null, name)) add(*service);
  add(*directory.find(service_index_name));  // last, as the reference has it
  return Value(std::move(answer));
}

}  // namespace rr
