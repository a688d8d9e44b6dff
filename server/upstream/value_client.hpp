// Who uses a service of a device by values: HTTP requests, event streams, images, JSON sockets. Layer: server/upstream.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/access/standing.hpp"
#include "server/limits/memory_budget.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

struct SampleJpeg;
struct SampleTexts;

/// What a wire, a pipe or an event brought.
struct Sample {
  std::uint64_t number = 0;                         ///< counts within a member, from 1
  rr::TimeSpec time;                                ///< of a wire's value
  std::vector<rr::Value> values;                    ///< an event's arguments; else one
  std::size_t bytes = 0;                            ///< that it takes, about
  mutable std::shared_ptr<SampleJpeg> jpeg = {};    ///< of a camera's frame, once somebody wants it (sample_jpeg.hpp)
  mutable std::shared_ptr<SampleTexts> texts = {};  ///< as JSON, once somebody wants it (sample_text.hpp)
};
using SamplePtr = std::shared_ptr<const Sample>;

/// What listeners hear. The sample is null where the connection to the device was lost, or the device has closed the
/// member (`error`), or it is back (none).
using SampleHandler = std::function<void(const SamplePtr& sample, const rr::Error* error)>;
using CallbackHandler = rr::ClientConnection::LateCallbackHandler;

/// A member of an object that an upstream has found.
struct MemberPlace {
  std::string path;
  const rr::MemberDefinition* member = nullptr;
  std::shared_ptr<const rr::TypeRegistry> types = {};  ///< which `member` is of
};

/// Plain requests of one login share one of these; a JSON socket that locks, sends or answers has its own. For the
/// gateway's thread.
class ValueClient final : public UpstreamClient, public std::enable_shared_from_this<ValueClient> {
 public:
  /// `user`  whose user locks are this client's.
  /// `memory`  is where the samples are counted that it keeps.
  ValueClient(std::shared_ptr<Upstream> upstream, Subject user, Device::Seat seat, MemoryBudget::Charge memory);
  ~ValueClient();
  ValueClient(const ValueClient&) = delete;
  ValueClient& operator=(const ValueClient&) = delete;

  const std::shared_ptr<Upstream>& upstream() const { return upstream_; }
  /// Ends all that it has at the device, also where requests of it are under way: the device has its locks back, and is
  /// made safe where it has held leases. From now on it is refused whatever it asks for.
  void leave();
  /// Whether something goes on beyond a request.
  bool is_used() const { return !topics_.empty(); }

  // Requests; they throw rr::Exception with what the device, a lock or the lost connection says.

  /// The object's type, qualified.
  rr::awaitable<rr::Value> find_object(std::string path);
  /// `called.object`  a SharedObject that was found; `called.generator`: for generators, from next_generator().
  rr::awaitable<rr::Value> ask(rr::Called called);
  rr::GeneratorId next_generator() { return ++last_generator_; }
  /// One that is open, and may be asked for its next value.
  bool has_generator(rr::GeneratorId id) { return upstream_->has_generator(*this, id); }
  /// Of a generator that nobody wants to hear of any more.
  void drop_generator(rr::GeneratorId id) { upstream_->drop_generator(*this, id); }
  /// `timeout`  the dead-man's time, where a lease is asked for.
  rr::awaitable<rr::Value> lock(rr::LockCommand command, std::string path, std::chrono::milliseconds timeout = {});
  /// Gives back what it has locked or leased where it may not any more.
  void review_locks() { upstream_->review_locks(*this); }
  /// Whether it has a lock or a lease of this object, or has lost one and not given it back.
  bool has_lock(std::string_view path) const { return upstream_->has_lock(*this, path); }
  /// Called when a lease of its own has ended, with the object's path and why.
  void on_lease_ended(std::function<void(const std::string& path, const std::string& why)> handler) {
    on_lease_ended_ = std::move(handler);
  }
  /// What the device answers to the end of its last lease; null: none has ended.
  const SafeAnswerPtr& safe_answer() const { return safe_answer_; }
  /// Who it is, for what leases need of that. `needs_right`  whether it loses locks and leases with the right to lock.
  void set_standing(StandingPtr standing, bool needs_right = true) {
    standing_ = std::move(standing);
    needs_right_ = needs_right;
  }

  /// Calls a handler with what a member brings, until it is destroyed.
  class Listener {
   public:
    using Key = std::pair<std::string, std::string>;
    Listener(std::shared_ptr<ValueClient> client, Key key, std::uint64_t id)
        : client_(std::move(client)), key_(std::move(key)), id_(id) {}
    ~Listener() { client_->leave(key_, id_); }
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

   private:
    std::shared_ptr<ValueClient> client_;
    Key key_;
    std::uint64_t id_;
  };
  using ListenerPtr = std::unique_ptr<Listener>;

  /// Listens to a wire, a pipe or an event. A wire's newest value comes at once; of an event, samples after number
  /// `after` as far as they are kept. Errors   those of connecting wire or pipe.
  rr::awaitable<rr::Result<ListenerPtr>> listen(MemberPlace place, std::uint64_t after, SampleHandler handler);
  /// Answers a callback until the Listener is destroyed, also across reconnects.
  /// Errors   member_busy: this client answers it already.
  rr::Result<ListenerPtr> answer_callback(const MemberPlace& place, CallbackHandler handler);
  /// A wire's OutValue, or a packet, over the connection that a listener holds; once closed by the device, it is opened
  /// anew. Errors   invalid_operation: nobody listens; those of connecting and sending.
  rr::awaitable<rr::Result<>> send(MemberPlace place, rr::Value value);

 private:
  using Key = Listener::Key;  // path, member
  using Handlers = std::map<std::uint64_t, std::shared_ptr<SampleHandler>>;
  enum class TopicState : std::uint8_t { idle, joining, joined };
  struct Topic {
    MemberPlace place;
    Handlers handlers;
    std::deque<SamplePtr> recent;  ///< a wire's newest value; an event's last ones
    std::size_t recent_bytes = 0;
    std::shared_ptr<CallbackHandler> callback;
    std::uint64_t last_number = 0;
    rr::PipeId pipe = 0;
    TopicState state = TopicState::idle;
    bool is_lost = false;  ///< with the connection, as listeners know
    rr::Error error = {};  ///< of the last attempt to join
  };

  // UpstreamClient
  std::weak_ptr<const void> life() const override { return weak_from_this(); }
  Subject lock_user() const override { return user_; }
  bool has_role(std::string_view role) const override { return standing_ && standing_->identity().has_role(role); }
  AuditEntryPtr begin_lease_end(const std::string& path) const override;
  bool may_lock(const std::string& path) const override;
  bool may_command(const std::string& path) const override;
  void lease_ended(const std::string& path, const std::string& why, const SafeAnswerPtr& safe) const override {
    safe_answer_ = safe;
    if (on_lease_ended_) on_lease_ended_(path, why);
  }
  std::shared_ptr<Upstream> upstream_in_use() const override { return upstream_; }
  bool may_answer(const std::string& path, const rr::MemberDefinition& callback) const override;
  void receive_event(rr::EventPacket& packet, rr::Now now) override;
  void receive_wire(rr::WirePacket& packet, rr::Now now) override;
  void answer_wire(const std::string& path, const rr::MemberDefinition& wire, const rr::Result<>& result) override;
  void note_conflated(const std::string&, const rr::MemberDefinition&, std::uint64_t) override {}
  void close_wire(const std::string& path, const rr::MemberDefinition& wire) override;
  void accept_pipe(rr::PipeId id) override;
  void refuse_pipe(rr::PipeId id, const rr::Error& error) override;
  void receive_packet(rr::PipeId id, rr::SharedPipePacket& packet, rr::Now now) override;
  bool is_behind() const override { return false; }
  void acknowledge_packets(rr::PipeId, std::span<const std::uint32_t>) override {}
  void close_pipe(rr::PipeId id) override;
  void release_path(const std::string& path) override;
  void call_callback(const std::string& path, const rr::MemberDefinition& callback,
                     std::span<const rr::Value> arguments, rr::ClientConnection::CallbackReply answer) override;
  void connection_lost(const rr::Error& reason) override;
  void found_again(const std::string& path) override;

  AccessRequest to_lock(const std::string& path) const;
  rr::awaitable<rr::Result<>> join(Key key);
  void begin_joining(Topic& topic);
  void joined(const Key& key, const rr::Result<>& result);
  /// The device has ended it, not the connection.
  void closed(const Key& key, const rr::Error& reason);
  void publish(const Key& key, Sample sample);
  /// To handlers, which may leave meanwhile.
  static void hand_out(const SamplePtr& sample, rr::MemberKind kind, const Handlers& handlers);
  void keep(Topic& topic, const SamplePtr& sample);
  void forget_value(Topic& topic);
  void forget_oldest(Topic& topic);
  void tell(const Key& key, const rr::Error* error);
  void leave(const Key& key, std::uint64_t id);
  void drop_if_unused(const Key& key);

  std::shared_ptr<Upstream> upstream_;
  Subject user_;
  std::function<void(const std::string&, const std::string&)> on_lease_ended_;
  mutable SafeAnswerPtr safe_answer_;  ///< as the locks tell it, to whom a client is const
  StandingPtr standing_;               ///< null: of nobody in particular
  bool needs_right_ = false;
  Device::Seat seat_;
  MemoryBudget::Charge memory_;
  std::map<Key, Topic> topics_;
  std::map<rr::PipeId, Key> pipes_;
  std::uint64_t last_id_ = 0;
  rr::PipeId last_pipe_ = 0;
  rr::GeneratorId last_generator_ = 0;
  bool has_left_ = false;
  boost::asio::steady_timer changed_;  ///< cancelled when a topic has been joined or not
};

}  // namespace rrgate
