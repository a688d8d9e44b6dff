#include "test/core/hardware/simulated_device.hpp"

#include <algorithm>
#include <utility>

namespace rr::test {

namespace {

void put16(Bytes& out, std::size_t value) {
  out.push_back(static_cast<std::uint8_t>(value));
  out.push_back(static_cast<std::uint8_t>(value >> 8));
}

void put32(Bytes& out, std::int32_t value) {
  put16(out, static_cast<std::uint32_t>(value) & 0xFFFF);
  put16(out, static_cast<std::uint32_t>(value) >> 16);
}

Bytes sub_packet(std::int32_t stream, std::uint16_t flags, ByteSpan payload) {
  Bytes out;
  put16(out, 8 + payload.size());
  put16(out, flags);
  put32(out, stream);
  out.insert(out.end(), payload.begin(), payload.end());
  return out;
}

UsbReply cut(const Bytes& descriptor, std::size_t length) {
  Bytes data = descriptor;
  data.resize(std::min(data.size(), length));
  return {UsbStatus::ok, data};
}

const UsbReply stalled{UsbStatus::stall};

}  // namespace

Bytes usb_string(std::string_view text) {
  Bytes out{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) put16(out, static_cast<std::uint8_t>(c));
  return out;
}

Bytes usb_bos(std::uint8_t interface, std::uint8_t vendor_code) {
  // Header; USB 2.0 extension (7 bytes); ours.
  Bytes bos{5,    0x0F, 36,   0,    2,    7,    0x10, 0x02, 0,    0,    0,    0,    24,   0x10, 0x05, 0, 0xc3,
            0x0e, 0x67, 0x84, 0xc6, 0xce, 0x17, 0x49, 0xb0, 0x39, 0x51, 0x0e, 0x3e, 0x71, 0x78, 0x8b, 0, 1};
  bos.push_back(interface);
  bos.push_back(vendor_code);
  return bos;
}

SimulatedDevice::SimulatedDevice(SimulatedDeviceOptions options)
    : options_(std::move(options)), bos_(usb_bos(options_.interface, options_.vendor_code)), block_{8,  0, 0,  0, 0, 1,
                                                                                                    22, 0, 14, 0, 1, 0,
                                                                                                    0,  0, 0,  1, 4, 5,
                                                                                                    1,  0, 1,  1} {
  strings_[0] = {4, 3, 0x09, 0x04};
  strings_[4] = usb_string(format_node_id(options_.id));
  strings_[5] = usb_string(options_.name);
}

Bytes SimulatedDevice::device_descriptor() const {
  // USB 2.1, classes per interface, 1209:5252, no strings of its own, one configuration.
  return {18, 1, 0x01, 0x02, 0, 0, 0, 64, 0x09, 0x12, 0x52, 0x52, 0, 1, 0, 0, 0, 1};
}

Bytes SimulatedDevice::configuration_descriptor() const {
  const auto interfaces = static_cast<std::uint8_t>(options_.interface + 1);
  Bytes out{9, 2, 0, 0, interfaces, 1, 0, 0x80, 50};
  for (std::uint8_t number = 0; number < options_.interface; ++number)
    out.insert(out.end(), {9, 4, number, 0, 0, 0xFE, 0, 0, 0});
  out.insert(out.end(), {9, 4, options_.interface, 0, 2, options_.class_code, 0xFF, 0, 0});
  for (const auto address : {out_address(), in_address()}) {
    out.insert(out.end(), {7, 5, address, 2});
    put16(out, options_.packet_size);
    out.push_back(0);
  }
  out[2] = static_cast<std::uint8_t>(out.size());
  return out;
}

UsbReply SimulatedDevice::control(const UsbControl& request) {
  if (is_gone_) return {UsbStatus::no_device};
  log_.push_back(request);
  if (stalled_request_ != 0 && request.request == stalled_request_) return stalled;
  return (request.request_type & 0x60) == 0 ? standard_request(request) : vendor_request(request);
}

UsbReply SimulatedDevice::standard_request(const UsbControl& request) {
  if (request.request_type == 0x80 && request.request == 0) return cut(Bytes(2, 0), request.length);  // status
  if ((request.request_type & 0x80) == 0 && request.length == 0) return {};                           // features
  if (request.request_type != 0x80 || request.request != 6) return stalled;
  const auto index = static_cast<std::uint8_t>(request.value);
  switch (request.value >> 8) {
    case 1:
      return cut(device_descriptor(), request.length);
    case 2:
      return cut(configuration_descriptor(), request.length);
    case 3:
      return strings_.count(index) > 0 ? cut(strings_[index], request.length) : stalled;
    case 0x0F:
      return bos_.empty() ? stalled : cut(bos_, request.length);
    default:
      return stalled;
  }
}

UsbReply SimulatedDevice::vendor_request(const UsbControl& request) {
  if ((request.index & 0xFF) != options_.interface) return stalled;
  if (request.request_type == 0xC1 && request.request == options_.vendor_code && request.index >> 8 == 5)
    return cut(block_, request.length);
  if (request.request_type == 0xC1 && request.request == 1) return connect();
  if (request.request_type == 0xC1 && request.request == 3) {
    reset();
    return {UsbStatus::ok, reset_answer_.value_or(Bytes(4, 0))};
  }
  if (request.request_type == 0x41 && request.request == 2 && request.data.size() == 4) {
    const auto id = load<std::int32_t>(request.data.data());
    if (streams_.erase(id) > 0) closed_.push_back(id);
    return {};
  }
  if (request.request_type == 0x41 && request.request == 6 && request.data == Bytes{1, 1}) return {};
  return stalled;
}

UsbReply SimulatedDevice::connect() {
  if (connect_answer_) return {UsbStatus::ok, *connect_answer_};
  Bytes answer;
  if (streams_.size() >= options_.max_streams) {
    put32(answer, -1);
    return {UsbStatus::ok, answer};
  }
  // The lowest free one from 7: ids come back soon, which is what hosts have to cope with.
  std::int32_t id = 7;
  while (streams_.count(id) > 0) ++id;
  streams_[id];
  opened_.push_back(id);
  put32(answer, id);
  return {UsbStatus::ok, answer};
}

void SimulatedDevice::reset() {
  for (const auto& [id, stream] : streams_) closed_.push_back(id);
  streams_.clear();
  raw_.clear();
}

std::optional<UsbStatus> SimulatedDevice::bulk_out(ByteSpan transfer) {
  if (is_gone_) return UsbStatus::no_device;
  if (std::exchange(stall_out_, false)) return UsbStatus::stall;
  if (transfer.empty()) {
    out_log_.emplace_back();
    return UsbStatus::ok;
  }
  if (transfer.size() < 8 || transfer.size() > options_.packet_size ||
      load<std::uint16_t>(transfer.data()) != transfer.size() || load<std::uint16_t>(transfer.data() + 2) != 0)
    return UsbStatus::stall;
  const auto found = streams_.find(load<std::int32_t>(transfer.data() + 4));
  if (found != streams_.end()) {
    auto& input = found->second.input;
    if (input.size() >= options_.max_input) return std::nullopt;
    input.insert(input.end(), transfer.begin() + 8, transfer.end());
  }
  out_log_.emplace_back(transfer.begin(), transfer.end());
  if (out_log_.size() > 256) out_log_.erase(out_log_.begin());
  return UsbStatus::ok;
}

std::optional<UsbReply> SimulatedDevice::bulk_in() {
  if (is_gone_) return UsbReply{UsbStatus::no_device};
  if (std::exchange(stall_in_, false)) return stalled;
  if (!raw_.empty()) {
    UsbReply reply{UsbStatus::ok, std::move(raw_.front())};
    raw_.pop_front();
    return reply;
  }
  auto next = streams_.upper_bound(last_served_);
  for (std::size_t tried = 0; tried < streams_.size(); ++tried, ++next) {
    if (next == streams_.end()) next = streams_.begin();
    auto& [id, stream] = *next;
    if (!stream.output.empty()) {
      const auto count = std::min<std::size_t>(stream.output.size(), options_.packet_size - 8u);
      UsbReply reply{UsbStatus::ok, sub_packet(id, 0, ByteSpan(stream.output).first(count))};
      stream.output.erase(stream.output.begin(), stream.output.begin() + static_cast<std::ptrdiff_t>(count));
      last_served_ = id;
      return reply;
    }
    if (stream.is_closing) {
      UsbReply reply{UsbStatus::ok, sub_packet(id, 2, Bytes{1, 0})};
      streams_.erase(next);
      return reply;
    }
  }
  return std::nullopt;
}

std::vector<std::int32_t> SimulatedDevice::take_opened() {
  return std::exchange(opened_, {});
}

std::vector<std::int32_t> SimulatedDevice::take_closed() {
  return std::exchange(closed_, {});
}

Bytes SimulatedDevice::take_input(std::int32_t stream, std::size_t limit) {
  const auto found = streams_.find(stream);
  if (found == streams_.end()) return {};
  auto& input = found->second.input;
  const auto end = input.begin() + static_cast<std::ptrdiff_t>(std::min(limit, input.size()));
  Bytes out(input.begin(), end);
  input.erase(input.begin(), end);
  return out;
}

void SimulatedDevice::send(std::int32_t stream, ByteSpan bytes) {
  const auto found = streams_.find(stream);
  if (found != streams_.end()) found->second.output.insert(found->second.output.end(), bytes.begin(), bytes.end());
}

std::size_t SimulatedDevice::unsent_bytes(std::int32_t stream) const {
  const auto found = streams_.find(stream);
  return found == streams_.end() ? 0 : found->second.output.size();
}

void SimulatedDevice::close(std::int32_t stream) {
  const auto found = streams_.find(stream);
  if (found != streams_.end()) found->second.is_closing = true;
}

void SimulatedDevice::notify(std::int32_t stream, std::uint16_t code) {
  Bytes payload;
  put16(payload, code);
  send_raw(sub_packet(stream, 2, payload));
}

}  // namespace rr::test
