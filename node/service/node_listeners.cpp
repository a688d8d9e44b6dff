#include "node/service/node_listeners.hpp"

#include <stdexcept>

namespace rr {

namespace asio = boost::asio;

NodeListeners::Place NodeListeners::parse(std::string_view url) {
  constexpr std::string_view scheme = "rr+tcp://";
  constexpr std::string_view secure_scheme = "rrs+tcp://";
  const auto fail = [&](const std::string& why) {
    throw std::invalid_argument("listen on " + rr::quote(url) + ": " + why +
                                ", expected rr+tcp://HOST:PORT, rr+local:/// or rr+intra:///");
  };
  const bool is_secure = url.substr(0, secure_scheme.size()) == secure_scheme;
  if (!is_secure && url.substr(0, scheme.size()) != scheme) fail("unknown scheme");
  std::string_view rest = url.substr(is_secure ? secure_scheme.size() : scheme.size());
  if (!rest.empty() && rest.back() == '/') rest.remove_suffix(1);
  const auto parsed = parse_host_port(rest);
  if (!parsed) fail(parsed.error().message);
  return {*parsed, is_secure};
}

std::uint16_t NodeListeners::listen(std::string_view url, const NodeIdentity& node, const std::string& nonce) {
  if (url == "rr+local:///") {
    listen_locally(node, nonce);
    return 0;
  }
  if (url == "rr+intra:///") {
    listen_in_process(node, nonce);
    return 0;
  }
  return listen_by_tcp(url);
}

std::uint16_t NodeListeners::listen_by_tcp(std::string_view url) {
  const auto place = parse(url);
  const bool requires_tls = place.requires_tls || options_.require_tls;
  if (requires_tls && !(options_.tls && options_.tls->has_certificate()))
    throw std::invalid_argument("listen on " + rr::quote(url) + ": TLS needs a certificate: NodeOptions::tls");
  auto listener = std::make_unique<TcpListener>(executor_);
  const auto bound = listener->open(place.address, true);
  if (!bound) throw std::runtime_error(bound.error().message);
  listener->start(
      [this, requires_tls](asio::ip::tcp::socket socket) { owner_.accept_tcp(std::move(socket), requires_tls); },
      [this](const std::string& problem) { owner_.report(problem); });
  tcp_.push_back(std::move(listener));
  for (const auto& at : *bound) places_.push_back({at, requires_tls});
  return bound->front().port;
}

void NodeListeners::listen_locally(const NodeIdentity& node, const std::string& nonce) {
  if (local_) throw std::invalid_argument("listen on rr+local:///: the node does so already");
  auto listener = std::make_unique<LocalListener>(executor_);
  if (auto opened = listener->open(node, nonce, options_.local_is_public); !opened)
    throw std::runtime_error("listen on rr+local:///: " + opened.error().message);
  auto welcome = [this](std::unique_ptr<ByteStream> stream) { owner_.accept_near(std::move(stream), "rr+local"); };
  listener->start(
      std::move(welcome), [this](const std::string& problem) { owner_.report(problem); }, send_stall);
  local_ = std::move(listener);
}

void NodeListeners::listen_in_process(const NodeIdentity& node, const std::string& nonce) {
  if (intra_) throw std::invalid_argument("listen on rr+intra:///: the node does so already");
  auto welcome = [this](std::unique_ptr<ByteStream> stream) { owner_.accept_near(std::move(stream), "rr+intra"); };
  auto listener = std::make_unique<IntraListener>(executor_, std::move(welcome), send_stall);
  if (auto opened = listener->open(node, nonce); !opened)
    throw std::runtime_error("listen on rr+intra:///: " + opened.error().message);
  intra_ = std::move(listener);
}

void NodeListeners::publish(const std::string& nonce) {
  if (intra_) intra_->publish(nonce);
  if (local_)
    if (auto published = local_->publish(nonce); !published) owner_.report(published.error().message);
}

std::vector<std::string> NodeListeners::urls(const NodeId& node) const {
  const auto id = "?nodeid=" + format_node_id(node, NodeIdFormat::dashes);
  std::vector<std::string> out;
  for (const auto& [address, requires_tls] : places_) {
    const auto at = "://" + format_host_port(address.host, address.port) + id;
    if (!requires_tls) out.push_back("rr+tcp" + at);
    if (options_.tls && options_.tls->has_certificate()) out.push_back("rrs+tcp" + at);
  }
  if (local_) out.push_back("rr+local:///" + id);
  if (intra_) out.push_back("rr+intra:///" + id);
  return out;
}

void NodeListeners::close() {
  for (const auto& listener : tcp_) listener->close();
  tcp_.clear();
  places_.clear();
  local_.reset();
  intra_.reset();
}

}  // namespace rr
