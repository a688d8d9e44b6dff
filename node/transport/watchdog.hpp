// Deadlines for many connections on one timer. Layer: node/transport.
//
// Arming and disarming only links and unlinks a node, so that a deadline around every write costs no timer. The price
// is coarseness: a deadline fires up to one tick late, never early.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/execution_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/intrusive/list.hpp>
#include <chrono>
#include <functional>
#include <optional>

namespace rr {

class Watchdog;

/// One deadline; its owner keeps it. Disarmed by its destructor. For the thread of its executor.
class Deadline : public boost::intrusive::list_base_hook<boost::intrusive::link_mode<boost::intrusive::auto_unlink>> {
 public:
  /// `on_expired` runs on the executor's thread; the deadline is disarmed by then.
  Deadline(const boost::asio::any_io_executor& executor, std::function<void()> on_expired);
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

/// The timer of one execution context, which runs on one thread; Deadlines find it there.
class Watchdog final : public boost::asio::execution_context::service {
 public:
  static constexpr std::chrono::milliseconds tick{50};
  static boost::asio::execution_context::id id;

  explicit Watchdog(boost::asio::execution_context& context) : service(context) {}

 private:
  friend class Deadline;
  using List = boost::intrusive::list<Deadline, boost::intrusive::constant_time_size<false>>;

  static Watchdog& of(const boost::asio::any_io_executor& executor);
  void shutdown() override;
  void add(Deadline& deadline);
  void wait();
  void check();

  std::optional<boost::asio::steady_timer> timer_;
  List armed_;
  bool is_waiting_ = false;
};

}  // namespace rr
