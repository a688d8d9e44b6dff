#include "node/transport/usb_context.hpp"

#include <libusb-1.0/libusb.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cstdio>

#include "core/support/hex.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

UsbStatus status_of_error(int code) {
  switch (code) {
    case LIBUSB_SUCCESS:
      return UsbStatus::ok;
    case LIBUSB_ERROR_PIPE:
      return UsbStatus::stall;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return UsbStatus::no_device;
    case LIBUSB_ERROR_TIMEOUT:
      return UsbStatus::timed_out;
    case LIBUSB_ERROR_OVERFLOW:
      return UsbStatus::overflow;
    case LIBUSB_ERROR_BUSY:
      return UsbStatus::busy;
    case LIBUSB_ERROR_ACCESS:
      return UsbStatus::denied;
    default:
      return UsbStatus::failed;
  }
}

UsbStatus status_of_transfer(libusb_transfer_status status) {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return UsbStatus::ok;
    case LIBUSB_TRANSFER_STALL:
      return UsbStatus::stall;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return UsbStatus::no_device;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return UsbStatus::timed_out;
    case LIBUSB_TRANSFER_CANCELLED:
      return UsbStatus::cancelled;
    case LIBUSB_TRANSFER_OVERFLOW:
      return UsbStatus::overflow;
    case LIBUSB_TRANSFER_ERROR:
      break;
  }
  return UsbStatus::failed;
}

std::vector<UsbInterface> interfaces_of(const libusb_config_descriptor& configuration) {
  std::vector<UsbInterface> out;
  for (int i = 0; i < configuration.bNumInterfaces; ++i) {
    const auto& interface = configuration.interface[i];
    for (int a = 0; a < interface.num_altsetting; ++a) {
      const auto& setting = interface.altsetting[a];
      UsbInterface each{setting.bInterfaceNumber, setting.bAlternateSetting, setting.bInterfaceClass, {}};
      for (int e = 0; e < setting.bNumEndpoints; ++e) {
        const auto& endpoint = setting.endpoint[e];
        const bool is_bulk = (endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) == LIBUSB_TRANSFER_TYPE_BULK;
        each.endpoints.push_back(
            {endpoint.bEndpointAddress, is_bulk, static_cast<std::uint16_t>(endpoint.wMaxPacketSize & 0x7FF)});
      }
      out.push_back(std::move(each));
    }
  }
  return out;
}

std::string path_of(libusb_device* device) {
  std::array<std::uint8_t, 7> ports;
  const int count = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string out = std::to_string(libusb_get_bus_number(device));
  for (int i = 0; i < count; ++i) out += (i == 0 ? "-" : ".") + std::to_string(ports[static_cast<std::size_t>(i)]);
  return out;
}

}  // namespace

std::string UsbDevice::description() const {
  return "USB device " + path + " (" + hex_text(vendor_id, 4) + ":" + hex_text(product_id, 4) + ")";
}

// --- context ---

struct UsbContext::Watched {
  Watched(const asio::any_io_executor& executor, int number, short mask)
      : descriptor(executor, number), waits{{{POLLIN, false}, {POLLOUT, false}}}, events(mask) {}

  struct Wait {
    short event;
    bool is_pending;
  };
  asio::posix::stream_descriptor descriptor;
  std::array<Wait, 2> waits;
  short events;
};

Result<std::shared_ptr<UsbContext>> UsbContext::make(const asio::any_io_executor& executor) {
  std::shared_ptr<UsbContext> context(new UsbContext(executor));
  if (const int code = libusb_init(&context->context_); code != 0)
    return make_error(ErrorCode::system_resource_error, std::string("libusb: ") + libusb_strerror(code));
  const auto added = [](int descriptor, short events, void* self) {
    static_cast<UsbContext*>(self)->watch(descriptor, events);
  };
  const auto removed = [](int descriptor, void* self) { static_cast<UsbContext*>(self)->unwatch(descriptor); };
  libusb_set_pollfd_notifiers(context->context_, added, removed, context.get());
  const auto** descriptors = libusb_get_pollfds(context->context_);
  for (const auto** each = descriptors; each && *each; ++each) context->watch((*each)->fd, (*each)->events);
  libusb_free_pollfds(descriptors);
  return context;
}

UsbContext::~UsbContext() {
  if (!context_) return;
  libusb_set_pollfd_notifiers(context_, nullptr, nullptr, nullptr);
  while (!watched_.empty()) unwatch(watched_.begin()->first);
  libusb_exit(context_);
}

void UsbContext::watch(int descriptor, short events) {
  watched_[descriptor] = std::make_shared<Watched>(executor_, descriptor, events);
  wait();
}

/// libusb closes the descriptor itself, right after this.
void UsbContext::unwatch(int descriptor) {
  const auto found = watched_.find(descriptor);
  if (found == watched_.end()) return;
  found->second->descriptor.release();
  watched_.erase(found);
}

/// Only while there are transfers: an idle context must not keep a loop running.
void UsbContext::wait() {
  if (pending_transfers_ == 0) return;
  for (const auto& [number, watched] : watched_)
    for (auto& each : watched->waits) {
      if (each.is_pending || (watched->events & each.event) == 0) continue;
      each.is_pending = true;
      const auto kind =
          each.event == POLLIN ? asio::posix::stream_descriptor::wait_read : asio::posix::stream_descriptor::wait_write;
      watched->descriptor.async_wait(
          kind, [weak = weak_from_this(), watched = watched, &each](const boost::system::error_code& error) {
            each.is_pending = false;
            const auto self = weak.lock();
            if (!self) return;
            if (!error) self->handle_events();
            self->wait();
          });
    }
}

void UsbContext::stop_waiting() {
  boost::system::error_code ignored;
  for (const auto& [number, watched] : watched_) watched->descriptor.cancel(ignored);
}

void UsbContext::handle_events() {
  timeval at_once{0, 0};
  libusb_handle_events_timeout_completed(context_, &at_once, nullptr);
}

std::vector<UsbDevice> UsbContext::devices() {
  std::vector<UsbDevice> out;
  libusb_device** list = nullptr;
  const auto count = libusb_get_device_list(context_, &list);
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor descriptor;
    libusb_config_descriptor* configuration = nullptr;
    if (libusb_get_device_descriptor(list[i], &descriptor) != 0) continue;
    if (libusb_get_config_descriptor(list[i], 0, &configuration) != 0) continue;
    UsbDevice device;
    device.context = shared_from_this();
    // The context goes last: members are destroyed in reverse order.
    device.device = std::shared_ptr<libusb_device>(libusb_ref_device(list[i]), libusb_unref_device);
    const int bus = libusb_get_bus_number(list[i]);
    const int address = libusb_get_device_address(list[i]);
    device.key = std::to_string(bus) + "," + std::to_string(address);
    device.path = path_of(list[i]);
    char node[40];
    std::snprintf(node, sizeof(node), "/dev/bus/usb/%03d/%03d", bus, address);
    device.node = node;
    device.vendor_id = descriptor.idVendor;
    device.product_id = descriptor.idProduct;
    device.usb_version = descriptor.bcdUSB;
    device.class_code = descriptor.bDeviceClass;
    device.configuration = configuration->bConfigurationValue;
    device.interfaces = interfaces_of(*configuration);
    libusb_free_config_descriptor(configuration);
    out.push_back(std::move(device));
  }
  if (count >= 0) libusb_free_device_list(list, 1);
  return out;
}

void UsbContext::shut_down() {
  constexpr std::chrono::seconds patience{1};
  const auto self = shared_from_this();  // the last transfer may hold the last reference
  for (const auto& weak : handles_)
    if (const auto handle = weak.lock()) handle->cancel();
  const auto until = std::chrono::steady_clock::now() + patience;
  while (pending_transfers_ > 0 && std::chrono::steady_clock::now() < until) {
    timeval slice{0, 50'000};
    libusb_handle_events_timeout_completed(context_, &slice, nullptr);
  }
  libusb_set_pollfd_notifiers(context_, nullptr, nullptr, nullptr);
  while (!watched_.empty()) unwatch(watched_.begin()->first);
}

// --- handle ---

struct UsbHandle::Transfer {
  explicit Transfer(std::shared_ptr<UsbHandle> owner) : handle(std::move(owner)), raw(libusb_alloc_transfer(0)) {}
  ~Transfer() { libusb_free_transfer(raw); }
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;

  std::shared_ptr<UsbHandle> handle;
  libusb_transfer* raw;
  Bytes buffer;  ///< control: setup and data
  std::function<void(UsbStatus, ByteSpan)> control_done;
  std::function<void(UsbStatus, std::size_t)> bulk_done;

  void finish(UsbStatus status) {
    const auto count = static_cast<std::size_t>(std::max(raw->actual_length, 0));
    if (bulk_done) bulk_done(status, count);
    if (control_done) control_done(status, ByteSpan(buffer).subspan(LIBUSB_CONTROL_SETUP_SIZE).first(count));
  }

  static void LIBUSB_CALL completed(libusb_transfer* raw) {
    std::unique_ptr<Transfer> self(static_cast<Transfer*>(raw->user_data));
    auto& handle = *self->handle;
    std::erase(handle.pending_, self.get());
    if (--handle.context_->pending_transfers_ == 0) handle.context_->stop_waiting();
    self->finish(status_of_transfer(raw->status));
    // The last reference to handle and context must not go while libusb handles its events.
    asio::post(handle.context_->executor_, [kept = std::shared_ptr<Transfer>(std::move(self))] {});
  }
};

UsbHandle::Opened UsbHandle::open(const UsbDevice& device) {
  libusb_device_handle* raw = nullptr;
  if (const int code = libusb_open(device.device.get(), &raw); code != 0) return {status_of_error(code), nullptr};
  std::shared_ptr<UsbHandle> handle(new UsbHandle(device.context, raw));
  std::erase_if(device.context->handles_, [](const auto& weak) { return weak.expired(); });
  device.context->handles_.push_back(handle);
  return {UsbStatus::ok, handle};
}

UsbHandle::~UsbHandle() {
  release();
  libusb_close(handle_);
}

UsbStatus UsbHandle::claim(std::uint8_t configuration, std::uint8_t interface) {
  int active = 0;
  if (const int code = libusb_get_configuration(handle_, &active); code != 0) return status_of_error(code);
  if (active != configuration)
    if (const int code = libusb_set_configuration(handle_, configuration); code != 0) return status_of_error(code);
  if (const int code = libusb_claim_interface(handle_, interface); code != 0) return status_of_error(code);
  claimed_interface_ = interface;
  return UsbStatus::ok;
}

void UsbHandle::release() {
  if (claimed_interface_ >= 0) libusb_release_interface(handle_, claimed_interface_);
  claimed_interface_ = -1;
}

void UsbHandle::control(const UsbControl& request, std::function<void(UsbStatus, ByteSpan)> done) {
  auto transfer = std::make_unique<Transfer>(shared_from_this());
  transfer->control_done = std::move(done);
  transfer->buffer.resize(LIBUSB_CONTROL_SETUP_SIZE + request.length);
  libusb_fill_control_setup(transfer->buffer.data(), request.request_type, request.request, request.value,
                            request.index, request.length);
  std::copy(request.data.begin(), request.data.end(), transfer->buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE);
  libusb_fill_control_transfer(transfer->raw, handle_, transfer->buffer.data(), &Transfer::completed, transfer.get(),
                               static_cast<unsigned>(usb_control_timeout.count()));
  submit(std::move(transfer));
}

void UsbHandle::bulk(std::uint8_t endpoint, std::span<std::uint8_t> buffer,
                     std::function<void(UsbStatus, std::size_t)> done) {
  auto transfer = std::make_unique<Transfer>(shared_from_this());
  transfer->bulk_done = std::move(done);
  libusb_fill_bulk_transfer(transfer->raw, handle_, endpoint, buffer.data(), static_cast<int>(buffer.size()),
                            &Transfer::completed, transfer.get(), 0);
  submit(std::move(transfer));
}

void UsbHandle::submit(std::unique_ptr<Transfer> transfer) {
  const int code = libusb_submit_transfer(transfer->raw);
  if (code == 0) {
    pending_.push_back(transfer.release());
    if (++context_->pending_transfers_ == 1) context_->wait();
    return;
  }
  asio::post(context_->executor_, [code, failed = std::shared_ptr<Transfer>(std::move(transfer))] {
    failed->raw->actual_length = 0;
    failed->finish(status_of_error(code));
  });
}

void UsbHandle::cancel() {
  for (auto* transfer : pending_) libusb_cancel_transfer(transfer->raw);
}

}  // namespace rr
