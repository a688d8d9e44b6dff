#include "server/state/agent_subscriptions.hpp"

#include <algorithm>
#include <utility>

namespace rrgate {

rr::Result<std::shared_ptr<AgentSubscriptions::Session>> AgentSubscriptions::find_or_make(const std::string& session) {
  const auto now = std::chrono::steady_clock::now();
  if (const auto found = sessions_.find(session); found != sessions_.end()) {
    found->second->used = now;
    return found->second;
  }
  if (sessions_.size() >= most_sessions) {
    const auto oldest = std::min_element(sessions_.begin(), sessions_.end(), [](const auto& a, const auto& b) {
      return std::pair(a.second->streams, a.second->used) < std::pair(b.second->streams, b.second->used);
    });
    if (oldest->second->streams > 0)
      return rr::make_error(rr::ErrorCode::out_of_system_resource,
                            std::to_string(most_sessions) + " sessions have streams, which is all that there may be");
    sessions_.erase(oldest);
  }
  auto made = std::make_shared<Session>();
  made->used = now;
  sessions_[session] = made;
  return made;
}

rr::Result<> AgentSubscriptions::add(const std::string& session, const std::string& uri) {
  const auto found = find_or_make(session);
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
  if (found != sessions_.end() && found->second->uris.erase(uri) > 0) ++found->second->changes;
}

void AgentSubscriptions::end(const std::string& session) {
  sessions_.erase(session);
}

rr::Result<std::unique_ptr<AgentSubscriptions::Stream>> AgentSubscriptions::open_stream(const std::string& session) {
  const auto found = find_or_make(session);
  if (!found) return found.error();
  return std::make_unique<Stream>(*found);
}

}  // namespace rrgate
