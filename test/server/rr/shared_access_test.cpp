// Rights of one session with a shared device: which count, what they are asked of, and what is told of what is missing.
#include "server/rr/shared_access.hpp"

#include "core/session/service/service_index.hpp"
#include "test/server/rr/shared_room.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

AccessConfig rules_for(const std::string& role) {
  AccessConfig out;
  out.anonymous_role = role;
  out.rules = {AccessRule{.roles = {"viewer"}, .devices = {"device"}, .may = {Verb::read, Verb::subscribe}},
               AccessRule{.roles = {"operator"}, .devices = {"device"}, .may = {Verb::read, Verb::write, Verb::call}}};
  return out;
}

struct Asking {
  SharedRoom room;
  SessionRights rights;

  /// `role`  of who has shown nothing.
  explicit Asking(const std::string& role)
      : room({}, rules_for(role)),
        rights(room.access, room.node, {},
               std::make_shared<Standing>(room.access, room.access.anonymous("192.0.2.1:1"))) {}

  rr::ErrorCode of(rr::EntryType type, const std::string& member = {}, const std::string& path = "bench") {
    const auto* entity = room.upstream()->types()->find_entity("test.bench.Bench");
    const auto* definition = member.empty() ? nullptr : entity->find_member(member);
    REQUIRE(member.empty() == !definition);
    const auto admitted = rights.admit({type, path, definition, nullptr}, false);
    return admitted ? rr::ErrorCode::none : admitted.error().code;
  }
};

}  // namespace

TEST_CASE("what a session asks for is judged by the right that it needs") {
  using enum rr::EntryType;
  constexpr auto granted = rr::ErrorCode::none, denied = rr::ErrorCode::permission_denied;
  const bool is_operator = GENERATE(false, true);
  Asking asking(is_operator ? "operator" : "viewer");
  const auto commands = is_operator ? granted : denied, streams = is_operator ? denied : granted;
  CHECK(asking.of(property_get_req, "number") == granted);
  CHECK(asking.of(property_set_req, "number") == commands);
  CHECK(asking.of(function_call_req, "stop") == commands);
  CHECK(asking.of(generator_next_req, "count") == commands);
  CHECK(asking.of(wire_packet, "wish") == commands);
  CHECK(asking.of(wire_connect_req, "wish") == commands);
  CHECK(asking.of(wire_connect_req, "level") == streams);
  CHECK(asking.of(pipe_connect_req, "news") == streams);
  CHECK(asking.of(event_req, "struck") == streams);
  CHECK(asking.of(callback_call_req, "ask") == streams);
  CHECK(asking.rights.admit_lock("bench", nullptr, Recorded::never).error().code == denied);
}

TEST_CASE("a session without a right to the device may connect to the index alone") {
  using enum rr::EntryType;
  Asking asking("nobody");
  const std::string index(rr::service_index_name);
  CHECK(asking.of(connect_client, {}, index) == rr::ErrorCode::none);
  CHECK(asking.of(connect_client) == rr::ErrorCode::permission_denied);
  CHECK(asking.of(get_service_desc) == rr::ErrorCode::permission_denied);
  CHECK(asking.of(property_get_req, "number") == rr::ErrorCode::permission_denied);
  CHECK(asking.of(get_service_desc, {}, "other") == rr::ErrorCode::permission_denied);  // nor hear what is not there
}

TEST_CASE("whoever may see something of the gateway's node hears that a service is not there") {
  Asking asking("viewer");
  CHECK(asking.of(rr::EntryType::get_service_desc, {}, "other") == rr::ErrorCode::none);
}

TEST_CASE("a session hears once that its rights may have changed, and again when somebody else has logged in") {
  Asking asking("viewer");
  CHECK(asking.rights.have_changed(nullptr));
  CHECK_FALSE(asking.rights.have_changed(nullptr));
  const rr::AuthenticatedUser vera{.name = "vera"};
  CHECK(asking.rights.have_changed(&vera));
  CHECK_FALSE(asking.rights.have_changed(&vera));
  CHECK(asking.rights.have_changed(nullptr));
}

TEST_CASE("a user of the device's has the rights that the connection has shown, and no others") {
  Asking asking("viewer");
  const rr::AuthenticatedUser operator_there{.name = "operator", .privileges = {"operator"}};
  const auto* bench = asking.room.upstream()->types()->find_entity("test.bench.Bench");
  const auto admits = [&](rr::EntryType type) {
    return asking.rights.admit({type, "bench", bench->find_member("number"), &operator_there}, false).has_value();
  };
  CHECK(admits(rr::EntryType::property_get_req));
  CHECK_FALSE(admits(rr::EntryType::property_set_req));
}
