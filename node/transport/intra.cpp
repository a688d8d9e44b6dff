#include "node/transport/intra.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <cstring>
#include <map>
#include <mutex>

#include "core/session/service/service_index.hpp"
#include "node/transport/socket_stream.hpp"

namespace rr {

namespace asio = boost::asio;
using asio::local::stream_protocol;

/// Where a node is reached. What it calls belongs to the executor's thread.
struct IntraListener::Place {
  asio::any_io_executor executor;
  OnAccept on_accept;  ///< empty once it is closed
  std::chrono::milliseconds send_stall;
  NodeIdentity node;
  std::string nonce;
};

struct IntraWatch::State {
  State(const asio::any_io_executor& executor, OnNodes receiver, std::chrono::milliseconds period)
      : on_nodes(std::move(receiver)), refresh(period), timer(executor) {}
  OnNodes on_nodes;  ///< empty once it is stopped
  std::chrono::milliseconds refresh;
  asio::steady_timer timer;
};

namespace {

/// All nodes of the process. The lock is held while something is posted to an executor, so that whoever has closed its
/// listener or ended its watch gets nothing posted any more and may let its io_context go.
struct Registry {
  std::mutex mutex;
  std::map<NodeId, std::shared_ptr<IntraListener::Place>> places;
  std::vector<std::shared_ptr<IntraWatch::State>> watches;
};

Registry& registry() {
  static Registry all;
  return all;
}

std::vector<IntraNode> list_nodes() {
  const std::lock_guard lock(registry().mutex);
  std::vector<IntraNode> nodes;
  for (const auto& [id, place] : registry().places)
    nodes.push_back({place->node,
                     "rr+intra:///?nodeid=" + format_node_id(id) + "&service=" + std::string(service_index_name),
                     place->nonce});
  return nodes;
}

void look(const std::shared_ptr<IntraWatch::State>& state) {
  if (!state->on_nodes) return;
  // Armed first: the watch may be ended by what it calls.
  state->timer.expires_after(state->refresh);
  state->timer.async_wait([state](const error_code& error) {
    if (!error) look(state);
  });
  const auto call = state->on_nodes;
  call(list_nodes());
}

/// With the registry's lock held.
void tell(const std::shared_ptr<IntraWatch::State>& state) {
  asio::post(state->timer.get_executor(), [state] { look(state); });
}

void tell_all() {
  for (const auto& watch : registry().watches) tell(watch);
}

/// A socket on its way to its thread; closed where it never arrives.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  std::unique_ptr<ByteStream> to_stream(const asio::any_io_executor& executor, std::chrono::milliseconds send_stall) {
    stream_protocol::socket socket(executor);
    error_code error;
    socket.assign(stream_protocol(), number_, error);
    if (error) return nullptr;
    number_ = -1;
    return std::make_unique<SocketStream>(std::move(socket), "this process", send_stall);
  }

 private:
  int number_;
};

bool is_wanted(const ConnectionUrl& url, const NodeIdentity& node) {
  return (!url.node_id || *url.node_id == node.id) && (url.node_name.empty() || url.node_name == node.name);
}

}  // namespace

IntraListener::IntraListener(const asio::any_io_executor& executor, OnAccept on_accept,
                             std::chrono::milliseconds send_stall)
    : place_(std::make_shared<Place>(Place{executor, std::move(on_accept), send_stall, {}, {}})) {}

Result<> IntraListener::open(const NodeIdentity& node, std::string nonce) {
  const std::lock_guard lock(registry().mutex);
  place_->node = node;
  place_->nonce = std::move(nonce);
  if (!registry().places.emplace(node.id, place_).second)
    return make_error(ErrorCode::system_resource_permission_denied,
                      "another node of this process has the ID " + format_node_id(node.id));
  tell_all();
  return {};
}

void IntraListener::publish(std::string nonce) {
  const std::lock_guard lock(registry().mutex);
  place_->nonce = std::move(nonce);
  tell_all();
}

void IntraListener::close() {
  const std::lock_guard lock(registry().mutex);
  place_->on_accept = nullptr;
  const auto found = registry().places.find(place_->node.id);
  if (found == registry().places.end() || found->second != place_) return;
  registry().places.erase(found);
  tell_all();
}

awaitable<Result<std::unique_ptr<ByteStream>>> dial_intra(ConnectionUrl url, DialOptions options) {
  const auto executor = co_await asio::this_coro::executor;
  const auto fail = [&url](ErrorCode code, const std::string& why) {
    return make_error(code, "connect to " + format_url(url) + ": " + why);
  };
  int pair[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
    co_return fail(ErrorCode::system_resource_error, std::strerror(errno));
  Descriptor near(pair[0]);
  Descriptor far(pair[1]);
  {
    const std::lock_guard lock(registry().mutex);
    const auto& places = registry().places;
    const auto found = std::find_if(places.begin(), places.end(),
                                    [&url](const auto& each) { return is_wanted(url, each.second->node); });
    if (found == places.end()) co_return fail(ErrorCode::node_not_found, "no such node of this process");
    const auto place = found->second;
    const auto arriving = std::make_shared<Descriptor>(std::move(far));
    asio::post(place->executor, [place, arriving] {
      if (!place->on_accept) return;
      if (auto stream = arriving->to_stream(place->executor, place->send_stall)) place->on_accept(std::move(stream));
    });
  }
  auto stream = near.to_stream(executor, options.send_stall);
  if (!stream) co_return fail(ErrorCode::system_resource_error, "the socket can't be waited for");
  co_return stream;
}

IntraWatch::IntraWatch(const asio::any_io_executor& executor, OnNodes on_nodes, std::chrono::milliseconds refresh)
    : state_(std::make_shared<State>(executor, std::move(on_nodes), refresh)) {
  const std::lock_guard lock(registry().mutex);
  registry().watches.push_back(state_);
  tell(state_);
}

IntraWatch::~IntraWatch() {
  const std::lock_guard lock(registry().mutex);
  std::erase(registry().watches, state_);
  state_->on_nodes = nullptr;
  state_->timer.cancel();
}

void IntraWatch::refresh() {
  const std::lock_guard lock(registry().mutex);
  tell(state_);
}

}  // namespace rr
