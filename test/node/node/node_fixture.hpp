// A node that runs on a thread of its own beside the test. Test support.
#pragma once

#include <exception>
#include <functional>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>

#include "node/client/client.hpp"
#include "node/service/node.hpp"

namespace rr {

/// `prepare` adds the services; then the node listens on a free port of 127.0.0.1 until the end of the scope.
class RunningNode {
 public:
  explicit RunningNode(const std::function<void(Node&)>& prepare, NodeOptions options = {},
                       const std::string& name = "test.node")
      : node_(name, std::move(options)) {
    prepare(node_);
    port_ = node_.listen("rr+tcp://127.0.0.1:0");
    thread_ = std::thread([this] { node_.run(); });
  }
  ~RunningNode() {
    stop();
    if (thread_.joinable()) thread_.join();
  }

  std::uint16_t port() const { return port_; }
  std::string url(const std::string& service) const {
    return "rr+tcp://127.0.0.1:" + std::to_string(port_) + "/?service=" + service;
  }
  void stop() {
    node_.post([this] { node_.stop(); });
  }
  void join() { thread_.join(); }
  /// Runs on the node's thread and waits for the result.
  template <class F>
  auto ask(F&& question) {
    std::packaged_task<decltype(question(node_))()> task([&] { return question(node_); });
    auto answer = task.get_future();
    node_.post([&] { task(); });
    return answer.get();
  }

 private:
  Node node_;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

/// The error that `work` throws as a ClientException; its code is none where it does not.
template <class F>
Error error_of(F&& work) {
  try {
    work();
  } catch (const ClientException& exception) {
    return exception.error();
  }
  return {ErrorCode::none, "no exception"};
}

/// The text of the std::invalid_argument that `work` throws.
template <class F>
std::string refusal(F&& work) {
  try {
    work();
  } catch (const std::invalid_argument& refused) {
    return refused.what();
  }
  return "not refused";
}

}  // namespace rr
