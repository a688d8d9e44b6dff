// Deadlines for many connections on one timer. Layer: server/transport.
//
// Arming and disarming only links and unlinks a node, so that a deadline around every write costs no timer. The price
// is coarseness: a deadline fires up to one tick late, never early.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/intrusive/list.hpp>
#include <chrono>
#include <functional>

namespace rrgate {

class Watchdog;

/// One deadline; its owner keeps it. Disarmed by its destructor.
class Deadline : public boost::intrusive::list_base_hook<boost::intrusive::link_mode<boost::intrusive::auto_unlink>> {
 public:
  /// `on_expired` runs on the watchdog's executor; the deadline is disarmed by then.
  Deadline(Watchdog& watchdog, std::function<void()> on_expired)
      : watchdog_(watchdog), on_expired_(std::move(on_expired)) {}
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  /// Starts, or starts again, to count from now.
  void arm(std::chrono::milliseconds after);
  void disarm() {
    if (is_linked()) unlink();
  }
  bool is_armed() const { return is_linked(); }

 private:
  friend class Watchdog;
  Watchdog& watchdog_;
  std::function<void()> on_expired_;
  std::chrono::steady_clock::time_point at_;
};

/// Outlives every Deadline made with it. One thread.
class Watchdog {
 public:
  static constexpr std::chrono::milliseconds tick{50};

  explicit Watchdog(const boost::asio::any_io_executor& executor) : timer_(executor) {}
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  boost::asio::any_io_executor executor() { return timer_.get_executor(); }

 private:
  friend class Deadline;
  using List = boost::intrusive::list<Deadline, boost::intrusive::constant_time_size<false>>;

  void add(Deadline& deadline);
  void wait();
  void check();

  boost::asio::steady_timer timer_;
  List armed_;
  bool is_waiting_ = false;
};

}  // namespace rrgate
