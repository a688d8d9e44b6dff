#include "server/state/agent_subscriptions.hpp"

namespace rrgate {

rr::Result<AgentSubscriptions::SessionPtr> AgentSubscriptions::find_or_make(const std::string& session,
                                                                            const std::string& owner) {
  if (auto known = sessions_.visit(session)) return known;
  const auto too_many = [](std::size_t most, const std::string& whose) {
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          std::to_string(most) + " sessions" + whose + " have streams, which is all that there may be");
  };
  if (!sessions_.make_room(most_of_owner, [&](const Session& other) { return other.owner == owner; }))
    return too_many(most_of_owner, " of " + rr::quote(owner));
  if (!sessions_.make_room(most_sessions)) return too_many(most_sessions, "");
  return sessions_.add(session, {.owner = owner});
}

rr::Result<> AgentSubscriptions::add(const std::string& session, const std::string& owner, const std::string& uri) {
  const auto found = find_or_make(session, owner);
  if (!found) return found.error();
  auto& uris = (*found)->uris;
  if (uris.size() >= most_resources && !uris.contains(uri))
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "a session has at most " + std::to_string(most_resources) + " subscriptions");
  if (uris.insert(uri).second) ++(*found)->changes;
  return {};
}

void AgentSubscriptions::remove(const std::string& session, const std::string& uri) {
  const auto found = sessions_.find(session);
  if (found && found->uris.erase(uri) > 0) ++found->changes;
}

void AgentSubscriptions::end(const std::string& session) {
  sessions_.erase(session);
}

rr::Result<std::unique_ptr<AgentSubscriptions::Stream>> AgentSubscriptions::open_stream(const std::string& session,
                                                                                        const std::string& owner) {
  const auto found = find_or_make(session, owner);
  if (!found) return found.error();
  return std::make_unique<Stream>(*found);
}

}  // namespace rrgate
