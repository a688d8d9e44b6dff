#include "server/http/endpoints/device_places.hpp"

#include <algorithm>
#include <map>

#include "core/session/url.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

using rr::add_key;
using rr::OrderedJson;

namespace {

/// Of a document, about: some 3,000 members. It is made on the gateway's thread, and kept.
constexpr std::size_t most_bytes = 1 << 20;
/// What a member takes there by itself, and each of its parameters.
constexpr std::size_t about_bytes_a_part = 256;

/// Many objrefs to few types make many paths.
class PlaceWalk {
 public:
  void reserve_id(const std::string& id) { ++members_of_id_[id]; }
  void add_service(const std::string& base, const DescribedService& service) {
    const auto* root = service.types->find_entity(service.root_type);
    if (!root) return;
    add_members(*root,
                {&service, nullptr, base + "/" + rr::percent_encode(service.name), service.name, {}, service.name});
  }
  Places take() { return std::move(out_); }

 private:
  void add_members(const rr::EntityDefinition& type, const DocumentedMember& object) {
    chain_.push_back(&type);
    for (const auto& member : type.members) {
      DocumentedMember place = object;
      place.member = &member;
      place.path += "/" + member.name;
      place.id += "_" + member.name;
      if (!spend(place)) break;
      if (member.kind == rr::MemberKind::objref)
        add_object(member, std::move(place));
      else
        add_member(std::move(place));
    }
    chain_.pop_back();
  }

  /// Names never end in '_': what is appended makes the id of no other member.
  void add_member(DocumentedMember place) {
    const auto members_before = members_of_id_[place.id]++;
    place.id.append(members_before, '_');
    out_.members.push_back(std::move(place));
  }

  void add_object(const rr::MemberDefinition& member, DocumentedMember place) {
    const auto* target = place.service->types->find_entity(member.type.qualified_name);
    if (!target || std::find(chain_.begin(), chain_.end(), target) != chain_.end()) return;
    place.object_path += "." + member.name;
    if (member.is_indexed()) {
      auto name = member.name;
      while (std::find(place.indices.begin(), place.indices.end(), name) != place.indices.end()) name += "_";
      place.path += "/{" + name + "}";
      place.object_path += "[{" + name + "}]";
      place.indices.push_back(name);
    }
    add_members(*target, place);
  }

  /// False: the documents are as large as they get.
  bool spend(const DocumentedMember& place) {
    const auto size = about_bytes_a_part * (1 + place.member->parameters.size() + place.indices.size()) +
                      place.path.size() + place.member->documentation.size();
    if (size > left_) out_.is_truncated = true;
    if (out_.is_truncated) return false;
    left_ -= size;
    return true;
  }

  Places out_;
  std::map<std::string, std::size_t> members_of_id_;
  std::vector<const rr::EntityDefinition*> chain_;
  std::size_t left_ = most_bytes;
};

}  // namespace

Places places_of(const std::string& base, const std::vector<DescribedService>& services) {
  PlaceWalk walk;
  for (const auto& service : services) walk.reserve_id(socket_id(service));
  for (const auto& service : services) walk.add_service(base, service);
  return walk.take();
}

std::string socket_id(const DescribedService& service) {
  return "socket_" + service.name;
}

OrderedJson schemas_of(const std::vector<DescribedService>& services) {
  auto out = OrderedJson::object();
  for (const auto& service : services) {
    auto schemas = rr::named_type_schemas(*service.types);
    for (auto& [name, schema] : schemas.items())
      if (!out.contains(name)) add_key(out, name) = std::move(schema);
  }
  return out;
}

void add_info(OrderedJson& out, std::string_view device) {
  out["info"] = {{"title", std::string(device)},
                 {"version", "1"},
                 {"description", "Objects of a Robot Raconteur node, told from its service definitions."}};
}

}  // namespace rrgate
