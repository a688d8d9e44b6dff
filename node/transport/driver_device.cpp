#include "node/transport/driver_device.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/support/words.hpp"
#include "node/transport/descriptor_stream.hpp"

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

class DriverStream final : public DescriptorStream<asio::posix::stream_descriptor> {
 public:
  using DescriptorStream::DescriptorStream;

  /// Devices have no half-closed streams: end() follows.
  void finish_sending() override {}

  /// What was written is the driver's; closing is all that there is to say.
  awaitable<void> end(const EndReason&) override {
    close();
    co_return;
  }
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
      return make_error(
          ErrorCode::system_resource_permission_denied,
          path + ": " + what + ": permission denied; this user needs to read and write it: see " +
              "60-robotraconteur-usb.rules, and /etc/apparmor.d/local/rrgate where AppArmor confines the service");
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
  std::unique_ptr<ByteStream> stream = std::make_unique<DriverStream>(std::move(descriptor), path, send_stall);
  return stream;
}

}  // namespace rr
