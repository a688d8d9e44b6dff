// Clients of a shared service: when there is a session with the device, whose it is, and who hears what.
#include "server/rr/shared_client.hpp"

#include "test/server/rr/shared_room.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

/// Knows vera, whose password is of no account.
class KnowsVera final : public rr::Authenticator {
 public:
  rr::Result<rr::AuthenticatedUser> authenticate(const rr::LoginAttempt& attempt) const override {
    if (attempt.username == "vera") return rr::AuthenticatedUser{.name = "vera"};
    return rr::make_error(rr::ErrorCode::authentication_error, "not here");
  }
};

/// A client that follows the wire "level".
struct Follower {
  std::shared_ptr<SharedClient> client;
  ConnectionPtr connection;
  std::vector<double> levels;
  bool is_closed = false;  ///< the wire, by the service

  explicit Follower(SharedRoom& room, Admit admit = nullptr) : connection(room.enter(std::move(admit), &client)) {
    const auto joined = room.answer([&](auto done) {
      connection->connect_wire(
          "bench", "level", [this](const rr::Value& value, rr::TimeSpec) { levels.push_back(*value.to<double>()); },
          done);
    });
    REQUIRE(joined.has_value());
    connection->on_wire_closed("bench", "level", [this] { is_closed = true; });
  }
  bool has(double level) const { return !levels.empty() && levels.back() == level; }
};

}  // namespace

TEST_CASE("the first client has the session with the device opened, others share it, and it rests behind the last") {
  SharedRoom room;
  const auto first = room.enter();
  const auto session = room.upstream()->connection();
  const auto second = room.enter();
  CHECK(room.upstream()->connection() == session);
  first->disconnect();
  REQUIRE(room.run_until([&] { return room.left == 1; }));
  CHECK(room.answer([&](auto done) { second->get("bench", "number", done); }).value().to<std::int32_t>().value() == 1);
  CHECK(room.upstream()->connection() == session);
  second->disconnect();
  CHECK(room.run_until([&] { return room.upstream()->is_resting(); }));
  CHECK(room.left == 2);
  CHECK(room.service->clients().empty());
}

TEST_CASE("a login that the device refuses leaves nothing behind") {
  SharedRoom room({.authenticator = std::make_shared<KnowsVera>()});
  const auto other = room.enter();
  const auto refused = room.come("mallory");
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == rr::ErrorCode::authentication_error);
  REQUIRE(room.run_until([&] { return room.left == 1; }));
  CHECK(room.service->clients().size() == 1);
}

TEST_CASE("while the device is away its clients stay, their requests fail, and their wires go on when it is back") {
  SharedRoom room;
  Follower follower(room);
  room.device.service->set_wire("level", rr::Value(1.5));
  REQUIRE(room.run_until([&] { return follower.has(1.5); }));
  cut(room.bench, room.upstream());
  const auto failed = room.answer([&](auto done) { follower.connection->get("bench", "number", done); });
  REQUIRE_FALSE(failed.has_value());
  CHECK(failed.error().code == rr::ErrorCode::connection_error);
  CHECK_THAT(failed.error().message, Catch::Contains("the line was cut"));
  CHECK(room.left == 0);
  room.device.service->set_wire("level", rr::Value(2.5));
  CHECK(room.run_until([&] {
    room.upstream()->retry_now();
    return follower.has(2.5);
  }));
  CHECK_FALSE(follower.is_closed);
  CHECK(room.answer([&](auto done) { follower.connection->get("bench", "number", done); }).has_value());
}

TEST_CASE("a wire that a client has no right to any more is closed for that client alone") {
  SharedRoom room;
  bool is_taken_away = false;
  const Admit admit = [&](const rr::MemberAccess& wanted) -> rr::Result<> {
    if (!is_taken_away || !wanted.member || wanted.member->name != "level") return {};
    return rr::make_error(rr::ErrorCode::permission_denied, "not any more");
  };
  Follower lost(room, admit);
  Follower other(room);
  room.device.service->set_wire("level", rr::Value(1.5));
  REQUIRE(room.run_until([&] { return lost.has(1.5) && other.has(1.5); }));
  is_taken_away = true;
  for (const auto& follower : {&lost, &other}) follower->client->review();
  REQUIRE(room.run_until([&] { return lost.is_closed; }));
  room.device.service->set_wire("level", rr::Value(2.5));
  REQUIRE(room.run_until([&] { return other.has(2.5); }));
  CHECK(lost.has(1.5));
  CHECK_FALSE(other.is_closed);
}

TEST_CASE("what a client asks is answered to that client, and when it leaves what it has opened ends") {
  SharedRoom room;
  const auto leaving = room.enter();
  const auto staying = room.enter();
  const std::vector<rr::Value> none;
  const auto open = [&](const ConnectionPtr& by) {
    return room.answer([&](auto done) { by->open_generator("bench", "count", none, done); });
  };
  REQUIRE(open(leaving).has_value());
  const auto kept = open(staying);
  REQUIRE(kept.has_value());
  CHECK(room.device.open_generators() == 2);
  leaving->disconnect();
  CHECK(room.run_until([&] { return room.device.open_generators() == 1; }));
  const auto index = kept->to<std::int32_t>().value();
  const auto next =
      room.answer([&](auto done) { staying->next_generator("bench", "count", index, std::nullopt, done); });
  REQUIRE(next.has_value());
  CHECK(next->to<std::int32_t>().value() == 1);
}
