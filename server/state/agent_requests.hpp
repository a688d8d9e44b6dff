// What agents have asked for and wait for, to be cancelled by them. Layer: server/state. See docs/mcp.md.
#pragma once

#include <functional>
#include <iterator>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace rrgate {

/// Each is of a session, whose name nobody else knows. For one thread.
class AgentRequests {
  struct Entry {
    std::string session;
    std::string id;
    std::function<void()> cancel;
  };

 public:
  /// Held while the request is at work; may outlive this.
  using Handle = std::shared_ptr<const void>;

  [[nodiscard]] Handle add(std::string session, std::string request, std::function<void()> cancel) {
    entries_->push_back({std::move(session), std::move(request), std::move(cancel)});
    return {&entries_->back(),
            [entries = entries_, at = std::prev(entries_->end())](const void*) { entries->erase(at); }};
  }
  /// Of a session the requests with this id.
  void cancel(std::string_view session, std::string_view request) {
    for (const auto& each : *entries_)
      if (each.session == session && each.id == request) each.cancel();
  }
  /// All of a session.
  void cancel_all(std::string_view session) {
    for (const auto& each : *entries_)
      if (each.session == session) each.cancel();
  }

 private:
  std::shared_ptr<std::list<Entry>> entries_ = std::make_shared<std::list<Entry>>();
};

}  // namespace rrgate
