#include "server/upstream/callback_routes.hpp"

#include <algorithm>
#include <memory>

#include "core/support/glob.hpp"

namespace rrgate {

CallbackRoutes::CallNumber CallbackRoutes::begin_call(UpstreamClient& client, const std::string& path) {
  calls_.push_back({&client, path, ++last_call_});
  return last_call_;
}

void CallbackRoutes::end_call(CallNumber number) {
  std::erase_if(calls_, [number](const Call& call) { return call.number == number; });
}

void CallbackRoutes::forget(const UpstreamClient& client) {
  std::erase_if(calls_, [&](const Call& call) { return call.client == &client; });
}

std::vector<UpstreamClient*> CallbackRoutes::choose(const std::vector<CallbackRule>& rules, const std::string& path,
                                                    const std::string& callback,
                                                    std::vector<UpstreamClient*> candidates) const {
  const auto rule = std::find_if(rules.begin(), rules.end(), [name = path + "." + callback](const CallbackRule& each) {
    return rr::glob_matches(each.member, name);
  });
  const auto policy = rule == rules.end() ? CallbackPolicy::owner : rule->policy;
  if (policy == CallbackPolicy::all || candidates.size() <= 1) return candidates;
  if (policy == CallbackPolicy::first) return {candidates.front()};
  UpstreamClient* owner = nullptr;
  for (const auto& call : calls_) {
    if (call.path != path || std::find(candidates.begin(), candidates.end(), call.client) == candidates.end()) continue;
    if (owner && owner != call.client) return {};
    owner = call.client;
  }
  if (!owner) return {};
  return {owner};
}

rr::ClientConnection::CallbackReply first_value(std::size_t count, rr::ClientConnection::CallbackReply answer) {
  struct Votes {
    std::size_t left;
    bool is_answered = false;
  };
  return
      [votes = std::make_shared<Votes>(Votes{count}), answer = std::move(answer)](const rr::Result<rr::Value>& vote) {
        --votes->left;
        if (votes->is_answered || (!vote && votes->left > 0)) return;
        votes->is_answered = true;
        answer(vote);
      };
}

}  // namespace rrgate
