// Transcripts of the gateway's locks: who asks, what the device is asked for, and what it says.
#pragma once

#include <catch2/catch.hpp>

#include "server/upstream/lock_table.hpp"

namespace rrgate::test {

inline constexpr LockSession shared = 1;  ///< the gateway's own session with the device
inline constexpr LockSession alices = 2;
inline constexpr LockSession alices_other = 3;
inline constexpr LockSession roots = 4;

struct Transcript {
  LockTable table;
  rr::TimePoint now{std::chrono::seconds(1000)};
  rr::LockRequestId last_request = 0;

  LockClient shares(LockClient client, const std::string& user = {}) {
    table.add(client, {user.empty() ? Subject() : Subject{Subject::Kind::user, user}, shared, false});
    return client;
  }
  LockClient has_own(LockClient client, std::string user, LockSession session) {
    table.add(client, {Subject{Subject::Kind::device_user, std::move(user)}, session, true});
    return client;
  }

  void wants(LockClient client, rr::LockCommand command, std::string path = "s",
             std::chrono::milliseconds timeout = std::chrono::milliseconds(-1)) {
    table.handle_wanted(client, {++last_request, command, std::move(path), timeout}, now);
  }
  template <class Event>
  Event next() {
    auto event = table.poll_event();
    REQUIRE(event);
    REQUIRE(std::holds_alternative<Event>(*event));
    return std::get<Event>(std::move(*event));
  }
  std::uint64_t asked(rr::LockCommand command, LockSession session = shared, std::string path = "s") {
    const auto event = next<LockAsked>();
    CHECK(event.command == command);
    CHECK(event.session == session);
    CHECK(event.path == path);
    return event.id;
  }
  void device_says(std::uint64_t ask, rr::ErrorCode code = rr::ErrorCode::none,
                   std::string why = "the device says no") {
    table.handle_answer(ask, code == rr::ErrorCode::none ? rr::Result<>() : rr::make_error(code, std::move(why)), now);
  }
  void answered(LockClient client, rr::ErrorCode code = rr::ErrorCode::none) {
    const auto event = next<LockAnswered>();
    CHECK(event.client == client);
    CHECK((event.result ? rr::ErrorCode::none : event.result.error().code) == code);
  }
  void left(LockClient client) { CHECK(next<LockClientLeft>().client == client); }
  void nothing_more() { CHECK_FALSE(table.poll_event()); }

  /// The whole way to a lock that is held.
  void takes(LockClient client, rr::LockCommand command, LockSession session = shared, std::string path = "s") {
    wants(client, command, path);
    const bool is_shared = session == shared && command == rr::LockCommand::lock_for_user;
    device_says(asked(is_shared ? rr::LockCommand::lock_for_client : command, session, path));
    answered(client);
  }
  rr::ErrorCode use(LockClient client, std::string_view path = "s", bool is_exempt = false) {
    const auto allowed = table.check(client, path, is_exempt, now);
    return allowed ? rr::ErrorCode::none : allowed.error().code;
  }
  bool may(LockClient client, std::string_view path = "s", bool is_exempt = false) {
    return use(client, path, is_exempt) == rr::ErrorCode::none;
  }
};

}  // namespace rrgate::test
