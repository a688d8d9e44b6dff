#include "node/transport/driver_device.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/container/static_vector.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/support/words.hpp"
#include "node/transport/await_tuple.hpp"
#include "node/transport/watchdog.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

constexpr std::size_t attribute_size = 256;
constexpr std::size_t max_devices = 1024;

/// Without the white space around it, which 1.2.8 keeps and stumbles over.
std::string read_attribute(const std::filesystem::path& path) {
  std::string text(attribute_size, '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  constexpr std::string_view blanks(" \t\r\n\0", 5);
  return std::string(trim(text, blanks));
}

class DriverStream final : public ByteStream {
 public:
  DriverStream(asio::posix::stream_descriptor descriptor, std::string peer, std::chrono::milliseconds send_stall)
      : descriptor_(std::move(descriptor)),
        peer_(std::move(peer)),
        stall_(descriptor_.get_executor(),
               [this] {
                 is_stalled_ = true;
                 close();
               }),
        send_stall_(send_stall) {}

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override {
    if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
    auto [error, bytes] = co_await descriptor_.async_read_some(asio::buffer(into.data(), into.size()), await_tuple);
    if (error == asio::error::eof) error = {};
    co_return ReadResult{error, bytes};
  }

  std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) override {
    return write_now(slices, 0, error);
  }

  awaitable<error_code> write(std::span<const ByteSpan> slices) override {
    const auto cancel_count = cancel_count_;
    std::size_t offset = 0;  // bytes of slices.front() that are written
    while (!slices.empty()) {
      error_code error;
      auto written = write_now(slices, offset, error);
      if (written == 0 && !error && !slices.front().empty()) {
        if (!stall_.is_armed()) stall_.arm(send_stall_);
        std::tie(error) = co_await descriptor_.async_wait(asio::posix::stream_descriptor::wait_write, await_tuple);
        if (is_stalled_) co_return asio::error::timed_out;
        if (!error && cancel_count != cancel_count_) error = asio::error::operation_aborted;
      }
      if (error) {
        stall_.disarm();
        co_return error;
      }
      if (written > 0) stall_.disarm();
      while (!slices.empty() && written >= slices.front().size() - offset) {
        written -= slices.front().size() - offset;
        slices = slices.subspan(1);
        offset = 0;
      }
      offset += written;
    }
    co_return error_code();
  }

  /// Devices have no half-closed streams: end() follows.
  void finish_sending() override {}

  void cancel() override {
    ++cancel_count_;
    error_code ignored;
    descriptor_.cancel(ignored);
  }

  /// What was written is the driver's; closing is all that there is to say.
  awaitable<void> end(const EndReason&) override {
    close();
    co_return;
  }

  void close() override {
    error_code ignored;
    descriptor_.close(ignored);
  }
  std::string peer() const override { return peer_; }
  asio::any_io_executor executor() override { return descriptor_.get_executor(); }

 private:
  std::size_t write_now(std::span<const ByteSpan> slices, std::size_t offset, error_code& error) {
    boost::container::static_vector<asio::const_buffer, 64> buffers;
    for (const auto& slice : slices) {
      if (buffers.size() == buffers.capacity()) break;
      const auto rest = buffers.empty() ? slice.subspan(offset) : slice;
      buffers.emplace_back(rest.data(), rest.size());
    }
    const auto written = descriptor_.write_some(buffers, error);
    if (error == asio::error::would_block) error = {};
    return written;
  }

  asio::posix::stream_descriptor descriptor_;
  std::string peer_;
  Deadline stall_;
  std::chrono::milliseconds send_stall_;
  bool is_stalled_ = false;
  unsigned cancel_count_ = 0;
};

}  // namespace

std::vector<DriverDevice> find_driver_devices(const DriverRoots& roots) {
  std::vector<DriverDevice> out;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(roots.classes, error), end;
       !error && entry != end && out.size() < max_devices; entry.increment(error)) {
    const auto& path = entry->path();
    DriverDevice device;
    device.name = path.filename().string();
    device.transport = read_attribute(path / "transport");
    if (const auto id = parse_node_id(read_attribute(path / "nodeid"))) device.id = *id;
    if (const auto name = read_attribute(path / "nodename"); is_valid_node_name(name)) device.node_name = name;
    const bool is_known = device.transport == "usb" || device.transport == "pci" || device.transport == "bluetooth";
    if (is_known && (!device.id.is_any() || !device.node_name.empty())) out.push_back(std::move(device));
  }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return out;
}

Result<std::unique_ptr<ByteStream>> open_driver_device(const asio::any_io_executor& executor,
                                                       const DriverDevice& device, const DriverRoots& roots,
                                                       std::chrono::milliseconds send_stall) {
  const auto path = roots.devices + "/" + device.name;
  const auto fail = [&path](int code, const std::string& what) {
    if (code == EACCES || code == EPERM)
      return make_error(ErrorCode::system_resource_permission_denied,
                        path + ": " + what + ": permission denied; this user needs to read and write it: see " +
                            "60-robotraconteur-usb.rules");
    return make_error(ErrorCode::connection_error, path + ": " + what + ": " + std::strerror(code));
  };
  const int number = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (number < 0) return fail(errno, "open");
  asio::posix::stream_descriptor descriptor(executor);
  error_code error;
  struct stat about {};
  if (::fstat(number, &about) != 0 || !S_ISCHR(about.st_mode)) {
    ::close(number);
    return fail(ENODEV, "not a character device");
  }
  descriptor.assign(number, error);
  if (error) {
    ::close(number);
    return fail(error.value(), "wait for data");
  }
  descriptor.non_blocking(true, error);
  std::unique_ptr<ByteStream> stream = std::make_unique<DriverStream>(std::move(descriptor), path, send_stall);
  return stream;
}

}  // namespace rr
