#include "server/upstream/value_clients.hpp"

#include <algorithm>

namespace rrgate {

rr::Result<std::shared_ptr<ValueClient>> ValueClients::make_another(std::shared_ptr<Upstream> upstream, Subject user) {
  auto& device = upstream->device();
  auto seat = device.take_seat();
  if (!seat) return rr::make_error(rr::ErrorCode::out_of_system_resource, device.full_text());
  return std::make_shared<ValueClient>(std::move(upstream), std::move(user), std::move(*seat), memory_.sibling());
}

rr::Result<std::shared_ptr<Upstream>> ValueClients::find_or_make(const std::shared_ptr<Device>& device,
                                                                 const SessionKey& key) {
  std::shared_ptr<Upstream> shared;
  if (device->is_shared() && key.username.empty()) {
    auto found = device->find_shared(key.service);
    if (!found) return found.error();
    shared = std::move(*found);
  }
  const std::pair place(device->config().name, key);
  if (const auto found = entries_.find(place); found != entries_.end()) {
    const auto upstream = found->second.upstream;
    if (&upstream->device() == device.get() && (!shared || shared == upstream)) return upstream;
    close_unjudged(entries_.extract(found).mapped());
  }
  if (device->is_full()) return rr::make_error(rr::ErrorCode::out_of_system_resource, device->full_text());
  auto& entry = entries_[place];
  entry.upstream = shared;
  entry.is_ours = !shared;
  if (entry.is_ours) {
    UpstreamLogin login{key.username, {}};
    if (!key.username.empty()) login.credentials.items.emplace_back("password", rr::Value(key.password));
    entry.upstream = std::make_shared<Upstream>(device, key.service, std::move(login), UpstreamUse::one_user);
    entry.upstream->keep_open();
  }
  return entry.upstream;
}

rr::Result<std::shared_ptr<ValueClient>> ValueClients::let_in(Entry& entry, const SessionKey& key) {
  if (entry.upstream->requires_user() && key.username.empty())
    return rr::make_error(rr::ErrorCode::authentication_error, "Authentication Failed");
  if (entry.client) return entry.client;
  const auto is_in = [](const auto& item) { return item.second.client != nullptr; };
  if (static_cast<std::size_t>(std::count_if(entries_.begin(), entries_.end(), is_in)) >= max_clients)
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "the gateway has " + std::to_string(max_clients) + " sessions for HTTP already");
  auto made = make_another(entry.upstream, key.subject());
  if (!made) return made.error();
  entry.client = std::move(*made);
  if (entry.is_ours) entry.upstream->close_unused(true);
  return entry.client;
}

bool ValueClients::has(const Device& device, const SessionKey& key) const {
  const auto found = entries_.find({device.config().name, key});
  return found != entries_.end() && found->second.client && &found->second.upstream->device() == &device;
}

rr::awaitable<rr::Result<std::shared_ptr<ValueClient>>> ValueClients::open(std::shared_ptr<Device> device,
                                                                           SessionKey key) {
  if (is_stopped_) co_return rr::make_error(rr::ErrorCode::operation_cancelled, "the gateway stops");
  const auto made = find_or_make(device, key);
  if (!made) co_return made.error();
  const auto upstream = *made;  // NOLINT(performance-unnecessary-copy-initialization): kept while this waits
  const std::pair place(device->config().name, key);
  entries_[place].last_used = std::chrono::steady_clock::now();
  if (!sweep_.is_armed()) sweep_.arm(idle_time_ / 3);
  const auto opened = co_await upstream->opened();
  const auto found = entries_.find(place);
  if (found == entries_.end() || found->second.upstream != upstream)
    co_return opened ? upstream->lost_error() : opened.error();
  auto& entry = found->second;
  auto client = opened ? let_in(entry, key) : rr::Result<std::shared_ptr<ValueClient>>(opened.error());
  if (client) co_return client;
  // Who can't get in, for whatever reason, takes nobody's place.
  if (entry.client && entry.client->is_used()) co_return client;
  close_unjudged(entries_.extract(found).mapped());
  co_return client;
}

void ValueClients::sweep() {
  const auto now = std::chrono::steady_clock::now();
  for (auto& [place, entry] : entries_)
    if (entry.client.use_count() > 1) entry.last_used = now;
  std::erase_if(entries_, [&](const auto& item) {
    return item.second.client.use_count() == 1 && now - item.second.last_used > idle_time_;
  });
  if (!entries_.empty()) sweep_.arm(idle_time_ / 3);
}

void ValueClients::close_all_but(const std::function<bool(const Device&)>& is_still_there) {
  std::vector<std::shared_ptr<Upstream>> gone;
  std::erase_if(entries_, [&](const auto& item) {
    const auto& [place, entry] = item;
    const bool is_gone = entry.is_ours && !is_still_there(entry.upstream->device());
    if (is_gone) gone.push_back(entry.upstream);
    return is_gone;
  });
  for (const auto& upstream : gone) {
    upstream->end_leases("the device has left the configuration, or is another one there");
    upstream->close();
  }
}

void ValueClients::stop() {
  is_stopped_ = true;
  sweep_.disarm();
  for (const auto& [place, entry] : std::exchange(entries_, {})) close_unjudged(entry);
}

void ValueClients::close_unjudged(const Entry& entry) {
  if (entry.is_ours && !entry.client) entry.upstream->close();
}

}  // namespace rrgate
