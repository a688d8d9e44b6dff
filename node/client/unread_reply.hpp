// Replies that can't be read, apart from those that tell an error. Layer: node/client.
#pragma once

#include <string_view>

#include "core/support/error.hpp"

namespace rr {

/// The `sub_name` of the errors with which a ClientConnection completes a request whose reply is not of the declared
/// type. Their codes are also those by which services refuse arguments, but here the service has carried out the
/// request.
inline constexpr std::string_view unread_reply = "UnreadReply";

inline bool is_unread_reply(const Error& error) {
  return error.sub_name == unread_reply;
}

}  // namespace rr
