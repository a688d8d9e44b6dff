// What agents have subscribed to is bounded, and forgotten where nobody is told of it.
#include <catch2/catch.hpp>

#include "server/state/agent_subscriptions.hpp"

using rrgate::AgentSubscriptions;

TEST_CASE("a session's subscriptions are those that it has made and not ended") {
  AgentSubscriptions all;
  REQUIRE(all.add("a", "one").has_value());
  REQUIRE(all.add("a", "two").has_value());
  REQUIRE(all.add("b", "three").has_value());
  const auto stream = all.open_stream("a");
  REQUIRE(stream.has_value());
  const auto before = (*stream)->changes();
  REQUIRE(all.add("a", "two").has_value());
  CHECK((*stream)->changes() == before);
  all.remove("a", "one");
  all.remove("nobody", "one");
  CHECK((*stream)->changes() != before);
  CHECK((*stream)->uris() == std::set<std::string>{"two"});
  all.end("a");
  CHECK_FALSE(all.has("a"));
  CHECK(all.has("b"));
}

TEST_CASE("neither a session nor all of them have subscriptions without end") {
  AgentSubscriptions all;
  for (std::size_t i = 0; i < AgentSubscriptions::most_resources; ++i)
    REQUIRE(all.add("a", std::to_string(i)).has_value());
  CHECK(all.add("a", "0").has_value());
  const auto refused = all.add("a", "more");
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == rr::ErrorCode::out_of_system_resource);

  std::vector<std::unique_ptr<AgentSubscriptions::Stream>> streams;
  auto opened = all.open_stream("a");
  REQUIRE(opened.has_value());
  streams.push_back(std::move(*opened));
  REQUIRE(all.add("idle", "x").has_value());
  for (std::size_t i = 2; i < AgentSubscriptions::most_sessions; ++i) {
    opened = all.open_stream(std::to_string(i));
    REQUIRE(opened.has_value());
    streams.push_back(std::move(*opened));
  }
  REQUIRE(all.add("newcomer", "x").has_value());  // in the place of the one that nobody is told of
  CHECK_FALSE(all.has("idle"));
  opened = all.open_stream("newcomer");
  REQUIRE(opened.has_value());
  streams.push_back(std::move(*opened));
  CHECK_FALSE(all.open_stream("one too many").has_value());
  CHECK(all.has("a"));
  streams.pop_back();
  CHECK(all.open_stream("another").has_value());
}
