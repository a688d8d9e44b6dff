#include "server/upstream/found_devices.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "node/driver/post_cancel.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::seconds review_period{5};
/// For a look at a device that another node may have replaced.
constexpr std::chrono::seconds place_patience{2};
constexpr std::size_t max_open_questions = 8;
constexpr std::size_t max_name_size = 64;  // of devices

rr::DiscoveryOptions discovery_options(const Discover& discover) {
  const auto has = [&](std::string_view scope) {
    return std::find(discover.scopes.begin(), discover.scopes.end(), scope) != discover.scopes.end();
  };
  rr::DiscoveryOptions options;
  options.ip = rr::IpDiscoveryScopes{has("node_local"), has("link_local"), has("site_local"), has("ipv4_broadcast")};
  if (discover.scopes.empty()) options.ip.reset();
  // A node announces itself once a minute: one announcement that is lost does not make it gone.
  options.cache.expiry = std::chrono::minutes(2);
  options.intra = false;  // none in this process
  options.local = discover.local;
  if (!discover.hardware) options.hardware.reset();
  options.report = [](const std::string& problem) { log(LogLevel::warning, "discovery", {{"error", problem}}); };
  return options;
}

/// Whether both lead to one server. Nodes may share it, but then all of them answer there.
bool is_same_place(const rr::ConnectionUrl& one, const rr::ConnectionUrl& other) {
  return one.port != 0 && one.port == other.port && one.scheme == other.scheme && one.host == other.host &&
         one.path == other.path;
}

std::string id_text(const rr::NodeId& id) {
  return rr::format_node_id(id, rr::NodeIdFormat::dashes);
}

}  // namespace

rr::Result<std::shared_ptr<TlsFiles>> FoundDevices::load_tls(const Discover& discover) {
  auto tls = std::make_shared<TlsFiles>(discover.tls);
  if (auto loaded = tls->load(); !loaded) {
    const auto why = "found devices: " + loaded.error().message;
    if (!discover.tls.ca.empty()) return rr::make_error(loaded.error().code, why);
    log(LogLevel::warning, "found devices can't be reached by TLS", {{"error", why}});
  }
  return tls;
}

FoundDevices::FoundDevices(asio::io_context& io, const Config& config, DeviceRegistry& devices,
                           std::shared_ptr<TlsFiles> tls)
    : io_(io), config_(config), devices_(devices), tls_(std::move(tls)), wake_(io) {}

void FoundDevices::reload_tls(bool is_forced) {
  if (!(is_forced || tls_->has_changed()) || !tls_->reload()) return;
  for (const auto& [id, node] : nodes_)
    if (node.device) node.device->note_trouble();  // it may be reached now
}

void FoundDevices::start() {
  listen();
  asio::co_spawn(io_, run(), asio::detached);
}

void FoundDevices::listen() {
  discovery_.emplace(io_, discovery_options(config_.discover));
  discovery_->watch([this](const rr::NodeEvent& event) { handle(event); });
}

void FoundDevices::note_change(const Discover& before, std::shared_ptr<TlsFiles> tls) {
  const auto& now = config_.discover;
  auto other_rules = before;
  other_rules.allow = now.allow;
  other_rules.max_devices = now.max_devices;
  if (now != other_rules) {
    const bool makes_others = now.is_enabled != before.is_enabled || now.mode != before.mode || now.tls != before.tls;
    for (auto& [id, node] : nodes_) {
      node.is_lost = true;
      if (makes_others) drop_device(node);
    }
    discovery_.reset();
    if (makes_others && tls) tls_ = std::move(tls);
    if (now.is_enabled) listen();
  }
  review_all();
  wake_.cancel();
}

void FoundDevices::stop() {
  is_stopping_ = true;
  for (const auto& question : questions_) rr::post_cancel(io_.get_executor(), question);
  discovery_.reset();
  wake_.cancel();
}

void FoundDevices::handle(const rr::NodeEvent& event) {
  if (event.kind == rr::NodeEvent::Kind::lost) {
    if (const auto lost = nodes_.find(event.node.node_id); lost != nodes_.end()) {
      lost->second.is_lost = true;
      review(lost->second);
      if (!lost->second.device) nodes_.erase(lost);
    }
    return;
  }
  auto& node = nodes_[event.node.node_id];
  node.is_lost = false;
  node.info = event.node;
  review(node);
  wake_.cancel();
}

void FoundDevices::review(Node& node) {
  if (node.device && !devices_.has(*node.device)) drop_device(node);  // a configured one has its name now
  node.verdict = judge(config_.discover.allow, node.info, node.services ? &*node.services : nullptr);
  // Only a node that will be asked needs to know when.
  if (!node.verdict.urls_to_ask.empty())
    node.refresh.handle_nonce(node.info.service_state_nonce, std::chrono::steady_clock::now());
  auto& urls = node.verdict.device_urls;
  const bool is_used = node.device && node.device->state() == DeviceState::online && node.device->clients() > 0;
  if ((node.is_lost && !is_used) || urls.empty() || devices_.find_configured(node.info.node_id))
    return drop_device(node);
  if (node.device) {
    if (node.device->state() == DeviceState::online && discovery_) discovery_->confirm(node.info.node_id);
    return node.device->set_urls(urls);
  }
  if (!take_place(node)) return;
  if (device_count_ >= config_.discover.max_devices) {
    if (!std::exchange(is_full_, true))
      log(LogLevel::warning, "found devices: too many", {{"max_devices", config_.discover.max_devices}});
    return;
  }
  DeviceConfig made;
  made.name = free_name(node.info);
  made.url = urls.front();
  made.is_found = true;
  made.mode = config_.discover.mode;
  log(LogLevel::info, "device found",
      {{"device", made.name}, {"node_id", id_text(node.info.node_id)}, {"url", rr::format_url(made.url)}});
  node.device = devices_.add(std::move(made), tls_).shared_from_this();
  node.device->set_urls(urls);
  ++device_count_;
}

bool FoundDevices::take_place(Node& node) {
  const auto now = std::chrono::steady_clock::now();
  const bool is_first = !node.waits_until;
  std::vector<rr::NodeId> there;
  for (auto& [id, other] : nodes_) {
    // One that has never answered has a name that nobody knows it by.
    if (!other.device || !other.device->identity()) continue;
    const auto& urls = node.verdict.device_urls;
    const auto& place = other.device->config().url;
    if (std::none_of(urls.begin(), urls.end(), [&](const auto& url) { return is_same_place(url, place); })) continue;
    there.push_back(id);
    if (is_first) other.device->note_trouble();
  }
  if (there.empty()) return true;
  // What is known of them may be as old as their last look.
  if (is_first) node.waits_until = now + place_patience;
  if (now < *node.waits_until) {
    next_review_ = std::min(next_review_, *node.waits_until);
    return false;
  }
  for (const auto& id : there) {
    auto& other = nodes_.at(id);
    if (other.device->state() != DeviceState::offline) continue;
    other.is_lost = true;
    drop_device(other);
    replaced_.push_back(id);
  }
  return true;
}

void FoundDevices::withdraw_replaced() {
  for (const auto& id : std::exchange(replaced_, {}))
    if (discovery_) discovery_->forget(id);
}

void FoundDevices::review_all() {
  for (auto& [id, node] : nodes_) review(node);
  std::erase_if(nodes_, [](const auto& each) { return each.second.is_lost && !each.second.device; });
}

void FoundDevices::drop_device(Node& node) {
  if (!node.device) return;
  log(LogLevel::info, "found device gone",
      {{"device", node.device->config().name}, {"node_id", id_text(node.info.node_id)}});
  devices_.remove(*node.device);
  node.device.reset();
  --device_count_;
  is_full_ = false;
}

std::string FoundDevices::free_name(const rr::NodeDiscoveryInfo& node) const {
  auto id = id_text(node.node_id);
  const auto& name = node.node_name.empty() ? "node" : node.node_name;
  // The same node gets the same name again, whoever else is there, but for two that claim one name at a time.
  for (const auto& ending : {node.node_name.empty() ? "-" + id.substr(0, 8) : std::string(), "-" + id.substr(0, 8)})
    if (auto wanted = name.substr(0, max_name_size - ending.size()) + ending; !devices_.find(wanted)) return wanted;
  return id;
}

rr::awaitable<void> FoundDevices::run() {
  while (!is_stopping_) {
    wake_.expires_at(next_work());
    co_await wake_.async_wait(asio::as_tuple(asio::use_awaitable));
    if (is_stopping_) break;
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_review_) {
      next_review_ = now + review_period;
      review_all();
    }
    withdraw_replaced();
    for (auto& [id, node] : nodes_) {
      if (node.verdict.urls_to_ask.empty() || questions_.size() >= max_open_questions || !node.refresh.take_due(now))
        continue;
      begin_question(id, node.verdict.urls_to_ask);
    }
  }
}

std::chrono::steady_clock::time_point FoundDevices::next_work() const {
  auto next = next_review_;
  if (questions_.size() >= max_open_questions) return next;
  for (const auto& [id, node] : nodes_)
    if (!node.verdict.urls_to_ask.empty()) next = std::min(next, node.refresh.poll_timeout().value_or(next));
  return next;
}

void FoundDevices::begin_question(const rr::NodeId& id, std::vector<rr::ConnectionUrl> urls) {
  const auto question = *questions_.insert(std::make_shared<asio::cancellation_signal>()).first;
  auto asked = ask(id, std::move(urls));
  asio::co_spawn(io_, std::move(asked),
                 asio::bind_cancellation_slot(question->slot(), [this, question](const std::exception_ptr&) {
                   questions_.erase(question);
                   wake_.cancel();
                 }));
}

rr::awaitable<void> FoundDevices::ask(rr::NodeId id, std::vector<rr::ConnectionUrl> urls) {
  rr::ServiceQueryOptions options;
  options.self_name = gateway_node_name;
  options.dial.timeout = config_.timeouts.connect;
  options.dial.send_stall = config_.timeouts.send_stall;
  options.dial.tls = tls_->context();
  auto answer = co_await rr::query_node(std::move(urls), std::move(options));
  if (is_stopping_) co_return;
  const auto asked = nodes_.find(id);  // it may have been lost meanwhile
  if (asked == nodes_.end()) co_return;
  auto& node = asked->second;
  const auto now = std::chrono::steady_clock::now();
  if (answer) {
    if (discovery_) discovery_->confirm(id);
    node.services = std::move(answer->services);
    node.refresh.handle_success(now);
  } else {
    log(LogLevel::debug, "found node does not answer", {{"node_id", id_text(id)}, {"error", answer.error().message}});
    node.refresh.handle_failure(now);
  }
  review(node);
}

std::vector<FoundDevices::Entry> FoundDevices::list() const {
  std::vector<Entry> out;
  if (!discovery_) return out;
  for (auto& info : discovery_->detected_nodes()) {
    Entry entry;
    if (const auto node = nodes_.find(info.node_id); node != nodes_.end()) {
      entry.is_allowed = node->second.verdict.is_allowed;
      entry.services = node->second.services;
      entry.device = node->second.device.get();
    }
    if (!entry.device) entry.device = devices_.find_configured(info.node_id);
    entry.node = std::move(info);
    out.push_back(std::move(entry));
  }
  return out;
}

}  // namespace rrgate
