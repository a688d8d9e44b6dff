#include "node/transport/hardware.hpp"

#include <linux/netlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <optional>
#include <utility>

#include "node/transport/usb_host.hpp"
#include "node/transport/watch_timer.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

/// News come in swarms, and udev sets permissions a little later than the kernel speaks.
constexpr std::chrono::milliseconds settle_time{300};

bool matches(const ConnectionUrl& url, const NodeId& id, const std::string& name) {
  return (!url.node_id || *url.node_id == id) && (url.node_name.empty() || url.node_name == name);
}

HardwareNode make_node(std::string scheme, const NodeId& id, const std::string& name) {
  const auto who = id.is_any() ? "nodename=" + name : "nodeid=" + format_node_id(id, NodeIdFormat::dashes);
  auto url = scheme + ":///?" + who + "&service=RobotRaconteurServiceIndex";
  return {std::move(scheme), id, name, std::move(url)};
}

/// The socket on which kernel (group 1) and udev (group 2) tell of devices; -1 where there is none.
int open_news() {
  const int number = ::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_KOBJECT_UEVENT);
  if (number < 0) return -1;
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = 3;
  if (::bind(number, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return number;
  ::close(number);
  return -1;
}

/// Either format holds KEY=VALUE texts that end in NUL.
bool is_about_us(std::string_view news) {
  return news.find(std::string_view("SUBSYSTEM=usb\0", 14)) != std::string_view::npos ||
         news.find(std::string_view("SUBSYSTEM=robotraconteur\0", 25)) != std::string_view::npos;
}

}  // namespace

awaitable<Result<std::unique_ptr<ByteStream>>> dial_hardware(ConnectionUrl url, DialOptions options,
                                                             DriverRoots roots) {
  const auto executor = co_await asio::this_coro::executor;
  const auto fail = [&url](const std::string& what) {
    return make_error(ErrorCode::connection_error, format_url(url) + ": " + what);
  };
  const auto transport = url.scheme.substr(3);
  for (const auto& device : find_driver_devices(roots))
    if (device.transport == transport && matches(url, device.id, device.node_name))
      co_return open_driver_device(executor, device, roots, options.send_stall);
  if (url.scheme != "rr+usb") co_return fail("no driver in " + roots.classes + " has such a node");
  std::function<bool(const UsbHost::Node&)> is_wanted = [&url](const UsbHost::Node& node) {
    return matches(url, node.id, node.name);
  };
  auto dialed = co_await UsbHost::of(executor).dial(std::move(is_wanted), options);
  if (dialed) co_return dialed;
  auto error = dialed.error();
  error.message = format_url(url) + ": " + error.message;
  co_return error;
}

awaitable<Result<std::unique_ptr<ByteStream>>> dial_hardware(ConnectionUrl url, DialOptions options) {
  return dial_hardware(std::move(url), std::move(options), DriverRoots());
}

awaitable<HardwareNodes> list_hardware_nodes() {
  return list_hardware_nodes(DriverRoots());
}

awaitable<HardwareNodes> list_hardware_nodes(DriverRoots roots) {
  const auto executor = co_await asio::this_coro::executor;
  HardwareNodes out;
  for (const auto& device : find_driver_devices(roots))
    if (device.transport != "bluetooth")
      out.nodes.push_back(make_node("rr+" + device.transport, device.id, device.node_name));
  auto found = co_await UsbHost::of(executor).scan();
  for (const auto& node : found.nodes) out.nodes.push_back(make_node("rr+usb", node.id, node.name));
  out.problems = std::move(found.problems);
  co_return out;
}

struct HardwareWatch::State {
  OnNodes on_nodes;
  OnProblem on_problem;
  DriverRoots roots;
  WatchTimer timer;
  asio::cancellation_signal stop_looking = {};
  bool is_looking = false;
  std::optional<asio::posix::stream_descriptor> news = {};
  std::vector<std::string> problems = {};  ///< of the look before
};

HardwareWatch::HardwareWatch(const asio::any_io_executor& executor, OnNodes on_nodes, OnProblem on_problem,
                             std::chrono::milliseconds refresh, DriverRoots roots)
    : state_(new State{std::move(on_nodes), std::move(on_problem), std::move(roots),
                       WatchTimer(executor, refresh, settle_time)}) {
  if (const int number = open_news(); number >= 0) {
    state_->news.emplace(executor, number);
    asio::co_spawn(executor, listen(state_), asio::detached);
  }
  asio::co_spawn(
      executor, run(state_),
      asio::bind_cancellation_slot(state_->stop_looking.slot(), [state = state_](const std::exception_ptr&) {}));
}

HardwareWatch::~HardwareWatch() {
  state_->timer.stop();
  // What the watch itself calls ends it without that: Asio could not tell a coroutine that never waited.
  if (state_->is_looking) state_->stop_looking.emit(asio::cancellation_type::terminal);
  error_code ignored;
  if (state_->news) state_->news->close(ignored);
}

awaitable<void> HardwareWatch::run(std::shared_ptr<State> state) {
  while (!state->timer.is_stopped()) {
    state->timer.begin_look();
    state->is_looking = true;
    auto found = co_await list_hardware_nodes(state->roots);
    state->is_looking = false;
    if (state->timer.is_stopped()) break;
    state->on_nodes(found.nodes);
    const auto before = std::exchange(state->problems, std::move(found.problems));
    for (const auto& problem : state->problems)
      if (!state->timer.is_stopped() && std::find(before.begin(), before.end(), problem) == before.end())
        state->on_problem(problem);
    co_await state->timer.wait();
  }
}

awaitable<void> HardwareWatch::listen(std::shared_ptr<State> state) {
  char buffer[8192];
  for (;;) {
    // No asynchronous read: a datagram that is lost (ENOBUFS) is news as well.
    const auto [error] = co_await state->news->async_wait(asio::posix::stream_descriptor::wait_read, await_tuple);
    if (error || state->timer.is_stopped()) break;
    const auto count = ::recv(state->news->native_handle(), buffer, sizeof(buffer), 0);
    if (count == 0 || (count < 0 && errno != ENOBUFS && errno != EAGAIN && errno != EINTR)) break;
    if (count > 0 && !is_about_us({buffer, static_cast<std::size_t>(count)})) continue;
    if (count < 0 && errno != ENOBUFS) continue;
    state->timer.hear_news();
  }
}

}  // namespace rr
