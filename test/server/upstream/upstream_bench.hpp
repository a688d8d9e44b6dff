// A device with one service, and the gateway's session with it, all on one loop of the test. Test support.
#pragma once

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <chrono>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "node/service/node.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate::test {

class UpstreamBench {
 public:
  explicit UpstreamBench(const std::shared_ptr<rr::Service>& service, LeaseConfig leases = {})
      : node(io, "test.device") {
    node.add(service);
    port = node.listen("rr+tcp://127.0.0.1:0");
    DeviceConfig made;
    made.name = "device";
    made.mode = DeviceMode::shared;
    made.leases = std::move(leases);
    made.url = rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=" + service->name()).value();
    device = std::make_shared<Device>(io.get_executor(), std::move(made), config);
    upstream = std::make_shared<Upstream>(device, service->name(), UpstreamLogin{});
  }
  ~UpstreamBench() {
    upstream->close();
    device->stop();
    node.stop();
    if (newer_node) newer_node->stop();
    io.restart();
    io.run_for(std::chrono::seconds(2));
  }
  UpstreamBench(const UpstreamBench&) = delete;
  UpstreamBench& operator=(const UpstreamBench&) = delete;

  /// Whether it came to that within ten seconds.
  bool run_until(const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!is_so() && std::chrono::steady_clock::now() < end) {
      io.restart();
      io.run_one_for(std::chrono::milliseconds(50));
    }
    return is_so();
  }
  /// What `work` comes to, once it does: see run_until().
  template <class T>
  std::shared_ptr<std::optional<T>> begin(rr::awaitable<T> work) {
    auto out = std::make_shared<std::optional<T>>();
    boost::asio::co_spawn(io, std::move(work), [out](const std::exception_ptr& failure, T result) {
      if (failure) std::rethrow_exception(failure);
      out->emplace(std::move(result));
    });
    return out;
  }
  template <class T>
  T wait_for(rr::awaitable<T> work) {
    auto out = begin(std::move(work));
    REQUIRE(run_until([&] { return out->has_value(); }));
    return std::move(**out);
  }
  /// The device is lost, and comes back with another service in the place of the first.
  void replace_device(const std::shared_ptr<rr::Service>& service) {
    node.stop();
    REQUIRE(run_until([&] { return !upstream->is_open(); }));
    newer_node.emplace(io, "test.device");
    newer_node->add(service);
    newer_node->listen("rr+tcp://127.0.0.1:" + std::to_string(port));
  }
  void keep_open(Retry retry, std::function<rr::Result<>()> is_used = nullptr) {
    set_retry(retry);
    upstream->keep_open(std::move(is_used));
  }
  void set_retry(Retry retry) {
    config.retry = retry;
    const auto same = device->config();
    device->become(same, config);
  }
  void open() { REQUIRE(wait_for(upstream->open()).has_value()); }
  rr::Result<rr::Value> find(const std::string& path) {
    std::optional<rr::Result<rr::Value>> found;
    upstream->find_object(path, [&](rr::Result<rr::Value> result) { found = std::move(result); });
    REQUIRE(run_until([&] { return found.has_value(); }));
    return *found;
  }
  /// Asks a member of an object that was found.
  std::shared_ptr<std::optional<rr::Result<rr::Value>>> ask(UpstreamClient& client, rr::CallKind kind,
                                                            const std::string& path, const std::string& member,
                                                            rr::GeneratorId generator = 0,
                                                            std::vector<rr::Value> arguments = {}) {
    return ask_by(*upstream, client, kind, path, member, generator, std::move(arguments));
  }
  /// The same by another session, which may have to look for the object first.
  std::shared_ptr<std::optional<rr::Result<rr::Value>>> ask_by(Upstream& by, UpstreamClient& client, rr::CallKind kind,
                                                               const std::string& path, const std::string& member,
                                                               rr::GeneratorId generator = 0,
                                                               std::vector<rr::Value> arguments = {}) {
    const auto& type = *upstream->object_type(path);
    rr::Called called;
    called.kind = kind;
    called.object = std::make_shared<SharedObject>(path, type.qualified_name);
    called.member = type.find_member(member);
    called.generator = generator;
    called.arguments = std::move(arguments);
    auto out = std::make_shared<std::optional<rr::Result<rr::Value>>>();
    by.request(client, called, [out](rr::Result<rr::Value> result) { *out = std::move(result); });
    return out;
  }

  boost::asio::io_context io{1};
  Config config;
  rr::Node node;
  std::optional<rr::Node> newer_node;
  std::uint16_t port = 0;
  std::shared_ptr<Device> device;
  std::shared_ptr<Upstream> upstream;
};

/// A client of an upstream that tells what it hears.
class HearingClient final : public UpstreamClient {
 public:
  explicit HearingClient(std::shared_ptr<Upstream> upstream) : upstream_(std::move(upstream)) { upstream_->add(*this); }
  ~HearingClient() { upstream_->remove(*this); }
  HearingClient(const HearingClient&) = delete;
  HearingClient& operator=(const HearingClient&) = delete;

  std::function<void(rr::EventPacket&)> on_event;
  std::function<void(rr::WirePacket&)> on_wire;
  std::function<void()> on_lease_ended;
  mutable SafeAnswerPtr safe_answer;                                            ///< to the end of its last lease
  std::function<void(const rr::ClientConnection::CallbackReply&)> on_callback;  ///< none: it answers none
  bool can_command = true;
  bool reads_slowly = false;
  mutable int times_asked = 0;         ///< whether it does
  std::vector<rr::TimePoint> told_at;  ///< of events and packets
  std::vector<std::string> heard;      ///< "wire NAME joined", "released PATH", ...

 private:
  std::weak_ptr<const void> life() const override { return life_; }
  std::shared_ptr<Upstream> upstream_in_use() const override { return upstream_; }
  bool may_command(const std::string&) const override { return can_command; }
  void lease_ended(const std::string&, const std::string&, const SafeAnswerPtr& safe) const override {
    safe_answer = safe;
    if (on_lease_ended) on_lease_ended();
  }
  bool may_answer(const std::string&, const rr::MemberDefinition&) const override { return on_callback != nullptr; }
  void receive_event(rr::EventPacket& packet, rr::Now now) override {
    told_at.push_back(now.steady);
    if (on_event) on_event(packet);
  }
  void receive_wire(rr::WirePacket& packet, rr::Now) override {
    if (on_wire) on_wire(packet);
  }
  void answer_wire(const std::string&, const rr::MemberDefinition& wire, const rr::Result<>& result) override {
    heard.push_back("wire " + wire.name + (result ? " joined" : " refused"));
  }
  void note_conflated(const std::string&, const rr::MemberDefinition&, std::uint64_t) override {}
  void close_wire(const std::string&, const rr::MemberDefinition& wire) override {
    heard.push_back("wire " + wire.name + " closed");
  }
  void accept_pipe(rr::PipeId) override { heard.push_back("pipe accepted"); }
  void refuse_pipe(rr::PipeId, const rr::Error&) override { heard.push_back("pipe refused"); }
  void receive_packet(rr::PipeId, rr::SharedPipePacket&, rr::Now now) override {
    told_at.push_back(now.steady);
    heard.push_back("packet");
  }
  bool is_behind() const override {
    ++times_asked;
    return reads_slowly;
  }
  void acknowledge_packets(rr::PipeId, std::span<const std::uint32_t>) override {}
  void close_pipe(rr::PipeId) override { heard.push_back("pipe closed"); }
  void release_path(const std::string& path) override { heard.push_back("released " + path); }
  void call_callback(const std::string&, const rr::MemberDefinition&, std::span<const rr::Value>,
                     rr::ClientConnection::CallbackReply answer) override {
    on_callback(answer);
  }

  std::shared_ptr<const bool> life_ = std::make_shared<const bool>(true);
  std::shared_ptr<Upstream> upstream_;
};

}  // namespace rrgate::test
