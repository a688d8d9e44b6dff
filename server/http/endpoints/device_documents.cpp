#include "server/http/endpoints/device_documents.hpp"

#include <algorithm>
#include <set>

#include "node/generate/definition_set.hpp"
#include "node/generate/generate_typescript.hpp"
#include "server/http/endpoints/device_places.hpp"

namespace rrgate {

using rr::OrderedJson;

namespace {

Response typescript(const std::vector<DescribedService>& services) {
  std::vector<std::string> texts;
  std::set<std::string> names;
  for (const auto& service : services)
    for (const auto& definition : service.types->definitions())
      if (names.insert(definition->name).second) texts.push_back(definition->text);
  const auto set = DefinitionSet::from_texts(texts, rr::RobdefMode::compat);
  if (!set.is_good()) {
    const auto first = std::ranges::find(set.diagnostics(), rr::Severity::error, &rr::Diagnostic::severity);
    return problem_response(503, "the device's definitions do not fit together: " + rr::format_diagnostic(*first));
  }
  return text_response(200, "application/typescript; charset=utf-8",
                       generate_typescript(set, TypeScriptFlavour::declarations));
}

}  // namespace

bool fits_beside(const DescribedService& service, const std::vector<DescribedService>& others) {
  for (const auto& other : others)
    for (const auto& definition : service.types->definitions())
      if (const auto* known = other.types->find_service(definition->name); known && known->text != definition->text)
        return false;
  return true;
}

Response device_document(std::string_view document, std::string_view device, const std::string& base,
                         const std::vector<DescribedService>& services, const std::vector<std::string>& unavailable) {
  if (document == "types.d.ts") return typescript(services);
  const auto places = places_of(base, services);
  auto schemas = schemas_of(services);
  OrderedJson out;
  std::string_view type = "application/json";
  if (document == "openapi.json") {
    out = open_api(device, places.members, std::move(schemas), unavailable);
  } else if (document == "asyncapi.json") {
    out = async_api(device, base, services, places.members, std::move(schemas));
  } else {
    out = thing_description(device, places.members, std::move(schemas));
    type = "application/td+json";
  }
  if (places.is_truncated) out["x-rr-truncated"] = true;
  return text_response(200, type, rr::write_json(out) + "\n");
}

}  // namespace rrgate
