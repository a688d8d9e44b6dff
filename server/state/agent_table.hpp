// Sessions of agents by key, never more than fit. Layer: server/state.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace rrgate {

/// `Session`  has `used`, rank(), by which the least goes first, and is_held(): it may not go. For one thread.
template <class Session>
class AgentTable {
 public:
  using Ptr = std::shared_ptr<Session>;

  /// Null: there is none.
  Ptr find(const std::string& key) const {
    const auto found = sessions_.find(key);
    return found == sessions_.end() ? nullptr : found->second;
  }
  /// The same, and it is used now.
  Ptr visit(const std::string& key) {
    auto found = find(key);
    if (found) found->used = std::chrono::steady_clock::now();
    return found;
  }
  /// Has one go where as many as `most` are such. False: none of them may.
  template <class IsSuch>
  bool make_room(std::size_t most, IsSuch is_such) {
    std::vector<typename Sessions::iterator> such;
    for (auto it = sessions_.begin(); it != sessions_.end(); ++it)
      if (is_such(*it->second)) such.push_back(it);
    if (such.size() < most) return true;
    const auto least = std::min_element(such.begin(), such.end(), [](const auto& a, const auto& b) {
      return std::pair(a->second->is_held(), a->second->rank()) < std::pair(b->second->is_held(), b->second->rank());
    });
    if ((*least)->second->is_held()) return false;
    sessions_.erase(*least);
    return true;
  }
  bool make_room(std::size_t most) {
    return make_room(most, [](const Session&) { return true; });
  }
  /// `key`  one that is not there.
  Ptr add(const std::string& key, Session session) {
    return sessions_[key] = std::make_shared<Session>(std::move(session));
  }
  void erase(const std::string& key) { sessions_.erase(key); }
  std::vector<Ptr> all() const {
    std::vector<Ptr> out;
    for (const auto& [key, session] : sessions_) out.push_back(session);
    return out;
  }

 private:
  using Sessions = std::map<std::string, Ptr>;
  Sessions sessions_;
};

}  // namespace rrgate
