#include "server/record/replayed_service.hpp"

#include <stdexcept>

#include "core/session/service_path.hpp"
#include "server/json/arguments.hpp"

namespace rrgate {

namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument(what);
}

const rr::EntityDefinition& type_of(const rr::Service& service, const rr::Object& object) {
  return *service.types().find_entity(object.type_name());
}

}  // namespace

rr::Result<ReplayedService> ReplayedService::make(const Recording& recording, const RecordedService& recorded) {
  ReplayedService out;
  try {
    out.service_ =
        rr::Service::from_text(recorded.definitions, recorded.service, recorded.type, rr::RobdefMode::compat);
    out.service_->serve_partly("is not in the recording: this is a replay of " + recording.name());
    out.add_objects(recorded);
    for (const auto& [channel, member] : recording.members())
      if (member.service == recorded.label) out.add_member(member);
  } catch (const std::invalid_argument& problem) {
    return rr::make_error(rr::ErrorCode::data_serialization_error,
                          recording.name() + ": service " + rr::quote(recorded.label) + ": " + problem.what());
  }
  return out;
}

/// Parents come before their children: a path begins with its parent's.
void ReplayedService::add_objects(const RecordedService& recorded) {
  using Children = std::map<std::string, std::shared_ptr<rr::Object>, std::less<>>;
  std::map<std::pair<rr::Object*, std::string>, std::shared_ptr<Children>> lists;
  for (const auto& [path, type] : recorded.objects) {
    const auto segments = rr::parse_service_path(path);
    if (!segments || segments->empty()) refuse("object " + rr::quote(path) + ": is no path");
    if (segments->size() == 1) continue;  // the root
    const auto& last = segments->back();
    std::string parent_path = segments->front().name;
    for (std::size_t i = 1; i + 1 < segments->size(); ++i)
      parent_path = rr::child_path(parent_path, (*segments)[i].name, (*segments)[i].index);
    const auto found = objects_.find(parent_path);
    if (segments->size() > 2 && found == objects_.end())
      refuse("object " + rr::quote(path) + ": " + rr::quote(parent_path) + " is not in the recording");
    auto& parent = segments->size() == 2 ? service_->root() : *found->second;
    auto object = service_->make_object(type);
    objects_[path] = object;
    if (!last.index) {
      parent.objref(last.name, object);
      continue;
    }
    auto& list = lists[{&parent, last.name}];
    if (!list) {
      list = std::make_shared<Children>();
      parent.objref(last.name, [list](std::string_view index) {
        const auto child = list->find(index);
        return child == list->end() ? nullptr : child->second;
      });
    }
    list->emplace(*last.index, std::move(object));
  }
}

void ReplayedService::add_member(const RecordedMember& member) {
  Member out;
  const auto object = objects_.find(member.object);
  if (object != objects_.end()) out.owner = object->second;
  if (!out.owner && member.object != service_->name())
    refuse(member.topic + ": object " + rr::quote(member.object) + " is not in the recording");
  out.object = out.owner ? out.owner.get() : &service_->root();
  const auto& type = type_of(*service_, *out.object);
  out.definition = type.find_member(member.member);
  if (!out.definition || out.definition->kind != member.kind)
    refuse(member.topic + ": " + type.qualified_name + " has no " + std::string(rr::member_kind_name(member.kind)) +
           " " + rr::quote(member.member));
  if (member.kind == rr::MemberKind::property) {
    out.property = std::make_shared<std::optional<rr::Value>>();
    out.object->property(member.member).get([value = out.property, name = member.member]() -> rr::Value {
      if (*value) return **value;
      throw rr::ServiceException("property " + rr::quote(name) + " has no value yet in this replay",
                                 rr::ErrorCode::value_not_set);
    });
  }
  members_.emplace(member.channel, std::move(out));
}

rr::Result<> ReplayedService::play(std::uint16_t channel, const rr::Json& document, rr::TimeSpec sent) {
  const auto& member = members_.at(channel);
  const auto& definition = *member.definition;
  try {
    if (definition.kind == rr::MemberKind::event) {
      const auto arguments = rr::arguments_from_json(document, definition, service_->types(), {});
      if (!arguments) return arguments.error();
      member.object->fire_values(definition.name, *arguments);
      return {};
    }
    auto value = rr::value_from_json(document.at("value"), definition.type, service_->types(), {}, definition.name);
    if (!value) return value.error();
    if (definition.kind == rr::MemberKind::wire)
      member.object->set_wire(definition.name, std::move(*value), sent);
    else if (definition.kind == rr::MemberKind::pipe)
      member.object->pipe(definition.name).broadcast(*value);
    else
      *member.property = std::move(*value);
    return {};
  } catch (const std::invalid_argument& problem) {
    return rr::make_error(rr::ErrorCode::data_serialization_error, problem.what());
  }
}

void ReplayedService::forget(std::uint16_t channel) {
  const auto& member = members_.at(channel);
  if (member.property)
    member.property->reset();
  else
    member.object->reset_wire(member.definition->name);
}

}  // namespace rrgate
