#include "server/http/endpoints/device_documents.hpp"

#include <set>

#include "node/generate/definition_set.hpp"
#include "node/generate/generate_typescript.hpp"
#include "server/http/endpoints/device_places.hpp"

namespace rrgate {

using rr::OrderedJson;

namespace {

std::string typescript(const std::vector<DescribedService>& services) {
  std::vector<std::string> texts;
  std::set<std::string> names;
  for (const auto& service : services)
    for (const auto& definition : service.types->definitions())
      if (names.insert(definition->name).second) texts.push_back(definition->text);
  const auto set = DefinitionSet::from_texts(texts, rr::RobdefMode::compat);
  return generate_typescript(set, TypeScriptFlavour::declarations);
}

}  // namespace

Response device_document(std::string_view document, std::string_view device, const std::string& base,
                         const std::vector<DescribedService>& services, const std::vector<std::string>& unavailable) {
  if (document == "types.d.ts")
    return text_response(200, "application/typescript; charset=utf-8", typescript(services));
  const auto places = places_of(base, services);
  auto schemas = schemas_of(services);
  OrderedJson out;
  std::string_view type = "application/json";
  if (document == "openapi.json") {
    out = open_api(device, places, std::move(schemas), unavailable);
  } else if (document == "asyncapi.json") {
    out = async_api(device, base, services, places, std::move(schemas));
  } else {
    out = thing_description(device, places, std::move(schemas));
    type = "application/td+json";
  }
  return text_response(200, type, rr::write_json(out) + "\n");
}

}  // namespace rrgate
