#include "node/transport/usb_claim.hpp"
#include "node/transport/await_tuple.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace rr {

namespace asio = boost::asio;

namespace {

/// How long end() waits until the device has taken what was written.
constexpr std::chrono::milliseconds write_linger_time{1000};

Error claim_error(const UsbDevice& device, UsbStatus status) {
  auto message = device.description() + ": " + usb_status_text(status);
  if (status == UsbStatus::denied)
    message += "; this user needs to read and write " + device.node +
               ": install 60-robotraconteur-usb.rules into /etc/udev/rules.d and plug the device in again";
  return make_error(
      status == UsbStatus::denied ? ErrorCode::system_resource_permission_denied : ErrorCode::connection_error,
      std::move(message));
}

error_code code_of(const Error& reason) {
  if (reason.code == ErrorCode::none) return {};
  if (reason.code == ErrorCode::protocol_error) return {EPROTO, boost::system::system_category()};
  return asio::error::connection_reset;
}

}  // namespace

/// One stream's place in the claim: what has happened to it, and who waits for news.
class UsbClaim::Waiting {
 public:
  Waiting(std::shared_ptr<UsbClaim> claim)
      : claim_(std::move(claim)),
        key_(claim_->link_.open_stream()),
        news_(claim_->executor()),
        writable_(claim_->executor()) {
    claim_->waiting_[key_] = this;
  }
  ~Waiting() { close(); }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  void handle(const UsbEvent& event) {
    if (event.kind == UsbEventKind::closed) closed_ = event.reason;
    if (event.kind != UsbEventKind::writable) news_.cancel();
    if (event.kind != UsbEventKind::readable) writable_.cancel();
  }

  void close() {
    if (!std::exchange(is_mine_, false)) return;
    claim_->waiting_.erase(key_);
    claim_->link_.close_stream(key_);
    claim_->pump();
    wake();
  }

  void wake() {
    news_.cancel();
    writable_.cancel();
  }

  /// Until an event, wake(), or `until`.
  static awaitable<void> wait(asio::steady_timer& timer, TimePoint until = TimePoint::max()) {
    timer.expires_at(until);
    co_await timer.async_wait(await_tuple);
  }

  UsbLink& link() { return claim_->link_; }
  UsbClaim& claim() { return *claim_; }
  UsbStreamKey key() const { return key_; }
  bool is_open() const { return is_mine_ && claim_->link_.is_open(key_); }
  bool is_mine() const { return is_mine_; }
  /// Why it was closed from the other side.
  const std::optional<Error>& closed() const { return closed_; }
  asio::steady_timer& news() { return news_; }
  asio::steady_timer& writable() { return writable_; }

 private:
  std::shared_ptr<UsbClaim> claim_;
  UsbStreamKey key_;
  bool is_mine_ = true;  ///< until close()
  std::optional<Error> closed_;
  asio::steady_timer news_;      ///< opened, readable, closed
  asio::steady_timer writable_;  ///< writable, closed
};

class UsbStream final : public ByteStream {
 public:
  UsbStream(std::unique_ptr<UsbClaim::Waiting> place, std::chrono::milliseconds send_stall)
      : place_(std::move(place)),
        executor_(place_->claim().executor()),
        peer_(place_->claim().device_.description()),
        stall_(executor_,
               [this] {
                 is_stalled_ = true;
                 close();
               }),
        send_stall_(send_stall) {}

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override {
    if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
    const auto cancel_count = cancel_count_;
    while (place_->is_mine() && cancel_count == cancel_count_) {
      if (const auto count = place_->link().read(place_->key(), into)) {
        place_->claim().pump();
        co_return ReadResult{{}, count};
      }
      if (place_->closed()) co_return ReadResult{code_of(*place_->closed()), 0};
      co_await place_->wait(place_->news());
    }
    co_return ReadResult{asio::error::operation_aborted, 0};
  }

  std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) override {
    error = write_error();
    std::size_t total = 0;
    for (const auto& slice : slices) {
      const auto count = error ? 0 : place_->link().write(place_->key(), slice);
      total += count;
      if (count < slice.size()) break;
    }
    if (total > 0) place_->claim().pump();
    return total;
  }

  awaitable<error_code> write(std::span<const ByteSpan> slices) override {
    const auto cancel_count = cancel_count_;
    for (auto slice : slices) {
      while (!slice.empty()) {
        if (const auto error = write_error()) {
          stall_.disarm();
          co_return error;
        }
        const auto count = place_->link().write(place_->key(), slice);
        slice = slice.subspan(count);
        if (count > 0) {
          stall_.disarm();
          place_->claim().pump();
          continue;
        }
        if (!stall_.is_armed()) stall_.arm(send_stall_);
        co_await place_->wait(place_->writable());
        if (is_stalled_) co_return asio::error::timed_out;
        if (cancel_count != cancel_count_) {
          stall_.disarm();
          co_return asio::error::operation_aborted;
        }
      }
    }
    stall_.disarm();
    co_return error_code();
  }

  /// There are no half-closed streams: end() follows.
  void finish_sending() override {}

  void cancel() override {
    ++cancel_count_;
    place_->wake();
  }

  awaitable<void> end(const EndReason&) override {
    const auto until = std::chrono::steady_clock::now() + write_linger_time;
    while (place_->is_open() && !place_->link().is_sent(place_->key()) && std::chrono::steady_clock::now() < until)
      co_await place_->wait(place_->writable(), until);
    close();
  }

  void close() override { place_->close(); }
  std::string peer() const override { return peer_; }
  asio::any_io_executor executor() override { return executor_; }

 private:
  error_code write_error() const {
    if (!place_->is_mine()) return is_stalled_ ? asio::error::timed_out : asio::error::operation_aborted;
    if (!place_->closed()) return {};
    const auto code = code_of(*place_->closed());
    return code ? code : error_code(asio::error::broken_pipe);
  }

  std::unique_ptr<UsbClaim::Waiting> place_;
  asio::any_io_executor executor_;
  std::string peer_;
  Deadline stall_;
  std::chrono::milliseconds send_stall_;
  bool is_stalled_ = false;
  unsigned cancel_count_ = 0;  ///< a read or write that was between two waits notices cancel() by it
};

std::shared_ptr<UsbClaim> UsbClaim::start(UsbDevice device, UsbFunction function, UsbPipes pipes) {
  std::shared_ptr<UsbClaim> self(new UsbClaim(std::move(device), function, pipes));
  asio::co_spawn(
      self->executor(), [self]() -> awaitable<void> { return self->claim(); }, asio::detached);
  return self;
}

awaitable<void> UsbClaim::claim() {
  const auto self = shared_from_this();
  asio::steady_timer pause(executor());
  auto status = UsbStatus::busy;
  for (int attempt = 0; status == UsbStatus::busy && attempt < usb_busy_attempts; ++attempt) {
    if (attempt > 0) {
      pause.expires_after(usb_busy_pause);
      co_await pause.async_wait(await_tuple);
    }
    auto opened = UsbHandle::open(device_);
    status = opened.status;
    if (status == UsbStatus::ok) status = opened.handle->claim(device_.configuration, function_.interface);
    if (status == UsbStatus::ok) handle_ = std::move(opened.handle);
  }
  if (status != UsbStatus::ok) {
    link_.close(claim_error(device_, status));
    is_released_ = true;
  }
  pump();
}

awaitable<Result<std::unique_ptr<ByteStream>>> UsbClaim::open_stream(TimePoint deadline,
                                                                     std::chrono::milliseconds send_stall) {
  auto place = std::make_unique<Waiting>(shared_from_this());
  pump();
  while (!place->is_open() && !place->closed() && std::chrono::steady_clock::now() < deadline)
    co_await place->wait(place->news(), deadline);
  if (place->closed()) {
    const auto& reason = *place->closed();
    if (reason.code != ErrorCode::none) co_return reason;
    co_return make_error(ErrorCode::connection_error, device_.description() + ": closed the stream at once");
  }
  if (!place->is_open())
    co_return make_error(ErrorCode::connection_error, device_.description() + ": no stream in time");
  std::unique_ptr<ByteStream> stream = std::make_unique<UsbStream>(std::move(place), send_stall);
  co_return stream;
}

void UsbClaim::pump() {
  // Events end waits, whose owners may ask for more at once: their round follows this one.
  if (is_pumping_) return;
  is_pumping_ = true;
  const auto self = shared_from_this();
  if (handle_) pump_transfers();
  while (const auto event = link_.poll_event()) {
    const auto found = waiting_.find(event->stream);
    if (found != waiting_.end()) found->second->handle(*event);
  }
  if (link_.state() == UsbLinkState::closed) release();
  is_pumping_ = false;
}

void UsbClaim::pump_transfers() {
  const auto self = shared_from_this();
  if (const auto request = link_.poll_control()) {
    handle_->control(*request, [self](UsbStatus status, ByteSpan data) {
      self->link_.handle_control(status, data);
      self->pump();
    });
  }
  while (const auto write = link_.poll_write()) {
    // libusb takes a pointer to mutable bytes for both directions; it only reads these.
    const std::span bytes(const_cast<std::uint8_t*>(write->bytes.data()), write->bytes.size());
    handle_->bulk(pipes_.out.address, bytes, [self, slot = write->slot](UsbStatus status, std::size_t count) {
      self->link_.handle_written(slot, status, count);
      self->pump();
    });
  }
  while (const auto read = link_.poll_read()) {
    handle_->bulk(pipes_.in.address, read->into, [self, slot = read->slot](UsbStatus status, std::size_t count) {
      self->link_.handle_read(slot, status, count, std::chrono::steady_clock::now());
      self->pump();
    });
  }
  const auto timeout = link_.poll_timeout();
  if (timeout == TimePoint::max()) {
    read_stall_.disarm();
  } else if (!read_stall_.is_armed()) {
    const auto rest = timeout - std::chrono::steady_clock::now();
    read_stall_.arm(std::max(std::chrono::ceil<std::chrono::milliseconds>(rest), std::chrono::milliseconds(0)));
  }
}

void UsbClaim::handle_read_stall() {
  link_.handle_timeout(std::chrono::steady_clock::now());
  pump();
}

/// What is still posted is cancelled and keeps the claim until it has come back; the handle closes behind the last.
void UsbClaim::release() {
  read_stall_.disarm();
  is_released_ = true;
  if (!handle_) return;
  handle_->cancel();
  handle_->release();
  handle_.reset();
}

}  // namespace rr
