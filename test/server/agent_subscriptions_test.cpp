// What agents have subscribed to is bounded, and forgotten where nobody is told of it.
#include <catch2/catch.hpp>

#include "server/state/agent_subscriptions.hpp"

using rrgate::AgentSubscriptions;

namespace {

/// Each of which has as many sessions as it may have.
std::string owner_of(std::size_t session) {
  return "owner " + std::to_string(session / AgentSubscriptions::most_of_owner);
}

}  // namespace

TEST_CASE("a session's subscriptions are those that it has made and not ended") {
  AgentSubscriptions all;
  REQUIRE(all.add("a", "vera", "one").has_value());
  REQUIRE(all.add("a", "vera", "two").has_value());
  REQUIRE(all.add("b", "vera", "three").has_value());
  const auto stream = all.open_stream("a", "vera");
  REQUIRE(stream.has_value());
  const auto before = (*stream)->changes();
  REQUIRE(all.add("a", "vera", "two").has_value());
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
    REQUIRE(all.add("a", "vera", std::to_string(i)).has_value());
  CHECK(all.add("a", "vera", "0").has_value());
  const auto refused = all.add("a", "vera", "more");
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == rr::ErrorCode::out_of_system_resource);

  std::vector<std::unique_ptr<AgentSubscriptions::Stream>> streams;
  auto opened = all.open_stream("a", "vera");
  REQUIRE(opened.has_value());
  streams.push_back(std::move(*opened));
  REQUIRE(all.add("idle", "last", "x").has_value());
  for (std::size_t i = 2; i < AgentSubscriptions::most_sessions; ++i) {
    opened = all.open_stream(std::to_string(i), owner_of(i));
    REQUIRE(opened.has_value());
    streams.push_back(std::move(*opened));
  }
  REQUIRE(all.add("newcomer", "last", "x").has_value());  // in the place of the one that nobody is told of
  CHECK_FALSE(all.has("idle"));
  opened = all.open_stream("newcomer", "last");
  REQUIRE(opened.has_value());
  streams.push_back(std::move(*opened));
  CHECK_FALSE(all.open_stream("one too many", "nobody").has_value());
  CHECK(all.has("a"));
  streams.pop_back();
  CHECK(all.open_stream("another", "last").has_value());
}

TEST_CASE("one owner of many sessions leaves room to others") {
  AgentSubscriptions all;
  std::vector<std::unique_ptr<AgentSubscriptions::Stream>> streams;
  for (std::size_t i = 0; i < AgentSubscriptions::most_of_owner; ++i) {
    auto opened = all.open_stream(std::to_string(i), "vera");
    REQUIRE(opened.has_value());
    streams.push_back(std::move(*opened));
  }
  const auto refused = all.open_stream("one too many", "vera");
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == rr::ErrorCode::out_of_system_resource);
  CHECK(all.open_stream("0", "vera").has_value());  // it is there
  CHECK(all.open_stream("other", "alice").has_value());
  streams.pop_back();
  CHECK(all.open_stream("in its place", "vera").has_value());
  CHECK(all.has("other"));
}
