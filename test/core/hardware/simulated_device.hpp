// The device side of the USB transport, in memory: what firmware would do. Source: hardware spec sections 2, 3 and 6.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/hardware/usb_transfer.hpp"
#include "core/support/node_id.hpp"

namespace rr::test {

struct SimulatedDeviceOptions {
  NodeId id{{0x10, 0x20, 0x30, 0x40, 0x50, 0x60, 0x70, 0x80, 0x90, 0xa0, 0xb0, 0xc0, 0xd0, 0xe0, 0xf0, 0x01}};
  std::string name = "simulated.device";
  std::uint8_t interface = 0;  ///< others before it get a class of their own
  std::uint8_t vendor_code = 0xBA;
  std::uint16_t packet_size = 64;
  std::size_t max_streams = 16;
  std::size_t max_input = 4096;  ///< bytes of one stream not taken yet; above, OUT packets get NAK
  std::uint8_t class_code = 0xFF;
};

/// How a transfer ended, and what came with it. No reply at all (nullopt) is a NAK: ask again later.
struct UsbReply {
  UsbStatus status = UsbStatus::ok;
  Bytes data = {};
};

class SimulatedDevice {
 public:
  explicit SimulatedDevice(SimulatedDeviceOptions options = {});

  // --- the bus ---

  Bytes device_descriptor() const;
  Bytes configuration_descriptor() const;
  std::uint8_t in_address() const { return 0x81; }
  std::uint8_t out_address() const { return 0x02; }

  UsbReply control(const UsbControl& request);
  std::optional<UsbStatus> bulk_out(ByteSpan transfer);
  std::optional<UsbReply> bulk_in();

  // --- the application ---

  /// Streams that the host has opened since the last call.
  std::vector<std::int32_t> take_opened();
  /// Streams that the host has closed since the last call, by request or by reset.
  std::vector<std::int32_t> take_closed();
  Bytes take_input(std::int32_t stream, std::size_t limit = SIZE_MAX);
  void send(std::int32_t stream, ByteSpan bytes);
  std::size_t unsent_bytes(std::int32_t stream) const;
  /// Tells the host once that the stream is closed, behind what was sent on it.
  void close(std::int32_t stream);
  void notify(std::int32_t stream, std::uint16_t code);

  // --- faults ---

  void stall_next_in() { stall_in_ = true; }
  void stall_next_out() { stall_out_ = true; }
  void stall_control(std::uint8_t request) { stalled_request_ = request; }
  void unplug() { is_gone_ = true; }
  /// The next IN transfer carries exactly this.
  void send_raw(Bytes transfer) { raw_.push_back(std::move(transfer)); }
  void replace_block(Bytes block) { block_ = std::move(block); }
  void replace_bos(Bytes bos) { bos_ = std::move(bos); }
  void replace_string(std::uint8_t index, Bytes descriptor) { strings_[index] = std::move(descriptor); }
  void answer_connect(Bytes bytes) { connect_answer_ = std::move(bytes); }
  void answer_reset(Bytes bytes) { reset_answer_ = std::move(bytes); }

  const std::vector<UsbControl>& control_log() const { return log_; }
  const std::vector<Bytes>& out_log() const { return out_log_; }
  std::size_t stream_count() const { return streams_.size(); }

 private:
  struct Stream {
    Bytes input;
    Bytes output;
    bool is_closing = false;
  };

  UsbReply standard_request(const UsbControl& request);
  UsbReply vendor_request(const UsbControl& request);
  UsbReply connect();
  void reset();

  SimulatedDeviceOptions options_;
  Bytes bos_;
  Bytes block_;
  std::map<std::uint8_t, Bytes> strings_;
  std::map<std::int32_t, Stream> streams_;
  std::vector<std::int32_t> opened_;
  std::vector<std::int32_t> closed_;
  std::deque<Bytes> raw_;
  std::int32_t last_served_ = -1;
  bool stall_in_ = false;
  bool stall_out_ = false;
  bool is_gone_ = false;
  std::uint8_t stalled_request_ = 0;
  std::optional<Bytes> connect_answer_;
  std::optional<Bytes> reset_answer_;
  std::vector<UsbControl> log_;
  std::vector<Bytes> out_log_;
};

/// A string descriptor with ASCII text.
Bytes usb_string(std::string_view text);
/// A BOS with an unrelated capability and Robot Raconteur's.
Bytes usb_bos(std::uint8_t interface, std::uint8_t vendor_code);

}  // namespace rr::test
