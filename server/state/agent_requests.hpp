// What agents have asked for and wait for, to be cancelled by them. Layer: server/state. See docs/mcp.md.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/execution_context.hpp>
#include <functional>
#include <iterator>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace rrgate {

/// Each is of a session, whose name nobody else knows. One for an execution context, so that it outlives whoever
/// answers requests; for its thread.
class AgentRequests final : public boost::asio::execution_context::service {
  struct Entry {
    std::string session;
    std::string id;
    std::function<void()> cancel;
  };

 public:
  inline static boost::asio::execution_context::id id;
  static AgentRequests& of(const boost::asio::any_io_executor& executor) {
    return boost::asio::use_service<AgentRequests>(executor.context());
  }
  explicit AgentRequests(boost::asio::execution_context& context) : service(context) {}

  /// Held while the request is at work.
  using Handle = std::shared_ptr<const void>;

  [[nodiscard]] Handle add(std::string session, std::string request, std::function<void()> cancel) {
    entries_.push_back({std::move(session), std::move(request), std::move(cancel)});
    return {&entries_.back(), [this, at = std::prev(entries_.end())](const void*) { entries_.erase(at); }};
  }
  /// Of a session the requests with this id.
  void cancel(std::string_view session, std::string_view request) {
    for (const auto& each : entries_)
      if (each.session == session && each.id == request) each.cancel();
  }
  /// All of a session.
  void cancel_all(std::string_view session) {
    for (const auto& each : entries_)
      if (each.session == session) each.cancel();
  }

 private:
  void shutdown() override {}

  std::list<Entry> entries_;
};

}  // namespace rrgate
