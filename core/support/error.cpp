#include "core/support/error.hpp"

#include <cstdlib>
#include <exception>
#ifdef __cpp_exceptions
#include <stdexcept>
#endif

#include "core/support/hex.hpp"
#include "core/support/utf8.hpp"

namespace rr {

std::string_view error_code_name(ErrorCode code) {
  switch (code) {
    case ErrorCode::none:
      return "None";
    case ErrorCode::connection_error:
      return "ConnectionError";
    case ErrorCode::protocol_error:
      return "ProtocolError";
    case ErrorCode::service_not_found:
      return "ServiceNotFound";
    case ErrorCode::object_not_found:
      return "ObjectNotFound";
    case ErrorCode::invalid_endpoint:
      return "InvalidEndpoint";
    case ErrorCode::endpoint_communication_fatal_error:
      return "EndpointCommunicationFatalError";
    case ErrorCode::node_not_found:
      return "NodeNotFound";
    case ErrorCode::service_error:
      return "ServiceError";
    case ErrorCode::member_not_found:
      return "MemberNotFound";
    case ErrorCode::member_format_mismatch:
      return "MemberFormatMismatch";
    case ErrorCode::data_type_mismatch:
      return "DataTypeMismatch";
    case ErrorCode::data_type_error:
      return "DataTypeError";
    case ErrorCode::data_serialization_error:
      return "DataSerializationError";
    case ErrorCode::message_entry_not_found:
      return "MessageEntryNotFound";
    case ErrorCode::message_element_not_found:
      return "MessageElementNotFound";
    case ErrorCode::unknown_error:
      return "UnknownError";
    case ErrorCode::invalid_operation:
      return "InvalidOperation";
    case ErrorCode::invalid_argument:
      return "InvalidArgument";
    case ErrorCode::operation_failed:
      return "OperationFailed";
    case ErrorCode::null_value:
      return "NullValue";
    case ErrorCode::internal_error:
      return "InternalError";
    case ErrorCode::system_resource_permission_denied:
      return "SystemResourcePermissionDenied";
    case ErrorCode::out_of_system_resource:
      return "OutOfSystemResource";
    case ErrorCode::system_resource_error:
      return "SystemResourceError";
    case ErrorCode::resource_not_found:
      return "ResourceNotFound";
    case ErrorCode::io_error:
      return "IOError";
    case ErrorCode::buffer_limit_violation:
      return "BufferLimitViolation";
    case ErrorCode::service_definition_error:
      return "ServiceDefinitionError";
    case ErrorCode::out_of_range:
      return "OutOfRange";
    case ErrorCode::key_not_found:
      return "KeyNotFound";
    case ErrorCode::invalid_configuration:
      return "InvalidConfiguration";
    case ErrorCode::invalid_state:
      return "InvalidState";
    case ErrorCode::remote_error:
      return "RemoteError";
    case ErrorCode::request_timeout:
      return "RequestTimeout";
    case ErrorCode::read_only_member:
      return "ReadOnlyMember";
    case ErrorCode::write_only_member:
      return "WriteOnlyMember";
    case ErrorCode::not_implemented_error:
      return "NotImplementedError";
    case ErrorCode::member_busy:
      return "MemberBusy";
    case ErrorCode::value_not_set:
      return "ValueNotSet";
    case ErrorCode::abort_operation:
      return "AbortOperation";
    case ErrorCode::operation_aborted:
      return "OperationAborted";
    case ErrorCode::stop_iteration:
      return "StopIteration";
    case ErrorCode::operation_timeout:
      return "OperationTimeout";
    case ErrorCode::operation_cancelled:
      return "OperationCancelled";
    case ErrorCode::authentication_error:
      return "AuthenticationError";
    case ErrorCode::object_locked_error:
      return "ObjectLockedError";
    case ErrorCode::permission_denied:
      return "PermissionDenied";
  }
  return {};
}

std::string Error::qualified_name() const {
  if (!name.empty()) return name;
  const auto table_name = error_code_name(code);
  return "RobotRaconteur." + std::string(table_name.empty() ? "UnknownError" : table_name);
}

void throw_exception_from_error(const Error& error, const boost::source_location&) {
#ifdef __cpp_exceptions
  throw std::logic_error("value() of a failed Result: " + error.qualified_name() + ": " + error.message);
#else
  static_cast<void>(error);
  std::abort();
#endif
}

std::string quote(std::string_view text, std::size_t limit) {
  std::string out = "'";
  for (auto rest = text.substr(0, limit); !rest.empty();) {
    const auto size = utf8_character_size(rest);
    const auto byte = static_cast<unsigned char>(rest.front());
    const bool is_c1 = size == 2 && byte == 0xc2 && static_cast<unsigned char>(rest[1]) < 0xa0;
    if (size == 0 || byte < 0x20 || byte == 0x7f || is_c1) {
      out += "\\x" + hex_text(byte, 2);
      rest.remove_prefix(1);
    } else {
      if (byte == '\'' || byte == '\\') out += '\\';
      out += rest.substr(0, size);
      rest.remove_prefix(size);
    }
  }
  out += '\'';
  if (text.size() > limit) out += " (" + std::to_string(text.size()) + " bytes)";
  return out;
}

}  // namespace rr

#ifdef BOOST_NO_EXCEPTIONS
/// Boost reports what cannot happen (a Result read without looking) by throwing; without exceptions the program ends.
namespace boost {
BOOST_NORETURN void throw_exception(const std::exception&) {
  std::abort();
}
BOOST_NORETURN void throw_exception(const std::exception&, const boost::source_location&) {
  std::abort();
}
}  // namespace boost
#endif
