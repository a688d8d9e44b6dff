// The one error type of the core: a Robot Raconteur error code and a sentence. Layer: support.
// Source: messages spec section 10, sessions spec section 2.1.
#pragma once

#include <boost/assert/source_location.hpp>
#include <boost/system/result.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace rr {

class Value;

/// Error codes as they travel in MessageEntry.Error. Unknown codes from a peer are kept as they are.
enum class ErrorCode : std::uint16_t {
  none = 0,
  connection_error = 1,
  protocol_error = 2,
  service_not_found = 3,
  object_not_found = 4,
  invalid_endpoint = 5,
  endpoint_communication_fatal_error = 6,
  node_not_found = 7,
  service_error = 8,
  member_not_found = 9,
  member_format_mismatch = 10,
  data_type_mismatch = 11,
  data_type_error = 12,
  data_serialization_error = 13,
  message_entry_not_found = 14,
  message_element_not_found = 15,
  unknown_error = 16,
  invalid_operation = 17,
  invalid_argument = 18,
  operation_failed = 19,
  null_value = 20,
  internal_error = 21,
  system_resource_permission_denied = 22,
  out_of_system_resource = 23,
  system_resource_error = 24,
  resource_not_found = 25,
  io_error = 26,
  buffer_limit_violation = 27,
  service_definition_error = 28,
  out_of_range = 29,
  key_not_found = 30,
  invalid_configuration = 31,
  invalid_state = 32,
  remote_error = 100,
  request_timeout = 101,
  read_only_member = 102,
  write_only_member = 103,
  not_implemented_error = 104,
  member_busy = 105,
  value_not_set = 106,
  abort_operation = 107,
  operation_aborted = 108,
  stop_iteration = 109,
  operation_timeout = 110,
  operation_cancelled = 111,
  authentication_error = 150,
  object_locked_error = 151,
  permission_denied = 152,
};

/// The table name of a code without prefix ("OperationFailed"); empty for codes that have none.
std::string_view error_code_name(ErrorCode code);

/// An expected failure. `message` says what failed, on what, what was found and what was expected.
struct Error {
  ErrorCode code = ErrorCode::internal_error;
  std::string message;
  /// The `errorname` of the wire: "com.x.MyException" for code 100 (and 16); empty means the canonical name.
  std::string name = {};
  std::string sub_name = {};
  std::shared_ptr<const Value> param = {};

  /// The `errorname` to send or show: `name`, else "RobotRaconteur.<table name>".
  std::string qualified_name() const;
};

template <class T = void>
using Result = boost::system::result<T, Error>;

/// Called by Result::value() when it holds an error: a programming mistake in core, which checks first.
[[noreturn]] void throw_exception_from_error(const Error& error, const boost::source_location& location);

/// Untrusted text for a message: quoted, cut after `limit` bytes; control characters and what is no UTF-8 escaped.
std::string quote(std::string_view text, std::size_t limit = 60);

inline Error make_error(ErrorCode code, std::string message) {
  return Error{code, std::move(message)};
}
inline Error protocol_error(std::string message) {
  return {ErrorCode::protocol_error, std::move(message)};
}

}  // namespace rr
