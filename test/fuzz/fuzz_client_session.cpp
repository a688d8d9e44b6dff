// A hostile device against a client session: replies, packets, events and questions of every kind in any order, with
// any elements, their bytes bent, between those of a service that behaves; meanwhile the client asks, sends and waits.
// An input that begins as a message does ('R') is said as it is, once the session is open.
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "test/core/session/loopback.hpp"
#include "test/fuzz/hostile_peer.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rr;
using namespace rr::test;

constexpr std::size_t most_held = 48u << 20;

/// Small: each input has it parsed anew by the client.
const std::string small_definition = R"(service experimental.loopback
stdver 0.10
struct Pose
  field double x
  field double[] joints
end
object Tool
  property double speed
end
object Arm
  property double speed
  property Pose pose
  function double add(double a, double b)
  function int32{generator} count()
  event bumped(int32 side, string what)
  objref Tool tool
  objref Tool{string} tools
  wire double torque
  wire Pose state [readonly]
  pipe double samples
  memory int16[*] grid
  callback double ask(string question)
end
)";

/// A client and a service that behaves, joined in memory.
class Between {
 public:
  Between() {
    static const auto types = [] {
      auto made = std::make_shared<TypeRegistry>();
      made->add({small_definition}, RobdefMode::strict).value();
      return made;
    }();
    directory_
        .add(HostedService::make("arm", std::make_shared<PlainObject>("experimental.loopback.Arm"), types).value())
        .value();
    ClientOptions options;
    options.connection.self = {client_id, "test.client"};
    options.service = "arm";
    client = std::make_unique<ClientSession>(options, now);
    service = std::make_unique<ServiceSession>(directory_, ServiceSessionOptions{}, now);
  }

  void pump() {
    while (carry(*client, *service) || carry(*service, *client)) {
    }
  }
  template <class From, class To>
  bool carry(From& from, To& to) {
    Bytes bytes;
    for (const auto slice : from.poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    if (bytes.empty()) return false;
    from.handle_transmitted(bytes.size(), now);
    to.handle_bytes(bytes, now);
    return true;
  }

 private:
  ServiceDirectory directory_{{service_id, "test.service"}};

 public:
  Now now{TimePoint{} + std::chrono::hours(1), {1'700'000'000, 0}};
  std::unique_ptr<ClientSession> client;
  std::unique_ptr<ServiceSession> service;
};

class HostileDevice {
 public:
  explicit HostileDevice(Choices choices) : choices_(choices) {}

  /// All of it to an open session.
  void say(ByteSpan bytes) {
    between_.pump();
    deliver(bytes);
    end();
  }

  void run() {
    if (choices_.byte() & 1) between_.pump();  // else nothing of the device behaves, from its first byte on
    poll();
    while (!choices_.empty() && !is_closed_) {
      const auto what = choices_.byte();
      if (what < 0x80) {
        lie(static_cast<EntryType>(what < 0x20 ? 100 + what : 1100 + (what % 64) * 8 + choices_.byte() % 8));
      } else if (what < 0x90) {
        deliver(choices_.bytes(what & 0x0f));
      } else if (what < 0xe0) {
        ask(what);
      } else if (what < 0xf0) {
        answer_well();
      } else {
        pass(std::chrono::milliseconds(what < 0xf8 ? 10 : 7000));
      }
    }
    end();
  }

 private:
  ClientSession& client() { return *between_.client; }

  void lie(EntryType type) {
    auto& connection = const_cast<Connection&>(between_.service->connection());
    Message message;
    connection.begin_message(message);
    for (int entries = 1 + (choices_.byte() == 0xff); entries > 0; --entries) {
      auto& entry = message.begin_entry(type, choices_.word(paths), choices_.word(members), request_id());
      if (choices_.byte() > 0xe0) entry.error = static_cast<ErrorCode>(choices_.byte());
      add_elements(message, choices_, choices_.byte() % 4);
    }
    deliver(bent_bytes(message, choices_));
  }

  /// Most often one that is waited for.
  RequestId request_id() {
    const auto chosen = choices_.byte();
    if (chosen > 0xe0 || open_.empty()) return chosen;
    return *std::next(open_.begin(), static_cast<std::ptrdiff_t>(chosen % open_.size()));
  }

  void deliver(ByteSpan bytes) {
    require(client().handle_bytes(bytes, between_.now) == bytes.size(), "a client consumes all");
    poll();
  }

  /// What the client has asked for goes to the service, which answers as it should.
  void answer_well() {
    between_.carry(client(), *between_.service);
    while (auto event = between_.service->poll_event())
      if (auto* called = std::get_if<Called>(&*event)) between_.service->reply(called->id, Value(1.0), between_.now);
    between_.carry(*between_.service, client());
    poll();
  }

  void ask(std::uint8_t what) {
    const auto path = choices_.word(paths);
    const auto now = between_.now;
    const auto argument = Value(1.0);
    switch (what % 20) {
      case 0:
        return note(client().get_property(path, "speed", now));
      case 1:
        return note(client().get_property(path, "pose", now));
      case 2:
        return note(client().set_property(path, "speed", argument, now));
      case 3:
        return note(client().call_function(path, "add", std::vector<Value>{argument, argument}, now));
      case 4:
        return note(client().open_generator(path, "count", {}, now));
      case 5:
        return note(client().next_generator(path, "count", choices_.byte(), std::nullopt, now));
      case 6:
        return note(client().abort_generator(path, "count", choices_.byte(), now));
      case 7:
        return note(client().get_memory_dimensions(path, "grid", now));
      case 8: {
        const std::uint64_t position[] = {choices_.byte(), choices_.byte()};
        const std::uint64_t count[] = {choices_.byte(), choices_.byte()};
        return note(client().read_memory(path, "grid", position, count, now));
      }
      case 9:
        return note(client().find_object(path, now));
      case 10:
        return note(client().connect_wire(path, "torque", now));
      case 11:
        return note(client().disconnect_wire(path, "torque", now));
      case 12:
        return note(client().peek_in_value(path, "state", now));
      case 13:
        return note(client().connect_pipe(path, "samples", static_cast<std::int32_t>(choices_.byte()) - 2, now));
      case 14:
        return note(client().disconnect_pipe(path, "samples", choices_.byte(), now));
      case 15:
        (void)client().send_pipe_packet(path, "samples", choices_.byte(), argument, now, true);
        client().hold_pipe_acks(path, "samples", choices_.byte(), choices_.byte() & 1, now);
        return;
      case 16:
        return note(client().lock(path, LockKind::client, now));
      case 17:
        return note(client().enter_monitor(path, std::chrono::milliseconds(100), now));
      case 18:
        if (!open_.empty()) {
          client().cancel(*open_.begin());
          open_.erase(open_.begin());
        }
        return;
      default:
        (void)client().send_wire(path, "torque", argument, now);
        if (choices_.byte() == 0xff) client().disconnect(now);
    }
  }

  void note(RequestId id) {
    require(id != 0 && open_.insert(id).second, "each request has a number of its own");
    poll();
  }

  void poll() {
    while (auto event = client().poll_event()) {
      require(!is_closed_, "nothing happens behind the last event");
      if (const auto* done = std::get_if<Completed>(&*event))
        require(open_.erase(done->id) == 1, "each request ends once");
      if (const auto* asked = std::get_if<CallbackCalled>(&*event))
        client().reply_callback(asked->id, Value(1.0), between_.now);
      if (std::holds_alternative<SessionClosed>(*event)) {
        is_closed_ = true;
        require(open_.empty(), "each request ends before the session does");
      }
    }
    require(client().connection().held_bytes() < most_held, "what is held for a device is bounded");
  }

  void pass(std::chrono::milliseconds time) {
    between_.now.steady += time;
    between_.now.utc.seconds += time.count() / 1000;
    if (client().poll_timeout() > between_.now.steady) return;
    client().handle_timeout(between_.now);
    poll();
    require(is_closed_ || client().poll_timeout() > between_.now.steady, "a timer does not fire for ever");
  }

  /// The device goes: nobody waits for it any more.
  void end() {
    client().handle_closed(make_error(ErrorCode::connection_error, "gone"), between_.now);
    poll();
    require(is_closed_ && client().wants_close(), "a session ends with its stream");
    require(client().pending_requests() == 0, "nothing waits for a session that has ended");
  }

  Choices choices_;
  Between between_;
  std::set<RequestId> open_;
  bool is_closed_ = false;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size > 0 && data[0] == 'R')
    HostileDevice({nullptr, 0}).say({data, size});
  else
    HostileDevice({data, size}).run();
  return 0;
}
