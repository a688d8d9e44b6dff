// A program that has no room for further threads.
#pragma once

#include <pthread.h>

#include <cstddef>

namespace rrgate::test {

/// As long as this lives no thread can be started: its stack would be larger than the address space.
class NoThreads {
 public:
  NoThreads() {
    pthread_attr_t now;
    ::pthread_getattr_default_np(&now);
    ::pthread_attr_getstacksize(&now, &before_);
    ::pthread_attr_destroy(&now);
    set(std::size_t{1} << 50);
  }
  ~NoThreads() { set(before_); }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  static void set(std::size_t stack_bytes) {
    pthread_attr_t wanted;
    ::pthread_attr_init(&wanted);
    ::pthread_attr_setstacksize(&wanted, stack_bytes);
    ::pthread_setattr_default_np(&wanted);
    ::pthread_attr_destroy(&wanted);
  }

  std::size_t before_ = 0;
};

}  // namespace rrgate::test
