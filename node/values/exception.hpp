// What the C++ API throws for errors that travel: one base for clients and services. Layer: node/values.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

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

/// The error of a custom exception: `qualified_name` as "com.x.MyException".
inline Error declared_error(std::string_view qualified_name, std::string message, std::string sub_name = {},
                            Value param = {}) {
  return {ErrorCode::remote_error, std::move(message), std::string(qualified_name), std::move(sub_name),
          param.is_null() ? nullptr : std::make_shared<const Value>(std::move(param))};
}

}  // namespace rr
