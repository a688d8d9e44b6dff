#include "examples/demo/v4l2_system.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>

namespace rrgate::demo {

namespace {

constexpr std::size_t max_video_devices = 64;

/// -1: not the name of a video device.
int video_number(const std::string& name) {
  constexpr std::string_view prefix = "video";
  if (!name.starts_with(prefix)) return -1;
  int number = -1;
  const auto [end, error] = std::from_chars(name.data() + prefix.size(), name.data() + name.size(), number);
  return error == std::errc{} && end == name.data() + name.size() ? number : -1;
}

}  // namespace

std::vector<std::string> LinuxV4l2::list() {
  std::vector<int> numbers;
  std::error_code error;
  for (std::filesystem::directory_iterator at("/dev", error), end; !error && at != end; at.increment(error))
    if (const int number = video_number(at->path().filename().string()); number >= 0) numbers.push_back(number);
  std::sort(numbers.begin(), numbers.end());
  numbers.resize(std::min(numbers.size(), max_video_devices));
  std::vector<std::string> paths;
  paths.reserve(numbers.size());
  for (const int number : numbers) paths.push_back("/dev/video" + std::to_string(number));
  return paths;
}

int LinuxV4l2::open(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return descriptor >= 0 ? descriptor : -errno;
}

void LinuxV4l2::close(int descriptor) {
  ::close(descriptor);
}

int LinuxV4l2::control(int descriptor, unsigned long request, void* argument) {
  for (;;)
    if (::ioctl(descriptor, request, argument) != -1)
      return 0;
    else if (errno != EINTR)
      return errno;
}

void* LinuxV4l2::map(int descriptor, std::size_t length, std::int64_t offset) {
  void* const data = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, descriptor, offset);
  return data == MAP_FAILED ? nullptr : data;
}

void LinuxV4l2::unmap(void* data, std::size_t length) {
  ::munmap(data, length);
}

}  // namespace rrgate::demo
