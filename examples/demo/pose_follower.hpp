// Follows the demo robot's pose as a client of its service. Layer: demo.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <string>

#include "examples/demo/robot.hpp"
#include "rrgate/client.hpp"

namespace rrgate::demo {

class PoseFollower {
 public:
  /// Connects to the Create service at `url`, again and again while `io` runs.
  PoseFollower(boost::asio::io_context& io, std::string url);
  ~PoseFollower();
  PoseFollower(const PoseFollower&) = delete;
  PoseFollower& operator=(const PoseFollower&) = delete;

  /// The robot's pose; while it is not to be had, one that slowly turns around, beginning with the last one known.
  Pose pose() const;
  void stop();

 private:
  void connect();
  void retry_later();
  void follow(rr::ClientConnection& connection);

  boost::asio::io_context& io_;
  std::string url_;
  boost::asio::steady_timer retry_;
  std::shared_ptr<rr::ClientConnection> connection_;
  std::shared_ptr<PoseFollower*> alive_;  ///< outlives this in callbacks; null then
  bool is_following_ = false;
  Pose pose_;
  std::chrono::steady_clock::time_point lost_ = std::chrono::steady_clock::now();
};

}  // namespace rrgate::demo
