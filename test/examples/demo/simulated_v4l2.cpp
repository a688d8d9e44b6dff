#include "test/examples/demo/simulated_v4l2.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>

namespace rrgate::demo {

namespace {

void put_text(const std::string& text, __u8* to, std::size_t size) {
  std::copy_n(text.begin(), std::min(text.size(), size), to);
}

}  // namespace

SimulatedV4l2::~SimulatedV4l2() {
  for (const auto& [descriptor, opened] : opened_) ::close(descriptor);
  for (const auto& [data, size] : mapped_) delete[] static_cast<std::uint8_t*>(data);
}

SimulatedDevice& SimulatedV4l2::plug_in(const std::string& path, SimulatedDevice device) {
  return devices_[path] = std::move(device);
}

void SimulatedV4l2::unplug(const std::string& path) {
  devices_.erase(path);
  for (auto& [descriptor, opened] : opened_)
    if (opened.path == path) opened.is_gone = true;
  wake(path);
}

void SimulatedV4l2::give(const std::string& path, SimulatedFrame frame) {
  at(path).frames.push_back(std::move(frame));
  wake(path);
}

void SimulatedV4l2::wake(const std::string& path) {
  for (const auto& [descriptor, opened] : opened_)
    if (opened.path == path) ::eventfd_write(descriptor, 1);
}

std::vector<std::string> SimulatedV4l2::list() {
  std::vector<std::string> paths;
  for (const auto& [path, device] : devices_) paths.push_back(path);
  return paths;
}

int SimulatedV4l2::open(const std::string& path) {
  const auto found = devices_.find(path);
  if (found == devices_.end()) return -ENOENT;
  if (found->second.open_error != 0) return -found->second.open_error;
  ++found->second.times_opened;
  const int descriptor = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  opened_[descriptor] = {path};
  return descriptor;
}

void SimulatedV4l2::close(int descriptor) {
  opened_.erase(descriptor);
  ::close(descriptor);
}

int SimulatedV4l2::control(int descriptor, unsigned long request, void* argument) {
  auto& opened = opened_.at(descriptor);
  if (opened.is_gone) return ENODEV;
  auto& device = devices_.at(opened.path);
  if (const auto error = device.errors.find(request); error != device.errors.end()) return error->second;
  if (request == VIDIOC_QUERYCAP) {
    auto& about = *static_cast<v4l2_capability*>(argument);
    put_text(device.name, about.card, sizeof(about.card));
    put_text(device.port, about.bus_info, sizeof(about.bus_info));
    // What all devices of the hardware can do together; this one is meant.
    about.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_DEVICE_CAPS;
    about.device_caps = device.capabilities;
    return 0;
  }
  if (request == VIDIOC_ENUM_FMT) {
    auto& offered = *static_cast<v4l2_fmtdesc*>(argument);
    if (offered.index >= device.formats.size()) return EINVAL;
    offered.pixelformat = device.formats[offered.index];
    return 0;
  }
  if (request == VIDIOC_S_FMT) {
    auto& picture = static_cast<v4l2_format*>(argument)->fmt.pix;
    device.asked_format = picture.pixelformat;
    picture.width = device.width;
    picture.height = device.height;
    picture.bytesperline = device.step;
    picture.sizeimage = device.frame_bytes;
    picture.pixelformat = device.format.value_or(picture.pixelformat);
    return 0;
  }
  if (request == VIDIOC_REQBUFS) {
    auto& wanted = static_cast<v4l2_requestbuffers*>(argument)->count;
    wanted = device.buffers < 4 ? std::min(wanted, device.buffers) : device.buffers;
    return 0;
  }
  if (request == VIDIOC_QUERYBUF) {
    auto& buffer = *static_cast<v4l2_buffer*>(argument);
    if (buffer.index >= device.buffers) return EINVAL;
    buffer.length = device.buffer_bytes.value_or(device.frame_bytes);
    buffer.m.offset = buffer.index * 4096;
    return 0;
  }
  if (request == VIDIOC_QBUF) {
    opened.queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
    return 0;
  }
  if (request == VIDIOC_STREAMON || request == VIDIOC_STREAMOFF) {
    device.is_streaming = request == VIDIOC_STREAMON;
    if (device.is_streaming && (!device.frames.empty() || device.always)) ::eventfd_write(descriptor, 1);
    return 0;
  }
  return request == VIDIOC_DQBUF ? dequeue(opened, descriptor, *static_cast<v4l2_buffer*>(argument)) : ENOTTY;
}

int SimulatedV4l2::dequeue(Opened& opened, int descriptor, v4l2_buffer& buffer) {
  auto& device = devices_.at(opened.path);
  if (device.frames.empty() && device.always) device.frames.push_back(*device.always);
  if (device.frames.empty() || opened.queued.empty()) {
    eventfd_t count = 0;
    ::eventfd_read(descriptor, &count);
    return EAGAIN;
  }
  const auto frame = std::move(device.frames.front());
  device.frames.pop_front();
  const auto index = opened.queued.front();
  opened.queued.pop_front();
  std::copy_n(frame.bytes.begin(),
              std::min<std::size_t>(frame.bytes.size(), device.buffer_bytes.value_or(device.frame_bytes)),
              opened.buffers.at(index));
  buffer.index = frame.index.value_or(index);
  buffer.bytesused = frame.bytes_used.value_or(static_cast<std::uint32_t>(frame.bytes.size()));
  buffer.flags = frame.flags;
  return 0;
}

void* SimulatedV4l2::map(int descriptor, std::size_t length, std::int64_t offset) {
  if (refuses_to_map) return nullptr;
  auto* const data = new std::uint8_t[length]{};
  opened_.at(descriptor).buffers[static_cast<std::uint32_t>(offset / 4096)] = data;
  mapped_[data] = length;
  return data;
}

void SimulatedV4l2::unmap(void* data, std::size_t length) {
  if (mapped_.at(data) != length) std::abort();
  mapped_.erase(data);
  delete[] static_cast<std::uint8_t*>(data);
}

bool run_until(boost::asio::io_context& io, const std::function<bool()>& is_done) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!is_done() && std::chrono::steady_clock::now() < deadline) {
    io.restart();
    io.run_one_for(std::chrono::milliseconds(100));
  }
  return is_done();
}

}  // namespace rrgate::demo
