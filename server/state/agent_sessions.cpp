#include "server/state/agent_sessions.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace rrgate {

std::shared_ptr<AgentCommand> AgentSession::begin_command(AgentCommand command) {
  ++commands;
  if (last_commands.size() >= kept_commands) last_commands.pop_front();
  return last_commands.emplace_back(std::make_shared<AgentCommand>(std::move(command)));
}

AgentSessionPtr AgentSessions::visit(const std::string& key, const std::string& user, const std::string& client) {
  auto& session = sessions_[key];
  if (session) {
    session->used = std::chrono::steady_clock::now();
    return session;
  }
  session = std::make_shared<AgentSession>();
  session->user = user;
  session->client = client;
  auto made = session;
  if (sessions_.size() > most_sessions) {
    const auto rank = [&](const auto& each) {
      return std::tuple(each.second == made, each.second->commands > 0, each.second->used);
    };
    sessions_.erase(std::min_element(sessions_.begin(), sessions_.end(),
                                     [&](const auto& a, const auto& b) { return rank(a) < rank(b); }));
  }
  return made;
}

void AgentSessions::end(const std::string& key) {
  if (const auto found = sessions_.find(key); found != sessions_.end()) found->second->has_ended = true;
}

std::vector<AgentSessionPtr> AgentSessions::list() const {
  std::vector<AgentSessionPtr> out;
  for (const auto& [key, session] : sessions_) out.push_back(session);
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a->used > b->used; });
  return out;
}

}  // namespace rrgate
