// A hostile client against a service session: requests, packets and answers of every kind in any order, with any
// elements, their bytes bent; between them the application answers, sends and closes, and time passes.
#include <deque>
#include <vector>

#include "core/session/service/service_session.hpp"
#include "test/core/session/loopback.hpp"
#include "test/fuzz/hostile_peer.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rr;
using namespace rr::test;

class HostileClient {
 public:
  explicit HostileClient(Choices choices) : choices_(choices) {
    static const auto types = [] {
      auto made = std::make_shared<TypeRegistry>();
      made->add({test::definition}, RobdefMode::strict).value();
      return made;
    }();
    arm_ = HostedService::make("arm", std::make_shared<test::PlainObject>("experimental.loopback.Arm"), types).value();
    arm_->set_policy({.authenticator = std::make_shared<Nobody>(), .allow_object_lock = true});
    directory_.add(arm_).value();
    service_ = std::make_unique<ServiceSession>(directory_, ServiceSessionOptions{}, now_);
    say(EntryType::connect_client);
  }

  void run() {
    while (!choices_.empty() && !is_gone_) {
      const auto what = choices_.byte();
      if (what < 0xa0) {
        say(static_cast<EntryType>(what < 0x40 ? 100 + what : 1100 + (what % 64) * 8 + choices_.byte() % 8));
      } else if (what < 0xb0) {
        deliver(choices_.bytes(what & 0x0f));
      } else if (what < 0xe0) {
        act(what);
      } else {
        pass(std::chrono::milliseconds(what < 0xf0 ? 10 : 7000));
      }
    }
    service_.reset();
    require(arm_->object_locks().empty(), "no lock outlives its session");
    require(!arm_->monitor_locks().has_waiting(), "no wait outlives its session");
  }

 private:
  class Nobody final : public Authenticator {
   public:
    Result<AuthenticatedUser> authenticate(const LoginAttempt&) const override { return AuthenticatedUser{"nobody"}; }
  };

  void say(EntryType type) {
    Message message;
    message.header.sender_node_id = test::client_id;
    message.header.receiver_node_id = test::service_id;
    message.header.sender_endpoint = 7;
    message.header.receiver_endpoint = service_->endpoint();
    for (int entries = 1 + (choices_.byte() == 0xff); entries > 0; --entries) {
      message.begin_entry(type, choices_.word(paths), choices_.word(members), choices_.byte());
      if (type == EntryType::connect_client) message.add_text("servicename", "arm");
      add_elements(message, choices_, choices_.byte() % 4);
    }
    deliver(bent_bytes(message, choices_));
  }

  void deliver(ByteSpan bytes) {
    unread_.insert(unread_.end(), bytes.begin(), bytes.end());
    const auto consumed = service_->handle_bytes(unread_, now_);
    require(consumed <= unread_.size(), "no more is consumed than there is");
    unread_.erase(unread_.begin(), unread_.begin() + static_cast<std::ptrdiff_t>(consumed));
    poll();
  }

  void poll() {
    while (auto event = service_->poll_event()) {
      require(!is_gone_, "nothing happens behind the last event");
      if (auto* called = std::get_if<Called>(&*event)) calls_.push_back(called->id);
      if (auto* pipe = std::get_if<PipeConnected>(&*event)) pipes_.push_back(pipe->id);
      if (auto* login = std::get_if<LoginRequested>(&*event))
        service_->answer_login(login->id, AuthenticatedUser{"nobody", {"objectlock"}}, now_);
      if (std::get_if<LocksChanged>(&*event)) service_->handle_locks_changed(now_);
      is_gone_ = is_gone_ || std::holds_alternative<ClientGone>(*event);
    }
    std::size_t size = 0;
    for (const auto slice : service_->poll_transmit()) size += slice.size();
    if (reads_) service_->handle_transmitted(size, now_);
    require(service_->held_bytes() < 32u << 20, "what is held for a client is bounded");
  }

  void act(std::uint8_t what) {
    const auto& torque = *arm_->root_type().find_member("torque");
    switch (what % 8) {
      case 0:
      case 1:
        if (calls_.empty()) break;
        service_->reply(calls_.front(),
                        what & 8 ? Result<Value>(Value(1.0)) : make_error(ErrorCode::stop_iteration, ""), now_);
        calls_.pop_front();
        break;
      case 2:
        if (!pipes_.empty()) (void)service_->send_pipe_packet(pipes_.back(), Value(1.0), now_, what & 8);
        break;
      case 3:
        if (!pipes_.empty()) service_->close_pipe(pipes_.front(), now_);
        break;
      case 4:
        (void)service_->send_wire("arm", torque, Value(2.0), now_);
        break;
      case 5:
        (void)service_->call_callback("arm", *arm_->root_type().find_member("ask"), std::vector<Value>{Value("why")},
                                      now_);
        break;
      case 6:
        service_->release_path(what & 8 ? "arm.tool" : "arm.tools[a]", now_);
        break;
      default:
        if (what & 8) service_->close_wire("arm", torque, now_);
        reads_ = !reads_;
    }
    poll();
  }

  void pass(std::chrono::milliseconds time) {
    now_.steady += time;
    now_.utc = TimeSpec{now_.utc.seconds + time.count() / 1000, now_.utc.nanoseconds};
    if (service_->poll_timeout() > now_.steady) return;
    service_->handle_timeout(now_);
    poll();
    require(service_->poll_timeout() > now_.steady, "a timer does not fire for ever");
  }

  Choices choices_;
  Now now_{TimePoint{} + std::chrono::hours(1), {1'700'000'000, 0}};
  std::shared_ptr<HostedService> arm_;
  ServiceDirectory directory_{{test::service_id, "test.service"}};
  std::unique_ptr<ServiceSession> service_;
  Bytes unread_;
  std::deque<CallId> calls_;
  std::vector<PipeId> pipes_;
  bool is_gone_ = false;
  bool reads_ = true;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  HostileClient({data, size}).run();
  return 0;
}
