// What the cameras of this machine need of the operating system, so that tests have a driver of their own. Layer: demo.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace rrgate::demo {

/// The system calls on video devices. Nothing throws; errors are numbers as in errno.
class V4l2System {
 public:
  V4l2System() = default;
  V4l2System(const V4l2System&) = delete;
  V4l2System& operator=(const V4l2System&) = delete;
  virtual ~V4l2System() = default;

  /// Paths of the video devices that are there, in the order of their numbers; 64 at most.
  virtual std::vector<std::string> list() = 0;
  /// For reading and writing, non-blocking. Returns  a descriptor that epoll takes, which is the caller's to close(); a
  /// negative error number.
  virtual int open(const std::string& path) = 0;
  virtual void close(int descriptor) = 0;
  /// ioctl(). Returns 0 or an error number, never EINTR.
  virtual int control(int descriptor, unsigned long request, void* argument) = 0;
  /// mmap() for reading, shared. Returns null where it fails; what it returns is the caller's to unmap().
  virtual void* map(int descriptor, std::size_t length, std::int64_t offset) = 0;
  virtual void unmap(void* data, std::size_t length) = 0;
};

/// That of this machine: /dev/video*.
class LinuxV4l2 : public V4l2System {
 public:
  std::vector<std::string> list() override;
  int open(const std::string& path) override;
  void close(int descriptor) override;
  int control(int descriptor, unsigned long request, void* argument) override;
  void* map(int descriptor, std::size_t length, std::int64_t offset) override;
  void unmap(void* data, std::size_t length) override;
};

}  // namespace rrgate::demo
