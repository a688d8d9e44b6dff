// Generator functions of a client session. Layer: session. Source: sessions spec section 2.10.
#include "core/member/arguments.hpp"
#include "core/session/client/client_session.hpp"

namespace rr {

namespace {

Result<> check_is_generator(const MemberDefinition& function) {
  if (function.is_generator()) return {};
  return make_error(ErrorCode::invalid_operation, "'" + function.name + "' is a function, not a generator function");
}

}  // namespace

RequestId ClientSession::open_generator(std::string_view path, std::string_view function,
                                        std::span<const Value> arguments, Now now) {
  return request_elements(EntryType::function_call_req, MemberKind::function, path, function, now,
                          [&](const MemberDefinition& definition) -> Result<> {
                            if (auto right = check_is_generator(definition); !right) return right;
                            return write_arguments(outgoing_, arguments, definition, types_);
                          });
}

RequestId ClientSession::next_generator(std::string_view path, std::string_view function, std::int32_t index,
                                        const std::optional<Value>& parameter, Now now) {
  return step_generator(GeneratorStep::next, path, function, index, parameter, now);
}

RequestId ClientSession::close_generator(std::string_view path, std::string_view function, std::int32_t index,
                                         Now now) {
  return step_generator(GeneratorStep::close, path, function, index, std::nullopt, now);
}

RequestId ClientSession::abort_generator(std::string_view path, std::string_view function, std::int32_t index,
                                         Now now) {
  return step_generator(GeneratorStep::abort, path, function, index, std::nullopt, now);
}

RequestId ClientSession::step_generator(GeneratorStep step, std::string_view path, std::string_view function,
                                        std::int32_t index, const std::optional<Value>& parameter, Now now) {
  const auto id = request_elements(EntryType::generator_next_req, MemberKind::function, path, function, now,
                                   [&](const MemberDefinition& definition) -> Result<> {
                                     if (auto right = check_is_generator(definition); !right) return right;
                                     return write_generator_step(outgoing_, step, index, parameter, definition, types_);
                                   });
  if (const auto found = pending_.find(id); found != pending_.end()) found->second.step = step;
  return id;
}

}  // namespace rr
