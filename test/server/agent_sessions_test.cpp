// Which agents have been here, and what they have commanded.
#include <algorithm>
#include <catch2/catch.hpp>

#include "server/state/agent_sessions.hpp"

using namespace rrgate;

TEST_CASE("agents: a session keeps its newest commands and counts them all") {
  AgentSessions all;
  const auto session = all.visit("a", "vera", "10.0.0.5");
  CHECK(all.visit("a", "vera", "10.0.0.5") == session);
  for (std::size_t i = 0; i < AgentSession::kept_commands + 5; ++i)
    session->begin_command({.tool = "call", .path = std::to_string(i)});
  CHECK(session->commands == AgentSession::kept_commands + 5);
  REQUIRE(session->last_commands.size() == AgentSession::kept_commands);
  CHECK(session->last_commands.front()->path == "5");
  CHECK(session->last_commands.back()->state == AgentCommand::State::running);
  all.end("a");
  all.end("nobody");
  REQUIRE(all.list().size() == 1);
  CHECK(all.list().front()->has_ended);
}

TEST_CASE("agents: a session that is used again after its end has not ended") {
  AgentSessions all;
  const auto session = all.visit("a", "vera", "10.0.0.5");
  all.end("a");
  REQUIRE(session->has_ended);
  CHECK(all.visit("a", "vera", "10.0.0.5") == session);
  CHECK_FALSE(session->has_ended);
}

TEST_CASE("agents: strangers without end push out nobody who has commanded something") {
  AgentSessions all;
  const auto first = all.visit("first", "vera", "10.0.0.5");
  first->begin_command({.tool = "stop"});
  const auto idle = all.visit("idle", "", "10.0.0.6");
  for (std::size_t i = 0; i < 2 * AgentSessions::most_sessions; ++i)
    all.visit("stranger " + std::to_string(i), "", "10.0.0.7");
  const auto list = all.list();
  REQUIRE(list.size() == AgentSessions::most_sessions);
  CHECK(std::count(list.begin(), list.end(), first) == 1);
  CHECK(std::count(list.begin(), list.end(), idle) == 0);
  CHECK(list.front()->client == "10.0.0.7");
  for (std::size_t i = 0; i < 2 * AgentSessions::most_sessions; ++i)
    all.visit("busy " + std::to_string(i), "", "10.0.0.8")->begin_command({.tool = "call"});
  const auto busy = all.list();
  CHECK(busy.size() == AgentSessions::most_sessions);
  CHECK(std::count(busy.begin(), busy.end(), first) == 0);
}
