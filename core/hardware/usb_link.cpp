#include "core/hardware/usb_link.hpp"

#include <algorithm>
#include <utility>

#include "core/hardware/usb_sub_packet.hpp"

namespace rr {

namespace {

constexpr std::uint8_t connect_stream = 1;
constexpr std::uint8_t close_stream_request = 2;
constexpr std::uint8_t reset_all_stream = 3;
constexpr std::uint8_t current_protocol = 6;
constexpr std::uint16_t answer_size = 4;  ///< of connect and reset

template <class T>
Bytes to_bytes(T value) {
  Bytes out(sizeof(T));
  std::memcpy(out.data(), &value, sizeof(T));
  return out;
}

Error link_error(const std::string& what) {
  return make_error(ErrorCode::connection_error, "USB device: " + what);
}

}  // namespace

void UsbLink::Fifo::push(ByteSpan bytes) {
  // What was taken is given back at the latest when it is half of the buffer.
  if (begin_ > 0 && begin_ >= bytes_.size() / 2) {
    bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(begin_));
    begin_ = 0;
  }
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

std::size_t UsbLink::Fifo::pop(std::span<std::uint8_t> into) {
  const auto count = std::min(into.size(), size());
  std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_), count, into.begin());
  begin_ += count;
  if (begin_ == bytes_.size()) clear();
  return count;
}

UsbLink::UsbLink(UsbPipes pipes, std::uint8_t interface, UsbLinkOptions options)
    : pipes_(pipes), interface_(interface), options_(options) {
  for (auto& slot : writes_) slot.buffer.resize(pipes_.out.max_packet_size);
  for (auto& slot : reads_) slot.buffer.resize(pipes_.in.max_packet_size);
}

// --- told ---

void UsbLink::handle_control(UsbStatus status, ByteSpan data) {
  const auto request = std::exchange(request_, Request::none);
  if (request == Request::final_reset) {  // may fail: the device may be the reason for closing
    state_ = UsbLinkState::closed;
    return;
  }
  if (request == Request::connect) handle_connected(status, data);
  if (state_ == UsbLinkState::closing || state_ == UsbLinkState::closed) return;
  if (status == UsbStatus::no_device) return fail(link_error(usb_status_text(status)), true);
  if (request == Request::reset) {
    if (status != UsbStatus::ok) return fail(link_error(std::string("reset: ") + usb_status_text(status)), false);
    if (data.size() != answer_size)
      return fail(link_error("reset: " + std::to_string(data.size()) + " bytes in the answer, expected 4"), false);
    wants_resync_ = true;
  } else if (request == Request::select_protocol) {
    if (status != UsbStatus::ok)
      return fail(link_error(std::string("protocol 0x0101: ") + usb_status_text(status)), false);
    state_ = UsbLinkState::running;
  }
}

/// A stream that nobody wants any more by now is closed at once.
void UsbLink::handle_connected(UsbStatus status, ByteSpan data) {
  const auto key = std::exchange(connecting_, 0);
  const auto found = streams_.find(key);
  const bool is_wanted = found != streams_.end() && found->second.state == StreamState::connecting;
  const auto refuse = [&](const std::string& why) {
    if (is_wanted) end_stream(key, found->second, link_error("stream refused: " + why));
  };
  if (status != UsbStatus::ok) return refuse(usb_status_text(status));
  if (data.size() != answer_size) return refuse(std::to_string(data.size()) + " bytes in the answer, expected 4");
  const auto id = load<std::int32_t>(data.data());
  if (id < 0) return refuse("the device answered " + std::to_string(id) + ", which means that it takes no more");
  if (keys_.count(id) > 0) return refuse("the device gave stream id " + std::to_string(id) + ", which is in use");
  if (!is_wanted) {
    to_close_.push_back(id);
    return;
  }
  found->second.id = id;
  found->second.state = StreamState::open;
  keys_[id] = key;
  events_.push_back({UsbEventKind::opened, key});
}

void UsbLink::handle_written(std::size_t slot_index, UsbStatus status, std::size_t bytes) {
  auto& slot = writes_[slot_index];
  slot.is_posted = false;
  const auto found = streams_.find(slot.stream);
  if (found != streams_.end()) --found->second.writes_posted;
  if (state_ == UsbLinkState::closing || state_ == UsbLinkState::closed) return;
  if (state_ == UsbLinkState::starting) {  // the empty one; its result does not matter
    next_request_ = Request::select_protocol;
    return;
  }
  if (status != UsbStatus::ok)
    return fail(link_error(std::string("write: ") + usb_status_text(status)), status == UsbStatus::no_device);
  if (bytes != slot.size)
    return fail(link_error("write: took " + std::to_string(bytes) + " of " + std::to_string(slot.size) + " bytes"),
                false);
  if (found != streams_.end() && found->second.state == StreamState::open && is_sent(slot.stream))
    events_.push_back({UsbEventKind::writable, slot.stream});
}

void UsbLink::handle_read(std::size_t slot_index, UsbStatus status, std::size_t bytes, TimePoint now) {
  auto& slot = reads_[slot_index];
  slot.is_posted = false;
  if (state_ != UsbLinkState::running) return;
  if (status != UsbStatus::ok)
    return fail(link_error(std::string("read: ") + usb_status_text(status)), status == UsbStatus::no_device);
  if (bytes == 0) return;
  handle_sub_packet(ByteSpan(slot.buffer).first(std::min(bytes, slot.buffer.size())), now);
}

void UsbLink::handle_sub_packet(ByteSpan transfer, TimePoint now) {
  const auto packet = parse_usb_sub_packet(transfer);
  if (!packet) return fail(packet.error(), false);
  const auto known = keys_.find(packet->stream);
  if (known == keys_.end()) return;  // closed while it was under way
  const auto key = known->second;
  auto& stream = streams_.at(key);
  if (packet->is_notice) return handle_notice(key, stream, static_cast<std::uint16_t>(packet->notice));
  if (packet->payload.empty()) return;
  if (stream.unread.size() == 0) events_.push_back({UsbEventKind::readable, key});
  stream.unread.push(packet->payload);
  update_read_deadline(now);
}

void UsbLink::handle_notice(UsbStreamKey key, Stream& stream, std::uint16_t code) {
  switch (static_cast<UsbNotice>(code)) {
    case UsbNotice::socket_closed:
      return end_stream(key, stream, Error{ErrorCode::none, "closed by the device"});
    case UsbNotice::pause_request:
      stream.is_paused = true;
      return;
    case UsbNotice::resume_request:
      stream.is_paused = false;
      return;
    case UsbNotice::none:
      return;
  }
}

void UsbLink::handle_timeout(TimePoint now) {
  if (now < read_deadline_) return;
  read_deadline_ = TimePoint::max();
  for (auto& [key, stream] : streams_) {
    if (stream.state != StreamState::open || stream.unread.size() <= options_.max_unread_bytes) continue;
    to_close_.push_back(stream.id);
    end_stream(key, stream,
               link_error("stream closed: " + std::to_string(stream.unread.size()) +
                          " received bytes were not read in time, and hold up the device's other streams"));
    stream.unread.clear();
  }
}

// --- asked ---

UsbStreamKey UsbLink::open_stream() {
  const auto key = ++last_key_;
  auto& stream = streams_[key];
  if (state_ == UsbLinkState::closing || state_ == UsbLinkState::closed) {
    end_stream(key, stream, link_error("is being closed"));
  } else if (streams_.size() > options_.max_streams) {
    end_stream(key, stream, link_error("has " + std::to_string(options_.max_streams) + " streams, the limit"));
  } else {
    to_connect_.push_back(key);
  }
  return key;
}

std::size_t UsbLink::write(UsbStreamKey key, ByteSpan bytes) {
  const auto found = streams_.find(key);
  if (found == streams_.end() || found->second.state != StreamState::open) return 0;
  auto& unsent = found->second.unsent;
  const auto count =
      std::min(bytes.size(), options_.max_unsent_bytes - std::min(unsent.size(), options_.max_unsent_bytes));
  unsent.push(bytes.first(count));
  return count;
}

std::size_t UsbLink::read(UsbStreamKey key, std::span<std::uint8_t> into) {
  const auto found = streams_.find(key);
  if (found == streams_.end()) return 0;
  const auto count = found->second.unread.pop(into);
  if (read_deadline_ != TimePoint::max() && !is_reading_stalled()) read_deadline_ = TimePoint::max();
  return count;
}

void UsbLink::close_stream(UsbStreamKey key) {
  const auto found = streams_.find(key);
  if (found == streams_.end()) return;
  if (found->second.state == StreamState::open) {
    keys_.erase(found->second.id);
    to_close_.push_back(found->second.id);
  }
  streams_.erase(found);
  std::erase(to_connect_, key);
  if (connecting_ == key) connecting_ = 0;
  if (read_deadline_ != TimePoint::max() && !is_reading_stalled()) read_deadline_ = TimePoint::max();
  // Nothing to tell the device of before the first request has been answered.
  if (streams_.empty() && state_ == UsbLinkState::starting) state_ = UsbLinkState::closing;
}

void UsbLink::close(Error reason) {
  fail(std::move(reason), false);
}

// --- answers ---

std::optional<UsbControl> UsbLink::poll_control() {
  if (request_ != Request::none) return std::nullopt;
  switch (state_) {
    case UsbLinkState::starting:
      if (next_request_ == Request::none) return std::nullopt;
      return make_control(std::exchange(next_request_, Request::none));
    case UsbLinkState::running:
      if (!to_close_.empty()) return make_control(Request::close_stream);
      // Bytes of a closed stream may be on their way still: they must not arrive in a new one with the same id.
      if (!to_connect_.empty() && !has_stale_writes()) return make_control(Request::connect);
      if (!streams_.empty()) return std::nullopt;
      state_ = UsbLinkState::closing;
      return make_control(Request::final_reset);
    case UsbLinkState::closing:
      return make_control(Request::final_reset);
    case UsbLinkState::closed:
      break;
  }
  return std::nullopt;
}

UsbControl UsbLink::make_control(Request request) {
  request_ = request;
  switch (request) {
    case Request::connect:
      connecting_ = to_connect_.front();
      to_connect_.pop_front();
      streams_.at(connecting_).state = StreamState::connecting;
      return {vendor_interface_in, connect_stream, 0, interface_, answer_size};
    case Request::close_stream: {
      auto data = to_bytes(to_close_.front());
      to_close_.pop_front();
      return {vendor_interface_out, close_stream_request, 0, interface_, 4, std::move(data)};
    }
    case Request::select_protocol:
      return {vendor_interface_out, current_protocol, 0, interface_, 2, to_bytes(usb_stream_protocol)};
    case Request::none:
    case Request::reset:
    case Request::final_reset:
      break;
  }
  return {vendor_interface_in, reset_all_stream, 0, interface_, answer_size};
}

/// One sub-packet of each ready stream in turn.
std::optional<UsbWrite> UsbLink::poll_write() {
  const auto slot = std::find_if(writes_.begin(), writes_.end(), [](const Slot& each) { return !each.is_posted; });
  if (slot == writes_.end()) return std::nullopt;
  const auto index = static_cast<std::size_t>(slot - writes_.begin());
  if (state_ == UsbLinkState::starting && wants_resync_) {
    wants_resync_ = false;
    slot->is_posted = true;
    slot->stream = 0;
    slot->size = 0;
    return UsbWrite{index, {}};
  }
  if (state_ != UsbLinkState::running || streams_.empty()) return std::nullopt;
  auto next = streams_.upper_bound(last_served_);
  for (std::size_t tried = 0; tried < streams_.size(); ++tried, ++next) {
    if (next == streams_.end()) next = streams_.begin();
    auto& [key, stream] = *next;
    if (stream.state != StreamState::open || stream.is_paused || stream.unsent.size() == 0) continue;
    const bool was_full = stream.unsent.size() >= options_.max_unsent_bytes;
    const auto payload = stream.unsent.pop(std::span(slot->buffer).subspan(usb_sub_packet_header));
    write_usb_sub_packet_header(slot->buffer, stream.id, payload);
    slot->is_posted = true;
    slot->stream = last_served_ = key;
    slot->size = usb_sub_packet_header + payload;
    ++stream.writes_posted;
    if (was_full) events_.push_back({UsbEventKind::writable, key});
    return UsbWrite{index, ByteSpan(slot->buffer).first(slot->size)};
  }
  return std::nullopt;
}

std::optional<UsbRead> UsbLink::poll_read() {
  if (state_ != UsbLinkState::running || is_reading_stalled()) return std::nullopt;
  const auto slot = std::find_if(reads_.begin(), reads_.end(), [](const Slot& each) { return !each.is_posted; });
  if (slot == reads_.end()) return std::nullopt;
  slot->is_posted = true;
  return UsbRead{static_cast<std::size_t>(slot - reads_.begin()), slot->buffer};
}

std::optional<UsbEvent> UsbLink::poll_event() {
  while (!events_.empty()) {
    auto event = std::move(events_.front());
    events_.pop_front();
    if (streams_.count(event.stream) > 0) return event;
  }
  return std::nullopt;
}

// --- looked at ---

bool UsbLink::is_open(UsbStreamKey key) const {
  const auto found = streams_.find(key);
  return found != streams_.end() && found->second.state == StreamState::open;
}

bool UsbLink::is_sent(UsbStreamKey key) const {
  const auto found = streams_.find(key);
  return found == streams_.end() || (found->second.unsent.size() == 0 && found->second.writes_posted == 0);
}

std::size_t UsbLink::unread_bytes(UsbStreamKey key) const {
  const auto found = streams_.find(key);
  return found == streams_.end() ? 0 : found->second.unread.size();
}

std::size_t UsbLink::unsent_bytes(UsbStreamKey key) const {
  const auto found = streams_.find(key);
  return found == streams_.end() ? 0 : found->second.unsent.size();
}

// --- within ---

/// Unread bytes stay, so that a reader gets all that came before the end.
void UsbLink::end_stream(UsbStreamKey key, Stream& stream, Error reason) {
  if (stream.state == StreamState::open) keys_.erase(stream.id);
  stream.state = StreamState::closed;
  stream.unsent.clear();
  events_.push_back({UsbEventKind::closed, key, std::move(reason)});
}

void UsbLink::fail(Error reason, bool is_gone) {
  if (state_ == UsbLinkState::closing || state_ == UsbLinkState::closed) return;
  state_ = is_gone ? UsbLinkState::closed : UsbLinkState::closing;
  to_connect_.clear();
  to_close_.clear();
  connecting_ = 0;
  read_deadline_ = TimePoint::max();
  for (auto& [key, stream] : streams_)
    if (stream.state != StreamState::closed) end_stream(key, stream, reason);
}

bool UsbLink::has_stale_writes() const {
  return std::any_of(writes_.begin(), writes_.end(),
                     [this](const Slot& slot) { return slot.is_posted && !is_open(slot.stream); });
}

bool UsbLink::is_reading_stalled() const {
  return std::any_of(streams_.begin(), streams_.end(), [this](const auto& entry) {
    return entry.second.state == StreamState::open && entry.second.unread.size() > options_.max_unread_bytes;
  });
}

void UsbLink::update_read_deadline(TimePoint now) {
  if (read_deadline_ == TimePoint::max() && is_reading_stalled()) read_deadline_ = now + options_.read_stall;
}

}  // namespace rr
