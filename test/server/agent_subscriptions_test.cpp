// What agents have subscribed to is bounded, and forgotten where nobody is told of it.
#include <catch2/catch_test_macros.hpp>

#include "server/state/agent_subscriptions.hpp"

using rrgate::AgentSubscriptions;

TEST_CASE("a session's subscriptions are those that it has made and not ended") {
  AgentSubscriptions all;
  REQUIRE(all.add("a", "one"));
  REQUIRE(all.add("a", "two"));
  REQUIRE(all.add("b", "three"));
  const auto stream = all.open_stream("a");
  REQUIRE(stream);
  const auto before = (*stream)->changes();
  REQUIRE(all.add("a", "two"));
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
  for (std::size_t i = 0; i < AgentSubscriptions::most_resources; ++i) REQUIRE(all.add("a", std::to_string(i)));
  CHECK(all.add("a", "0"));
  const auto refused = all.add("a", "more");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == rr::ErrorCode::out_of_system_resource);

  std::vector<std::unique_ptr<AgentSubscriptions::Stream>> streams;
  auto opened = all.open_stream("a");
  REQUIRE(opened);
  streams.push_back(std::move(*opened));
  REQUIRE(all.add("idle", "x"));
  for (std::size_t i = 2; i < AgentSubscriptions::most_sessions; ++i) {
    opened = all.open_stream(std::to_string(i));
    REQUIRE(opened);
    streams.push_back(std::move(*opened));
  }
  REQUIRE(all.add("newcomer", "x"));  // in the place of the one that nobody is told of
  CHECK_FALSE(all.has("idle"));
  opened = all.open_stream("newcomer");
  REQUIRE(opened);
  streams.push_back(std::move(*opened));
  CHECK_FALSE(all.open_stream("one too many"));
  CHECK(all.has("a"));
  streams.pop_back();
  CHECK(all.open_stream("another"));
}
