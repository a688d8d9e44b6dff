// What the C++ API throws for errors that travel: one base for clients and services. Layer: node/values.
#pragma once

#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/support/error.hpp"
#include "core/types/value.hpp"

namespace rr {

/// An error of the protocol. Thrown by a handler, the client gets it as it is: also one that the service got as a
/// client of another service.
class Exception : public std::runtime_error {
 public:
  explicit Exception(Error error) : std::runtime_error(error.message), error_(std::move(error)) {}
  const Error& error() const { return error_; }

 private:
  Error error_;
};

inline constexpr const char* unhandled_exception = "rrgate.UnhandledException";

/// What a handler threw, as whoever called it gets it: an rr::Exception's error, else code 100 with the name
/// unhandled_exception.
inline Error handler_error(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const Exception& exception) {
    return exception.error();
  } catch (const std::exception& exception) {
    return {ErrorCode::remote_error, exception.what(), unhandled_exception};
  } catch (...) {
    return {ErrorCode::remote_error, "an exception that is no std::exception", unhandled_exception};
  }
}

/// Whether a handler failed by mistake: it did not throw the error to have it sent.
inline bool is_unhandled(const Error& error) {
  return error.name == unhandled_exception;
}

/// For reports: "wire 'pose': its handler failed: out of range".
inline std::string describe_failure(std::string_view what, std::string_view name, const Error& error) {
  return std::string(what) + " '" + std::string(name) + "': its handler failed: " + error.message;
}

/// The error of a custom exception: `qualified_name` as "com.x.MyException".
inline Error declared_error(std::string_view qualified_name, std::string message, std::string sub_name = {},
                            Value param = {}) {
  return {ErrorCode::remote_error, std::move(message), std::string(qualified_name), std::move(sub_name),
          param.is_null() ? nullptr : std::make_shared<const Value>(std::move(param))};
}

}  // namespace rr
