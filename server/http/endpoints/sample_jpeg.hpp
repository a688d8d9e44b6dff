// A frame of a camera as JPEG: encoded once, for all who look. Layer: server/http/endpoints.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <optional>
#include <string>

#include "server/limits/memory_budget.hpp"
#include "server/limits/workers.hpp"
#include "server/upstream/value_client.hpp"

namespace rrgate {

/// Shared by all who look.
using JpegImage = rr::Result<std::shared_ptr<const std::string>>;

struct SampleJpeg {
  SampleJpeg(const boost::asio::any_io_executor& executor, MemoryBudget::Charge charge)
      : memory(std::move(charge)), done(executor, boost::asio::steady_timer::time_point::max()) {}

  std::optional<JpegImage> result;  ///< none: it is being encoded
  MemoryBudget::Charge memory;      ///< of the result, while the sample keeps it
  boost::asio::steady_timer done;   ///< cancelled when there is one
};

/// The sample's only value as JPEG, made by whoever asks first. Whoever keeps it longer than the sample counts it
/// himself; the sample goes with its last holder. All others are borrowed for the wait, but for the workers, which
/// outlive it. Errors   those of prepare_image() and encode_image().
rr::awaitable<JpegImage> jpeg_of(SamplePtr sample, const rr::TypeDefinition& type, const rr::TypeRegistry& types,
                                 MemoryBudget& memory, Workers& workers);

}  // namespace rrgate
