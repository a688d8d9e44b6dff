// Requests of access: an unknown client asks, an admin decides, the client fetches its token. Layer: server/access.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rrgate {

enum class RequestState : std::uint8_t { pending, approved, denied };
std::string_view to_string(RequestState state);

struct RequestOfAccess {
  std::string id;
  std::string name;    ///< what the token shall be called, as the client says
  std::string reason;  ///< as the client says
  std::string client;  ///< where from
  RequestState state = RequestState::pending;
  std::chrono::system_clock::time_point asked;
};

/// Few at a time, and each for an hour. Where there are so many that no other fits, the oldest that was denied gives
/// way; where none was, a site that has more that wait than the one that asks would have gives up its oldest.
class AccessRequests {
 public:
  using Time = std::chrono::system_clock::time_point;
  static constexpr std::chrono::minutes lifetime{60};

  struct Asked {
    std::string id;
    std::string secret;  ///< to fetch the answer with
  };
  /// `address`  as what the client counts, see network_name(); it may have three open requests.
  /// Errors   invalid_argument: a name that no token can have, a long reason; out_of_system_resource: too many.
  rr::Result<Asked> ask(std::string name, std::string reason, std::string client, std::string address, Time now);

  std::vector<RequestOfAccess> list(Time now);
  /// Errors   resource_not_found; invalid_state: it was decided already.
  rr::Result<RequestOfAccess> find_pending(const std::string& id, Time now);
  /// `token`  empty: denied. The request is pending.
  void decide(const std::string& id, std::string token);

  struct Answer {
    RequestState state = RequestState::pending;
    std::string token = {};  ///< of an approved request, the first time that it is asked for
  };
  /// Errors   resource_not_found: unknown, too old, or the secret is of another.
  rr::Result<Answer> claim(const std::string& id, std::string_view secret, Time now);

 private:
  struct Entry {
    RequestOfAccess request;
    std::string address;
    rr::Bytes secret_hash;
    std::string token;
  };
  void forget_old(Time now);
  /// Whether there is room for one more of this site, now that one that was denied, or the oldest of another site, may
  /// have gone.
  bool make_room(const std::string& site);

  static constexpr std::size_t max_requests = 100;
  static constexpr std::size_t max_of_address = 3;
  static constexpr std::size_t max_reason = 500;

  std::map<std::string, Entry> entries_;
};

}  // namespace rrgate
