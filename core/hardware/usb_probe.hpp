// Asks an opened device whether it is a Robot Raconteur node, and which. Layer: hardware.
// Source: hardware spec sections 2.2, 2.5, 2.6 and the row "Probe" of 3.2. Told, asked, polled: see architecture.md.
#pragma once

#include <optional>
#include <string>

#include "core/hardware/usb_descriptors.hpp"
#include "core/hardware/usb_transfer.hpp"
#include "core/support/node_id.hpp"

namespace rr {

struct UsbNodeInfo {
  UsbFunction function;
  NodeId id;
  std::string name;  ///< may be empty
};

/// A sequence of control requests, one at a time. `function` is what the BOS says where it is known already (Linux
/// shows it in sysfs); without it the device is asked for its BOS first.
class UsbProbe {
 public:
  explicit UsbProbe(std::optional<UsbFunction> function = {});

  /// The request that poll_control() gave has ended. `data` is what the device sent, borrowed for the call.
  void handle_control(UsbStatus status, ByteSpan data);

  /// The next request; nullptr when there is a result. The same one until it is answered.
  const UsbControl* poll_control() const { return result_ ? nullptr : &next_; }

  /// The device is one of ours: its BOS says so.
  bool has_function() const { return step_ > Step::bos; }

  /// Errors   node_not_found: not a device of ours; connection_error: a request failed; protocol_error: it breaks a
  /// rule.
  const std::optional<Result<UsbNodeInfo>>& result() const { return result_; }

 private:
  enum class Step : std::uint8_t { bos_header, bos, block_header, block, languages, node_id, node_name };

  void ask_descriptor(Step step, std::uint16_t value, std::uint16_t index, std::uint16_t length);
  void ask_block(Step step, std::uint16_t length);
  Result<> handle_answer(ByteSpan data);

  Step step_{};
  UsbControl next_;
  UsbNodeInfo info_;
  UsbNodeStrings strings_;
  std::uint16_t language_ = 0;
  std::optional<Result<UsbNodeInfo>> result_;
};

}  // namespace rr
