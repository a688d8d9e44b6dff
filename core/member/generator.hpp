// Generator functions: what their steps say, and the generators that one client of a service runs. Layer: member.
// Source: sessions spec section 2.10.
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/time.hpp"
#include "core/types/pack.hpp"

namespace rr {

enum class GeneratorStep : std::uint8_t { next, close, abort };

/// What a GeneratorNextReq asks for: its Error field says it. Error 109 closes, every other one aborts.
GeneratorStep generator_step(const MessageEntry& entry);

/// Adds / reads `index`, in the reply to the call and in every step.
/// Errors   message_element_not_found, data_type_mismatch.
void write_generator_index(Message& message, std::int32_t index);
Result<std::int32_t> read_generator_index(const Message& message, const MessageEntry& entry,
                                          const MemberDefinition& function);

/// The elements of a step. `parameter` is for `next`: there where the generator takes one, and only then.
/// Errors   invalid_argument: a parameter too many or too few; those of pack().
Result<> write_generator_step(Message& message, GeneratorStep step, std::int32_t index,
                              const std::optional<Value>& parameter, const MemberDefinition& function,
                              const TypeRegistry& types);

/// The parameter of a step; none where the generator takes none.
/// Errors   message_element_not_found; those of unpack().
Result<std::optional<Value>> read_generator_parameter(const Message& message, const MessageEntry& entry,
                                                      const MemberDefinition& function, const TypeRegistry& types);

/// The `return` of a step. `next` of a generator without return values, close and abort return int32 0, which is not
/// interpreted: it reads as null.
Result<> write_generator_return(Message& message, GeneratorStep step, const Value& value,
                                const MemberDefinition& function, const TypeRegistry& types);
Result<Value> read_generator_return(const Message& message, const MessageEntry& entry, GeneratorStep step,
                                    const MemberDefinition& function, const TypeRegistry& types);

/// A generator that a client runs; never 0, never used again in its session. The low 31 bits are its index.
using GeneratorId = std::uint64_t;
std::int32_t generator_index(GeneratorId id);

/// The generators of one client. Each is known to the client by an index and to the application by an id.
class GeneratorTable {
 public:
  explicit GeneratorTable(std::size_t limit) : limit_(limit) {}

  /// A generator whose function runs: nobody can step it before opened().
  /// Errors   out_of_system_resource: as many run as may be.
  Result<GeneratorId> add(std::string_view path, const MemberDefinition& function);
  /// The function has returned: the client may step. Returns false where the generator is gone meanwhile.
  bool opened(GeneratorId id, Now now);

  /// What a step asks of the application.
  struct Step {
    GeneratorId id = 0;
    bool is_for_application = true;  ///< not: closed or aborted before, and to be answered at once with success
  };
  /// Begins a step; each that is for the application is followed by one finish().
  /// Errors   invalid_operation: no such generator of this member; stop_iteration, operation_aborted: it was closed or
  ///          aborted, and is gone now.
  Result<Step> begin(std::string_view path, const MemberDefinition& function, std::int32_t index, GeneratorStep step,
                     Now now);
  /// The application has answered a step. Returns whether it may forget the generator: it was closed or aborted, or a
  /// `next` has failed.
  bool finish(GeneratorId id, GeneratorStep step, bool has_failed, Now now);
  void remove(GeneratorId id);

  /// Removes generators that nobody has used for too long. Returns those that were open: the application
  /// still holds them.
  std::vector<GeneratorId> remove_idle(Now now);
  /// As remove_idle(), for those of objects whose path `is_released(path)`.
  template <class IsReleased>
  std::vector<GeneratorId> remove_released(IsReleased is_released) {
    std::vector<GeneratorId> held;
    for (auto entry = generators_.begin(); entry != generators_.end();)
      entry = is_released(std::string_view(entry->second.path)) ? remove(entry, held) : std::next(entry);
    return held;
  }
  /// No generator is idle before.
  TimePoint deadline() const { return earliest_; }
  std::size_t size() const { return generators_.size(); }
  void clear() { generators_.clear(); }

 private:
  enum class State : std::uint8_t { opening, open, closed, aborted };
  struct Entry {
    GeneratorId id = 0;
    State state = State::opening;
    std::size_t steps = 0;  ///< that the application has not answered
    TimePoint deadline = TimePoint::max();
    const MemberDefinition* function = nullptr;
    std::string path;
  };
  using Entries = std::map<std::int32_t, Entry>;

  Entry* find(GeneratorId id);
  bool forget_ended();
  void touch(Entry& entry, Now now);
  Entries::iterator remove(Entries::iterator entry, std::vector<GeneratorId>& held);

  std::size_t limit_;
  std::uint64_t added_ = 0;
  Entries generators_;  ///< by index
  TimePoint earliest_ = TimePoint::max();
};

}  // namespace rr
