#include "server/state/agent_sessions.hpp"

#include <algorithm>
#include <utility>

namespace rrgate {

std::shared_ptr<AgentCommand> AgentSession::begin_command(AgentCommand command) {
  ++commands;
  if (last_commands.size() >= kept_commands) last_commands.pop_front();
  return last_commands.emplace_back(std::make_shared<AgentCommand>(std::move(command)));
}

AgentSessionPtr AgentSessions::visit(const std::string& key, const std::string& user, const std::string& client) {
  if (auto known = sessions_.visit(key)) {
    known->has_ended = false;
    return known;
  }
  sessions_.make_room(most_sessions);
  return sessions_.add(key, {.user = user, .client = client});
}

void AgentSessions::end(const std::string& key) {
  if (const auto found = sessions_.find(key)) found->has_ended = true;
}

std::vector<AgentSessionPtr> AgentSessions::list() const {
  auto out = sessions_.all();
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a->used > b->used; });
  return out;
}

}  // namespace rrgate
