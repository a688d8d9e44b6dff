// The way to a node's thread for what may outlive the node: handlers that answer later. Layer: node.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/post.hpp>
#include <functional>
#include <mutex>
#include <utility>

namespace rr {

class NodeThread {
 public:
  explicit NodeThread(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {}
  NodeThread(const NodeThread&) = delete;
  NodeThread& operator=(const NodeThread&) = delete;

  /// Any thread: runs `work` on the node's, later. Nothing once the node is gone.
  void post(std::function<void()> work) {
    const std::lock_guard lock(mutex_);
    if (executor_) boost::asio::post(executor_, std::move(work));
  }
  /// The node is gone, and with it, maybe, what runs it.
  void close() {
    const std::lock_guard lock(mutex_);
    executor_ = {};
  }

 private:
  std::mutex mutex_;
  boost::asio::any_io_executor executor_;  ///< empty once the node is gone
};

}  // namespace rr
