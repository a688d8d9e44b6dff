// rr-usb-emulator SOCKET PORT NODENAME: a Robot Raconteur USB device behind a QEMU controller (usbredir protocol).
//
// Each stream of the device is joined to a connection to 127.0.0.1:PORT, where a node listens. A stream that begins
// with "TEST <command>\n" instead is for the tests: see Emulator::obey(). Ends when QEMU does.
#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <usbredirparser.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "test/core/hardware/simulated_device.hpp"

namespace {

using namespace rr;
using rr::test::SimulatedDevice;
using Clock = std::chrono::steady_clock;

constexpr std::size_t joined_high_mark = 256 * 1024;

[[noreturn]] void die(const char* what) {
  std::perror(what);
  std::exit(1);
}

std::uint8_t redir_status(UsbStatus status) {
  switch (status) {
    case UsbStatus::ok:
      return usb_redir_success;
    case UsbStatus::stall:
      return usb_redir_stall;
    default:
      return usb_redir_ioerror;
  }
}

class Emulator {
 public:
  Emulator(int qemu, std::uint16_t port, std::string node_name)
      : qemu_(qemu), port_(port), node_name_(std::move(node_name)), parser_(usbredirparser_create()) {
    device_ = make_device();
    parser_->priv = this;
    parser_->log_func = [](void*, int level, const char* text) {
      if (level <= usbredirparser_warning) std::fprintf(stderr, "usbredir: %s\n", text);
    };
    parser_->read_func = [](void* self, std::uint8_t* data, int count) { return of(self).read_qemu(data, count); };
    parser_->write_func = [](void* self, std::uint8_t* data, int count) {
      const auto written = ::write(of(self).qemu_, data, static_cast<std::size_t>(count));
      return written < 0 ? (errno == EAGAIN ? 0 : -1) : static_cast<int>(written);
    };
    parser_->hello_func = [](void* self, usb_redir_hello_header*) { of(self).plug_in(); };
    parser_->reset_func = [](void*) {};
    parser_->set_configuration_func = [](void* self, std::uint64_t id, usb_redir_set_configuration_header* header) {
      usb_redir_configuration_status_header status{usb_redir_success, header->configuration};
      usbredirparser_send_configuration_status(of(self).parser_, id, &status);
    };
    parser_->get_configuration_func = [](void* self, std::uint64_t id) {
      usb_redir_configuration_status_header status{usb_redir_success, 1};
      usbredirparser_send_configuration_status(of(self).parser_, id, &status);
    };
    parser_->set_alt_setting_func = [](void* self, std::uint64_t id, usb_redir_set_alt_setting_header* header) {
      usb_redir_alt_setting_status_header status{usb_redir_success, header->interface, header->alt};
      usbredirparser_send_alt_setting_status(of(self).parser_, id, &status);
    };
    parser_->get_alt_setting_func = [](void* self, std::uint64_t id, usb_redir_get_alt_setting_header* header) {
      usb_redir_alt_setting_status_header status{usb_redir_success, header->interface, 0};
      usbredirparser_send_alt_setting_status(of(self).parser_, id, &status);
    };
    parser_->control_packet_func = [](void* self, std::uint64_t id, usb_redir_control_packet_header* header,
                                      std::uint8_t* data, int size) { of(self).control(id, *header, data, size); };
    parser_->bulk_packet_func = [](void* self, std::uint64_t id, usb_redir_bulk_packet_header* header,
                                   std::uint8_t* data, int size) { of(self).bulk(id, *header, data, size); };
    parser_->cancel_data_packet_func = [](void* self, std::uint64_t id) { of(self).cancel(id); };
    std::uint32_t caps[USB_REDIR_CAPS_SIZE] = {};
    for (const int cap : {usb_redir_cap_connect_device_version, usb_redir_cap_ep_info_max_packet_size,
                          usb_redir_cap_64bits_ids, usb_redir_cap_32bits_bulk_length})
      usbredirparser_caps_set_cap(caps, cap);
    usbredirparser_init(parser_, "rr-usb-emulator", caps, USB_REDIR_CAPS_SIZE, usbredirparser_fl_usb_host);
  }

  void run() {
    for (;;) {
      move_data();
      while (usbredirparser_has_data_to_write(parser_))
        if (usbredirparser_do_write(parser_) < 0) std::exit(0);
      std::vector<pollfd> polls{{qemu_, POLLIN, 0}};
      for (const auto& [id, stream] : streams_) {
        if (stream.socket < 0) continue;
        const bool wants_read = device_->unsent_bytes(id) < joined_high_mark;
        polls.push_back(
            {stream.socket, static_cast<short>((wants_read ? POLLIN : 0) | (stream.out.empty() ? 0 : POLLOUT)), 0});
      }
      ::poll(polls.data(), polls.size(), plug_at_ || unplug_at_ ? 20 : -1);
      if (polls[0].revents != 0 && usbredirparser_do_read(parser_) < 0) std::exit(0);
      if (unplug_at_ && Clock::now() >= *unplug_at_) unplug();
      if (plug_at_ && Clock::now() >= *plug_at_) plug_in();
    }
  }

 private:
  struct Stream {
    enum class Kind { unknown, joined, echo, sink, deaf, done } kind = Kind::unknown;
    int socket = -1;
    Bytes out;   ///< to the node
    Bytes head;  ///< while it is unknown what the stream is
  };
  struct Bulk {
    std::uint64_t id;
    usb_redir_bulk_packet_header header;
    Bytes data;
  };

  static Emulator& of(void* self) { return *static_cast<Emulator*>(self); }

  std::unique_ptr<SimulatedDevice> make_device() const {
    test::SimulatedDeviceOptions options;
    options.name = node_name_;
    options.interface = interface_;
    options.packet_size = 512;
    options.max_input = 8192;
    return std::make_unique<SimulatedDevice>(options);
  }

  int read_qemu(std::uint8_t* data, int count) {
    const auto got = ::read(qemu_, data, static_cast<std::size_t>(count));
    if (got == 0) std::exit(0);
    return got < 0 ? (errno == EAGAIN ? 0 : -1) : static_cast<int>(got);
  }

  void plug_in() {
    plug_at_.reset();
    device_ = make_device();
    usb_redir_ep_info_header endpoints{};
    std::fill(std::begin(endpoints.type), std::end(endpoints.type), std::uint8_t{usb_redir_type_invalid});
    const auto add = [&](std::uint8_t address, std::uint8_t type, std::uint16_t size) {
      const auto at = static_cast<std::size_t>((address & 0x80) >> 3 | (address & 0x0F));
      endpoints.type[at] = type;
      endpoints.max_packet_size[at] = size;
      endpoints.interface[at] = interface_;
    };
    add(0x00, usb_redir_type_control, 64);
    add(0x80, usb_redir_type_control, 64);
    add(device_->out_address(), usb_redir_type_bulk, 512);
    add(device_->in_address(), usb_redir_type_bulk, 512);
    usb_redir_interface_info_header interfaces{};
    interfaces.interface_count = interface_ + 1u;
    interfaces.interface[1] = 1;
    interfaces.interface_class[0] = 0xFE;
    interfaces.interface_class[interface_] = 0xFF;
    usb_redir_device_connect_header device{};
    device.speed = usb_redir_speed_high;
    device.vendor_id = 0x1209;
    device.product_id = 0x5252;
    device.device_version_bcd = 0x100;
    usbredirparser_send_interface_info(parser_, &interfaces);
    usbredirparser_send_ep_info(parser_, &endpoints);
    usbredirparser_send_device_connect(parser_, &device);
  }

  void unplug() {
    unplug_at_.reset();
    device_->unplug();
    for (auto& [id, stream] : streams_) drop(stream);
    streams_.clear();
    reads_.clear();
    writes_.clear();
    usbredirparser_send_device_disconnect(parser_);
    plug_at_ = Clock::now() + std::chrono::seconds(1);
  }

  // --- the bus ---

  void control(std::uint64_t id, usb_redir_control_packet_header header, std::uint8_t* data, int size) {
    const UsbControl request{header.requesttype, header.request, header.value,
                             header.index,       header.length,  data ? Bytes(data, data + size) : Bytes()};
    if (data) usbredirparser_free_packet_data(parser_, data);
    auto reply = device_->control(request);
    header.status = redir_status(reply.status);
    header.length = static_cast<std::uint16_t>(reply.data.size());
    usbredirparser_send_control_packet(parser_, id, &header, reply.data.data(), static_cast<int>(reply.data.size()));
  }

  void bulk(std::uint64_t id, const usb_redir_bulk_packet_header& header, std::uint8_t* data, int size) {
    auto& queue = (header.endpoint & 0x80) != 0 ? reads_ : writes_;
    queue.push_back({id, header, data ? Bytes(data, data + size) : Bytes()});
    if (data) usbredirparser_free_packet_data(parser_, data);
  }

  void answer(const Bulk& bulk, UsbStatus status, Bytes data) {
    auto header = bulk.header;
    const auto size = static_cast<std::uint32_t>(data.size());
    header.status = redir_status(status);
    if ((header.endpoint & 0x80) != 0) {
      header.length = static_cast<std::uint16_t>(size);
      header.length_high = static_cast<std::uint16_t>(size >> 16);
    }
    usbredirparser_send_bulk_packet(parser_, bulk.id, &header, data.data(), static_cast<int>(size));
  }

  void cancel(std::uint64_t id) {
    for (auto* queue : {&reads_, &writes_}) {
      const auto found = std::find_if(queue->begin(), queue->end(), [id](const Bulk& bulk) { return bulk.id == id; });
      if (found == queue->end()) continue;
      auto header = found->header;
      header.status = usb_redir_cancelled;
      header.length = header.length_high = 0;
      queue->erase(found);
      usbredirparser_send_bulk_packet(parser_, id, &header, nullptr, 0);
      return;
    }
  }

  /// Until nothing changes: transfers that can be answered, streams that have something to say.
  void move_data() {
    for (bool has_moved = true; has_moved;) {
      has_moved = false;
      while (!writes_.empty()) {
        const auto status = device_->bulk_out(writes_.front().data);
        if (!status) break;
        answer(writes_.front(), *status, {});
        writes_.pop_front();
        has_moved = true;
      }
      for (const auto id : device_->take_closed()) {
        const auto found = streams_.find(id);
        if (found == streams_.end()) continue;
        drop(found->second);
        streams_.erase(found);
      }
      for (const auto id : device_->take_opened()) streams_[id] = {};
      for (auto stream = streams_.begin(); stream != streams_.end();) {
        // A command may end all streams.
        const auto id = stream->first;
        has_moved = serve(id, stream->second) || has_moved;
        stream = streams_.upper_bound(id);
      }
      while (!reads_.empty()) {
        auto reply = device_->bulk_in();
        if (!reply) break;
        answer(reads_.front(), reply->status, std::move(reply->data));
        reads_.pop_front();
        has_moved = true;
      }
    }
  }

  // --- streams ---

  static void drop(Stream& stream) {
    if (stream.socket >= 0) ::close(stream.socket);
    stream.socket = -1;
    stream.kind = Stream::Kind::done;
  }

  /// Returns whether something was moved.
  bool serve(std::int32_t id, Stream& stream) {
    switch (stream.kind) {
      case Stream::Kind::unknown: {
        const auto input = device_->take_input(id);
        stream.head.insert(stream.head.end(), input.begin(), input.end());
        if (stream.head.size() >= 4) introduce(id, stream);
        return !input.empty();
      }
      case Stream::Kind::joined:
        return exchange_with_node(id, stream);
      case Stream::Kind::echo: {
        if (device_->unsent_bytes(id) > joined_high_mark) return false;
        const auto input = device_->take_input(id);
        device_->send(id, input);
        return !input.empty();
      }
      case Stream::Kind::sink: {
        const auto count = device_->take_input(id).size();
        sunk_ += count;
        return count > 0;
      }
      case Stream::Kind::deaf:
      case Stream::Kind::done:
        break;
    }
    return false;
  }

  void introduce(std::int32_t id, Stream& stream) {
    const std::string text(stream.head.begin(), stream.head.end());
    if (text.rfind("TEST", 0) == 0) {
      const auto end = text.find('\n');
      if (end == std::string::npos) return;
      const Bytes rest(stream.head.begin() + static_cast<std::ptrdiff_t>(end) + 1, stream.head.end());
      obey(id, stream, text.substr(5, end - 5), rest);
      return;
    }
    stream.kind = Stream::Kind::joined;
    stream.out = std::move(stream.head);
    stream.socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port_);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(stream.socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      std::perror("connect to the node");
      device_->close(id);
      drop(stream);
      return;
    }
    ::fcntl(stream.socket, F_SETFL, O_NONBLOCK);
  }

  void obey(std::int32_t id, Stream& stream, const std::string& command, const Bytes& rest) {
    stream.kind = Stream::Kind::done;
    if (command == "echo") {
      stream.kind = Stream::Kind::echo;
      device_->send(id, rest);
    } else if (command == "deaf") {
      stream.kind = Stream::Kind::deaf;
    } else if (command == "close") {
      device_->send(id, as_bytes("bye"));
      device_->close(id);
    } else if (command == "stall-in") {
      device_->stall_next_in();
    } else if (command == "stall-out") {
      device_->stall_next_out();
    } else if (command == "wrong-length") {
      device_->send_raw({9, 0, 0, 0, static_cast<std::uint8_t>(id), 0, 0, 0});
    } else if (command == "sink") {
      stream.kind = Stream::Kind::sink;
      sunk_ = rest.size();
    } else if (command == "sunk") {
      device_->send(id, as_bytes(std::to_string(sunk_)));
      device_->close(id);
    } else if (command == "interface-0") {
      interface_ = 0;
      unplug();
    } else if (command == "unplug-soon") {
      unplug_at_ = Clock::now() + std::chrono::milliseconds(300);  // the stream's writes are pending by then
    } else {
      std::fprintf(stderr, "unknown command '%s'\n", command.c_str());
      device_->close(id);
    }
  }

  bool exchange_with_node(std::int32_t id, Stream& stream) {
    bool has_moved = false;
    if (stream.out.size() < joined_high_mark) {
      const auto input = device_->take_input(id);
      stream.out.insert(stream.out.end(), input.begin(), input.end());
      has_moved = !input.empty();
    }
    if (!stream.out.empty()) {
      const auto written = ::send(stream.socket, stream.out.data(), stream.out.size(), MSG_NOSIGNAL);
      if (written > 0) stream.out.erase(stream.out.begin(), stream.out.begin() + written);
    }
    std::uint8_t buffer[16384];
    while (device_->unsent_bytes(id) < joined_high_mark) {
      const auto got = ::recv(stream.socket, buffer, sizeof(buffer), 0);
      if (got < 0 && (errno == EAGAIN || errno == EINTR)) break;
      if (got <= 0) {
        device_->close(id);
        drop(stream);
        break;
      }
      device_->send(id, {buffer, static_cast<std::size_t>(got)});
      has_moved = true;
    }
    return has_moved;
  }

  int qemu_;
  std::uint16_t port_;
  std::string node_name_;
  usbredirparser* parser_;
  std::unique_ptr<SimulatedDevice> device_;
  std::uint8_t interface_ = 1;  ///< not 0, which is all that 1.2.8 can
  std::size_t sunk_ = 0;        ///< bytes that the latest sink got
  std::deque<Bulk> reads_;
  std::deque<Bulk> writes_;
  std::map<std::int32_t, Stream> streams_;
  std::optional<Clock::time_point> plug_at_;
  std::optional<Clock::time_point> unplug_at_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: rr-usb-emulator SOCKET PORT NODENAME\n");
    return 2;
  }
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, argv[1], sizeof(address.sun_path) - 1);
  ::unlink(argv[1]);
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  if (::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 || ::listen(listener, 1) != 0)
    die(argv[1]);
  std::puts("{\"ready\": true}");
  std::fflush(stdout);
  const int qemu = ::accept(listener, nullptr, nullptr);
  if (qemu < 0) die("accept");
  ::fcntl(qemu, F_SETFL, O_NONBLOCK);
  Emulator(qemu, static_cast<std::uint16_t>(std::atoi(argv[2])), argv[3]).run();
}
