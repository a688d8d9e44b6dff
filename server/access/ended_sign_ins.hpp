// Which sign-ins have ended, in a file: a restart takes none of them up again. Layer: server/access.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "core/support/error.hpp"

namespace rrgate {

struct EndedSignIn {
  using Time = std::chrono::system_clock::time_point;

  std::string id = {};
  std::string subject = {};  ///< whose it was: a digest, so that lines have one length
  Time ends = {};            ///< no cookie of it is good from then on
};

/// Those of which a cookie may still be good. Lines that are none, as power that fails leaves them, are skipped; where
/// there is no file, there are none.
std::vector<EndedSignIn> read_ended_sign_ins(const std::string& file, EndedSignIn::Time now);

/// Adds a line to the file, which is made where it is not there (mode 0600), without waiting for the disk: a gateway
/// that is killed has said it, power that fails may take the last seconds. A file of 8 MiB is written anew first, with
/// what read_ended_sign_ins() finds. Errors   io_error: what the system says.
[[nodiscard]] rr::Result<> add_ended_sign_in(const std::string& file, const EndedSignIn& ended, EndedSignIn::Time now);

}  // namespace rrgate
