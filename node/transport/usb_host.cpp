#include "node/transport/usb_host.hpp"

#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fstream>

#include "node/transport/await_tuple.hpp"
#include "node/transport/usb_claim.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

constexpr std::uint16_t smallest_version = 0x0201;  ///< older devices have no BOS

/// What a look at the descriptors, which needs no permission, leaves as possible.
bool may_be_node(const UsbDevice& device) {
  if (device.usb_version < smallest_version || (device.class_code != 0 && device.class_code != usb_vendor_class))
    return false;
  for (const auto& interface : device.interfaces)
    if (interface.class_code == usb_vendor_class && interface.alternate == 0) return true;
  return false;
}

/// The BOS as newer kernels show it to everybody; empty where they don't.
Bytes read_bos(const UsbDevice& device) {
  std::ifstream in("/sys/bus/usb/devices/" + device.path + "/bos_descriptors", std::ios::binary);
  Bytes out(65535);
  in.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
  out.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return out;
}

std::string open_problem(const UsbDevice& device, UsbStatus status) {
  auto text = device.description() + ": " + usb_status_text(status);
  if (status == UsbStatus::denied)
    text += ", " + device.node + " needs to be readable and writable; see 60-robotraconteur-usb.rules";
  return text;
}

}  // namespace

asio::execution_context::id UsbHost::id;

UsbHost& UsbHost::of(const asio::any_io_executor& executor) {
  auto& host = asio::use_service<UsbHost>(asio::query(executor, asio::execution::context));
  if (!host.executor_) {
    host.executor_ = executor;
    host.scanned_.emplace(executor, TimePoint::max());
  }
  return host;
}

void UsbHost::shutdown() {
  known_.clear();
  for (const auto& weak : contexts_)
    if (const auto context = weak.lock()) context->shut_down();
  contexts_.clear();
  scanned_.reset();
}

void UsbHost::Known::settle(Result<UsbNodeInfo> answer) {
  if (!answer && answer.error().code != ErrorCode::node_not_found)
    problem = device.description() + ": " + answer.error().message;
  probed = std::move(answer);
}

/// A context of its own for each look: one that is older hears of new devices from udev only, which containers lack.
Result<> UsbHost::look() {
  auto context = UsbContext::make(*executor_);
  if (!context) return context.error();
  std::erase_if(contexts_, [](const auto& weak) { return weak.expired(); });
  contexts_.push_back(*context);
  for (auto& [place, known] : known_) known->is_present = false;
  for (auto& device : (*context)->devices()) {
    if (!may_be_node(device)) continue;
    auto& known = known_[device.key];
    if (!known) known = std::make_shared<Known>();
    known->is_present = true;
    known->device = std::move(device);
  }
  std::erase_if(known_, [](const auto& entry) { return !entry.second->is_present; });
  return {};
}

awaitable<void> UsbHost::probe(std::shared_ptr<Known> known) {
  const auto executor = co_await asio::this_coro::executor;
  known->problem.clear();
  std::optional<UsbFunction> function;
  if (const auto bos = read_bos(known->device); !bos.empty()) {
    const auto parsed = parse_usb_bos(bos);
    if (!parsed) {
      known->settle(parsed.error());
      co_return;
    }
    function = *parsed;
  }
  UsbHandle::Opened opened;
  asio::steady_timer timer(executor);
  UsbProbe probe(function);
  for (int attempt = 0; attempt < usb_busy_attempts; ++attempt) {
    opened = UsbHandle::open(known->device);
    if (opened.status != UsbStatus::busy) break;
    timer.expires_after(usb_busy_pause);
    co_await timer.async_wait(await_tuple);
  }
  if (opened.status != UsbStatus::ok) {
    known->problem = open_problem(known->device, opened.status);
    co_return;
  }
  struct Answer {
    bool is_there = false;
    UsbStatus status{};
    Bytes data;
  };
  while (const auto* request = probe.poll_control()) {
    const auto answer = std::make_shared<Answer>();
    const auto arrived = std::make_shared<asio::steady_timer>(executor, TimePoint::max());
    opened.handle->control(*request, [answer, arrived](UsbStatus status, ByteSpan data) {
      *answer = {true, status, Bytes(data.begin(), data.end())};
      arrived->cancel();
    });
    if (!answer->is_there) co_await arrived->async_wait(await_tuple);
    if (!answer->is_there) {  // cancelled: it is asked again
      opened.handle->cancel();
      co_return;
    }
    // A refusal says what the device is; anything else is worth another try.
    if (answer->status != UsbStatus::ok && answer->status != UsbStatus::stall) {
      known->problem = open_problem(known->device, answer->status);
      co_return;
    }
    if (answer->status == UsbStatus::stall && !probe.has_function()) {
      known->settle(make_error(ErrorCode::node_not_found, "no BOS descriptor"));
      co_return;
    }
    probe.handle_control(answer->status, answer->data);
  }
  auto answer = *probe.result();
  if (answer) {
    const auto pipes = find_usb_pipes(known->device.interfaces, answer->function.interface);
    if (pipes)
      known->pipes = *pipes;
    else
      answer = pipes.error();
  }
  known->settle(std::move(answer));
}

awaitable<UsbHost::Found> UsbHost::scan() {
  bool has_looked = false;
  while (is_scanning_) {  // one that runs already will do: what is plugged in during it shows in the next
    co_await scanned_->async_wait(await_tuple);
    has_looked = !was_cut_short_;
  }
  if (!has_looked) {
    struct Scanning {  // others wait for its end, also where it is cancelled
      UsbHost& host;
      bool is_whole = false;
      ~Scanning() {
        host.is_scanning_ = false;
        host.was_cut_short_ = !is_whole;
        if (host.scanned_) host.scanned_->cancel();
      }
    };
    is_scanning_ = true;
    Scanning scanning{*this};
    const auto looked = look();
    problem_ = looked ? "" : looked.error().message;
    std::vector<std::shared_ptr<Known>> to_ask;
    for (const auto& [place, known] : known_)
      if (!known->probed && known->claim.expired()) to_ask.push_back(known);
    for (const auto& known : to_ask) co_await probe(known);
    const auto state = co_await asio::this_coro::cancellation_state;
    scanning.is_whole = state.cancelled() == asio::cancellation_type::none;
  }
  Found found;
  if (!problem_.empty()) found.problems.push_back(problem_);
  for (const auto& [place, known] : known_) {
    if (known->probed && *known->probed)
      found.nodes.push_back({(*known->probed)->id, (*known->probed)->name, known->device.description()});
    if (!known->problem.empty()) found.problems.push_back(known->problem);
  }
  co_return found;
}

std::shared_ptr<UsbHost::Known> UsbHost::find(const std::function<bool(const Node&)>& matches) const {
  for (const auto& [place, known] : known_)
    if (known->probed && *known->probed &&
        matches({(*known->probed)->id, (*known->probed)->name, known->device.description()}))
      return known;
  return nullptr;
}

awaitable<Result<std::unique_ptr<ByteStream>>> UsbHost::dial(std::function<bool(const Node&)> matches,
                                                             DialOptions options) {
  const auto deadline = std::chrono::steady_clock::now() + options.timeout;
  // A device that is known is not kept waiting by others that don't answer.
  (void)look();  // a failure is the scan's to tell
  auto chosen = find(matches);
  Found found;
  if (!chosen) {
    found = co_await scan();
    chosen = find(matches);
  }
  if (!chosen) {
    std::string seen;
    for (const auto& node : found.nodes)
      seen += "; found " + quote(node.name) + " " + format_node_id(node.id) + " at " + node.device;
    for (const auto& problem : found.problems) seen += "; not usable: " + problem;
    co_return make_error(ErrorCode::connection_error,
                         "no such node on USB" + (seen.empty() ? "; no device found" : seen));
  }
  auto claim = chosen->claim.lock();
  asio::steady_timer pause(*executor_);
  while (claim && claim->is_ending() && !claim->is_released() && std::chrono::steady_clock::now() < deadline) {
    pause.expires_after(std::chrono::milliseconds(10));
    co_await pause.async_wait(await_tuple);
  }
  claim = chosen->claim.lock();  // somebody else may have been quicker
  if (!claim || claim->is_ending()) {
    claim = UsbClaim::start(chosen->device, (*chosen->probed)->function, chosen->pipes);
    chosen->claim = claim;
  }
  co_return co_await claim->open_stream(deadline, options.send_stall);
}

}  // namespace rr
