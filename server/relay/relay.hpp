// One client and one device, byte for byte in both directions. Layer: server/relay.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/log/metrics.hpp"
#include "server/relay/frame_gate.hpp"

namespace rrgate {

struct RelayOptions {
  std::size_t max_message_size;
  /// Bytes held for each direction. While they wait to be written nothing is read from the other side: a reader that
  /// stops makes its writer stop, and costs this much memory at most.
  std::size_t outbox_bytes;
  /// Bytes a second and direction, once both sides have agreed to TLS: no limit of messages holds there.
  std::size_t opaque_rate;
};

/// Both streams outlive the relay. One relay, one run().
class Relay {
 public:
  /// `traffic`  is counted up, and outlives the relay too.
  /// `memory`  is where the bytes that wait are counted.
  Relay(rr::ByteStream& client, rr::ByteStream& device, RelayOptions options, Traffic& traffic,
        MemoryBudget::Charge memory);

  /// Forwards until one side ends, fails, or breaks the rules. Ends both streams and says why.
  rr::awaitable<rr::EndReason> run();

  /// Makes run() end soon, with this reason for the client.
  void stop(rr::EndReason reason);

  std::uint64_t bytes_to_device() const { return to_device_.bytes; }
  std::uint64_t bytes_to_client() const { return to_client_.bytes; }

 private:
  struct Direction {
    rr::ByteStream& from;
    rr::ByteStream& to;
    FrameGate gate;
    bool is_from_device;
    Flow& flow;
    std::uint64_t bytes = 0;
    std::unique_ptr<boost::asio::steady_timer> pace = {};  ///< when what has passed opaquely will have taken its time
  };

  rr::awaitable<void> pump_to_device();
  rr::awaitable<void> pump(Direction& direction);
  rr::awaitable<void> pump_all(Direction& direction);
  rr::awaitable<void> keep_pace(Direction& direction, std::size_t bytes);
  void end_of(Direction& direction, rr::error_code error);
  rr::EndReason end_of_device(rr::error_code error) const;
  rr::EndReason broken_rule(const Direction& direction, const rr::Error& error) const;

  rr::ByteStream& client_;
  rr::ByteStream& device_;
  RelayOptions options_;
  MemoryBudget::Charge memory_;
  Direction to_device_;
  Direction to_client_;
  rr::Deadline half_closed_limit_;
  std::optional<rr::EndReason> end_reason_;
  bool is_to_device_done_ = false;
  boost::asio::steady_timer to_device_done_;  ///< cancelled when that pump has ended
};

}  // namespace rrgate
