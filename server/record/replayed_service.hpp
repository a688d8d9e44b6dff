// A recorded service, served again. Layer: server/record.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "node/service/service.hpp"
#include "server/record/recording.hpp"

namespace rrgate {

/// The members that were recorded: wires, pipes and events send, properties can be read. Others answer that this is a
/// replay.
class ReplayedService {
 public:
  /// Errors   data_serialization_error: definitions, objects and members of the recording that do not go together.
  static rr::Result<ReplayedService> make(const Recording& recording, const RecordedService& recorded);

  const std::shared_ptr<rr::Service>& service() const { return service_; }
  bool has(std::uint16_t channel) const { return members_.contains(channel); }
  /// `channel`  one that it has. `sent`  the time of wires.
  /// Errors   those of value_from_json().
  rr::Result<> play(std::uint16_t channel, const rr::Json& document, rr::TimeSpec sent);
  /// `channel`  of a wire or property that it has: it has no value again.
  void forget(std::uint16_t channel);

 private:
  struct Member {
    std::shared_ptr<rr::Object> owner;  ///< null: of the service's root
    rr::Object* object = nullptr;
    const rr::MemberDefinition* definition = nullptr;
    std::shared_ptr<std::optional<rr::Value>> property;
  };
  void add_objects(const RecordedService& recorded);
  void add_member(const RecordedMember& member);

  std::shared_ptr<rr::Service> service_;
  std::map<std::string, std::shared_ptr<rr::Object>> objects_;  ///< by path; without the root
  std::map<std::uint16_t, Member> members_;
};

}  // namespace rrgate
