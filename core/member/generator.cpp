#include "core/member/generator.hpp"

#include <algorithm>
#include <limits>

#include "core/member/error_entry.hpp"
#include "core/support/random.hpp"

namespace rr {

namespace {

constexpr std::chrono::seconds idle_limit{600};
constexpr std::chrono::seconds ended_limit{30};  ///< after close or abort
constexpr std::uint32_t index_mask = std::numeric_limits<std::int32_t>::max();

std::string generator_subject(const MemberDefinition& function) {
  return "generator '" + function.name + "'";
}

bool has_values(const MemberDefinition& function) {
  return function.type.container == ContainerKind::generator;
}

Result<Value> read_item(const Message& message, const MessageEntry& entry, std::string_view name,
                        const MemberDefinition& function, const TypeDefinition& type, const TypeRegistry& types) {
  const auto* element = message.elements_of(entry).find(name);
  if (!element)
    return make_error(ErrorCode::message_element_not_found,
                      generator_subject(function) + ": element '" + std::string(name) + "' not found");
  auto value = unpack(message, *element, type, types);
  if (value) return value;
  auto error = value.error();
  error.message = generator_subject(function) + ": " + error.message;
  return error;
}

}  // namespace

// --- messages ---

GeneratorStep generator_step(const MessageEntry& entry) {
  if (entry.error == ErrorCode::none) return GeneratorStep::next;
  return entry.error == ErrorCode::stop_iteration ? GeneratorStep::close : GeneratorStep::abort;
}

void write_generator_index(Message& message, std::int32_t index) {
  message.add_scalar("index", DataType::int32_t, index);
}

Result<std::int32_t> read_generator_index(const Message& message, const MessageEntry& entry,
                                          const MemberDefinition& function) {
  const auto* element = message.elements_of(entry).find("index");
  if (!element)
    return make_error(ErrorCode::message_element_not_found,
                      generator_subject(function) + ": element 'index' not found");
  if (element->type != DataType::int32_t || element->count != 1)
    return make_error(ErrorCode::data_type_mismatch, generator_subject(function) + ": 'index' is " +
                                                         std::string(data_type_name(element->type)) + "[" +
                                                         std::to_string(element->count) + "], expected int32[1]");
  return load<std::int32_t>(element->data.data());
}

Result<> write_generator_step(Message& message, GeneratorStep step, std::int32_t index,
                              const std::optional<Value>& parameter, const MemberDefinition& function,
                              const TypeRegistry& types) {
  // First the error: it takes the place of all elements.
  if (step == GeneratorStep::close) write_error(message, {ErrorCode::stop_iteration, {}});
  if (step == GeneratorStep::abort) write_error(message, {ErrorCode::abort_operation, "Generator abort requested"});
  write_generator_index(message, index);
  if (step != GeneratorStep::next) return {};
  const auto* definition = function.step_parameter();
  if (parameter.has_value() != (definition != nullptr))
    return make_error(ErrorCode::invalid_argument,
                      generator_subject(function) + (definition ? " takes a value with each step, none was given"
                                                                : " takes no value with its steps, one was given"));
  if (!definition) return {};
  return pack(message, "parameter", *parameter, definition->type, types);
}

Result<std::optional<Value>> read_generator_parameter(const Message& message, const MessageEntry& entry,
                                                      const MemberDefinition& function, const TypeRegistry& types) {
  const auto* definition = function.step_parameter();
  if (!definition) return std::optional<Value>();
  auto value = read_item(message, entry, "parameter", function, definition->type, types);
  if (!value) return value.error();
  return std::optional<Value>(std::move(*value));
}

Result<> write_generator_return(Message& message, GeneratorStep step, const Value& value,
                                const MemberDefinition& function, const TypeRegistry& types) {
  if (step == GeneratorStep::next && has_values(function)) return pack(message, "return", value, function.type, types);
  message.add_scalar("return", DataType::int32_t, std::int32_t{0});
  return {};
}

Result<Value> read_generator_return(const Message& message, const MessageEntry& entry, GeneratorStep step,
                                    const MemberDefinition& function, const TypeRegistry& types) {
  if (step != GeneratorStep::next || !has_values(function)) return Value{};
  return read_item(message, entry, "return", function, function.type, types);
}

// --- GeneratorTable ---

std::int32_t generator_index(GeneratorId id) {
  return static_cast<std::int32_t>(id & index_mask);
}

Result<GeneratorId> GeneratorTable::add(std::string_view path, const MemberDefinition& function) {
  if (generators_.size() >= limit_ && !forget_ended())
    return make_error(ErrorCode::out_of_system_resource,
                      "this client runs " + std::to_string(limit_) + " generators already, close some");
  std::uint32_t index = 0;
  do index = random_u32() & index_mask;
  while (generators_.contains(static_cast<std::int32_t>(index)));
  const GeneratorId id = ++added_ << 31 | index;
  Entry entry;
  entry.id = id;
  entry.function = &function;
  entry.path = path;
  generators_.emplace(static_cast<std::int32_t>(index), std::move(entry));
  return id;
}

bool GeneratorTable::opened(GeneratorId id, Now now) {
  auto* entry = find(id);
  if (!entry) return false;
  entry->state = State::open;
  touch(*entry, now);
  return true;
}

Result<GeneratorTable::Step> GeneratorTable::begin(std::string_view path, const MemberDefinition& function,
                                                   std::int32_t index, GeneratorStep step, Now now) {
  const auto found = generators_.find(index);
  if (found == generators_.end() || found->second.state == State::opening || found->second.function != &function ||
      found->second.path != path)
    return make_error(ErrorCode::invalid_operation, "Invalid generator: " + generator_subject(function) +
                                                        " has none of index " + std::to_string(index));
  auto& entry = found->second;
  if (entry.state == State::open) {
    if (step != GeneratorStep::next) entry.state = step == GeneratorStep::close ? State::closed : State::aborted;
    ++entry.steps;
    entry.deadline = TimePoint::max();
    return Step{entry.id, true};
  }
  if (step != GeneratorStep::next) {
    touch(entry, now);
    return Step{entry.id, false};
  }
  const bool was_closed = entry.state == State::closed;
  generators_.erase(found);
  if (was_closed) return make_error(ErrorCode::stop_iteration, {});
  return make_error(ErrorCode::operation_aborted, generator_subject(function) + " was aborted by the client");
}

bool GeneratorTable::finish(GeneratorId id, GeneratorStep step, bool has_failed, Now now) {
  const bool is_end = step != GeneratorStep::next;
  auto* entry = find(id);
  if (!entry) return is_end;
  --entry->steps;
  if (!is_end && has_failed && entry->state == State::open) {
    remove(id);
    return true;
  }
  touch(*entry, now);
  return is_end;
}

/// The one that ended first makes room: it is kept for late steps alone.
bool GeneratorTable::forget_ended() {
  auto first = generators_.end();
  for (auto entry = generators_.begin(); entry != generators_.end(); ++entry) {
    const auto& one = entry->second;
    const bool has_ended = (one.state == State::closed || one.state == State::aborted) && one.steps == 0;
    if (has_ended && (first == generators_.end() || one.deadline < first->second.deadline)) first = entry;
  }
  if (first == generators_.end()) return false;
  generators_.erase(first);
  return true;
}

void GeneratorTable::remove(GeneratorId id) {
  if (find(id)) generators_.erase(generator_index(id));
}

std::vector<GeneratorId> GeneratorTable::remove_idle(Now now) {
  std::vector<GeneratorId> held;
  if (now.steady < earliest_) return held;
  earliest_ = TimePoint::max();
  for (auto entry = generators_.begin(); entry != generators_.end();) {
    if (entry->second.deadline <= now.steady) {
      entry = remove(entry, held);
    } else {
      earliest_ = std::min(earliest_, entry->second.deadline);
      ++entry;
    }
  }
  return held;
}

GeneratorTable::Entry* GeneratorTable::find(GeneratorId id) {
  const auto found = generators_.find(generator_index(id));
  return found == generators_.end() || found->second.id != id ? nullptr : &found->second;
}

void GeneratorTable::touch(Entry& entry, Now now) {
  if (entry.steps != 0) return;  // the application is at work: nothing is idle
  entry.deadline = now.steady + (entry.state == State::open ? idle_limit : ended_limit);
  earliest_ = std::min(earliest_, entry.deadline);
}

GeneratorTable::Entries::iterator GeneratorTable::remove(Entries::iterator entry, std::vector<GeneratorId>& held) {
  if (entry->second.state == State::open) held.push_back(entry->second.id);
  return generators_.erase(entry);
}

}  // namespace rr
