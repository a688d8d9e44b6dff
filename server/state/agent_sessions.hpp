// Agents that have been here, and what they have commanded, for people who look. Layer: server/state. See docs/mcp.md.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/state/agent_table.hpp"

namespace rrgate {

/// Texts are the agent's but for `detail`, and bounded by who writes them.
struct AgentCommand {
  enum class State : std::uint8_t { running, done, failed };

  std::chrono::steady_clock::time_point at = std::chrono::steady_clock::now();
  std::string tool = {};
  std::string device = {};
  std::string path = {};
  std::string values = {};  ///< JSON, as the agent gave them
  State state = State::running;
  std::string detail = {};  ///< why it failed
};

struct AgentSession {
  static constexpr std::size_t kept_commands = 20;

  std::string user = {};  ///< empty: anonymous
  std::string client = {};
  std::string program = {};  ///< what the agent calls itself
  std::chrono::steady_clock::time_point begun = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point used = begun;
  bool has_ended = false;
  std::uint64_t reads = 0;
  std::uint64_t commands = 0;
  std::deque<std::shared_ptr<AgentCommand>> last_commands = {};  ///< the oldest first

  std::shared_ptr<AgentCommand> begin_command(AgentCommand command);

  // For AgentTable.
  auto rank() const { return std::pair(commands > 0, used); }
  bool is_held() const { return false; }
};
using AgentSessionPtr = std::shared_ptr<AgentSession>;

/// The newest of them: who has commanded nothing is forgotten first, then who was here longest ago. For one thread.
class AgentSessions {
 public:
  static constexpr std::size_t most_sessions = 64;

  /// `key`  nobody else's. A session that had ended goes on.
  AgentSessionPtr visit(const std::string& key, const std::string& user, const std::string& client);
  /// It stays in the list.
  void end(const std::string& key);
  /// Who was here last comes first.
  std::vector<AgentSessionPtr> list() const;

 private:
  AgentTable<AgentSession> sessions_;
};

}  // namespace rrgate
