#include "server/access/access_requests.hpp"

#include <algorithm>

#include "node/tls/digest.hpp"
#include "server/access/access_text.hpp"
#include "server/access/base64url.hpp"
#include "server/limits/client_network.hpp"

namespace rrgate {

namespace {

rr::Error no_such_request() {
  return rr::make_error(rr::ErrorCode::resource_not_found, "there is no such request of access, or it is too old");
}

}  // namespace

std::string_view to_string(RequestState state) {
  constexpr std::string_view names[] = {"pending", "approved", "denied"};
  return names[static_cast<std::size_t>(state)];
}

void AccessRequests::forget_old(Time now) {
  std::erase_if(entries_, [now](const auto& item) { return now - item.second.request.asked >= lifetime; });
}

bool AccessRequests::make_room(const std::string& site) {
  if (entries_.size() < max_requests) return true;
  auto denied = entries_.end();
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
    if (const auto& request = entry->second.request; request.state == RequestState::denied)
      if (denied == entries_.end() || request.asked < denied->second.request.asked) denied = entry;
  if (denied != entries_.end()) {
    entries_.erase(denied);
    return true;
  }
  struct Share {
    std::size_t count = 0;
    std::string oldest = {};
  };
  std::map<std::string, Share> shares;
  for (const auto& [id, entry] : entries_) {
    if (entry.request.state != RequestState::pending) continue;
    auto& share = shares[site_name(entry.address)];
    if (++share.count == 1 || entry.request.asked < entries_.at(share.oldest).request.asked) share.oldest = id;
  }
  const auto most = std::max_element(shares.begin(), shares.end(), [](const auto& left, const auto& right) {
    return left.second.count < right.second.count;
  });
  const auto own = shares.find(site);
  if (most == shares.end() || most->second.count <= (own == shares.end() ? 0 : own->second.count) + 1) return false;
  entries_.erase(most->second.oldest);
  return true;
}

rr::Result<AccessRequests::Asked> AccessRequests::ask(std::string name, std::string reason, std::string client,
                                                      std::string address, Time now) {
  forget_old(now);
  if (auto checked = check_name("name", name); !checked) return checked.error();
  if (reason.size() > max_reason)
    return rr::make_error(rr::ErrorCode::invalid_argument,
                          "the reason has " + std::to_string(reason.size()) + " bytes, expected at most 500");
  const auto of_address = std::count_if(entries_.begin(), entries_.end(), [&](const auto& item) {
    return item.second.address == address && item.second.request.state == RequestState::pending;
  });
  if (static_cast<std::size_t>(of_address) >= max_of_address || !make_room(site_name(address)))
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "too many requests for access wait; an admin must decide on them first");
  Asked out{encode_base64url(rr::random_bytes(9)), encode_base64url(rr::random_bytes(24))};
  RequestOfAccess request{out.id, std::move(name), std::move(reason), std::move(client), RequestState::pending, now};
  entries_.emplace(out.id, Entry{std::move(request), std::move(address), rr::sha256(rr::as_bytes(out.secret)), {}});
  return out;
}

std::vector<RequestOfAccess> AccessRequests::list(Time now) {
  forget_old(now);
  std::vector<RequestOfAccess> out;
  for (const auto& [id, entry] : entries_) out.push_back(entry.request);
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.asked < b.asked; });
  return out;
}

rr::Result<RequestOfAccess> AccessRequests::find_pending(const std::string& id, Time now) {
  forget_old(now);
  const auto found = entries_.find(id);
  if (found == entries_.end()) return no_such_request();
  const auto& request = found->second.request;
  if (request.state != RequestState::pending)
    return rr::make_error(rr::ErrorCode::invalid_state, "it was " + std::string(to_string(request.state)) + " already");
  return request;
}

void AccessRequests::decide(const std::string& id, std::string token) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return;
  found->second.request.state = token.empty() ? RequestState::denied : RequestState::approved;
  found->second.token = std::move(token);
}

rr::Result<AccessRequests::Answer> AccessRequests::claim(const std::string& id, std::string_view secret, Time now) {
  forget_old(now);
  const auto found = entries_.find(id);
  if (found == entries_.end() || !rr::equal_secrets(rr::sha256(rr::as_bytes(secret)), found->second.secret_hash))
    return no_such_request();
  Answer out{found->second.request.state, found->second.token};
  if (out.state != RequestState::pending) entries_.erase(found);
  return out;
}

}  // namespace rrgate
