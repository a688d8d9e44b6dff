// A client and a service session joined in memory: every byte, no socket, time by hand.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/member/error_entry.hpp"
#include "core/session/client/client_session.hpp"
#include "core/session/service/service_session.hpp"

namespace rr::test {

inline constexpr NodeId client_id{{0xaa, 0xaa, 0xaa, 0xaa, 1}};
inline constexpr NodeId service_id{{0x11, 0x11, 0x11, 0x11, 2}};

inline const std::string definition = R"(service experimental.loopback
stdver 0.10

exception ArmJammed

struct Pose
  field double x
  field double[] joints
end

object Tool
  property string name
  memory double[] notes
  wire double force
end

object Arm
  property double speed
  property int32 serial [readonly]
  property int32 secret [writeonly]
  property int32 status [nolock]
  property double shown [nolockread]
  property int32 alarm [urgent]
  property Pose pose
  function double add(double a, double b)
  function void stop()
  function void jam()
  function int32{generator} count()
  function double{generator} scale(double factor, double{generator} values)
  function void sink(string{generator} lines)
  event bumped(int32 side, string what)
  event alarmed(int32 number) [urgent]
  objref Tool tool
  objref Tool{string} tools
  objref Tool[] slots
  objref varobject anything
  wire double aim
  wire double torque
  wire Pose state [readonly]
  wire Pose plan
  pipe double samples
  memory double[] data
  memory int16[*] grid
  memory uint8[] log [readonly]
  memory uint8[] command [writeonly]
  memory double[] archive [nolockread]
  pipe Pose poses [readonly]
  pipe double orders [writeonly]
  pipe double quick [unreliable]
  callback double ask(string question)
  callback void notice(int32 number)
end
)";

/// An object without behaviour: the tests answer the calls.
class PlainObject : public ServiceObject {
 public:
  explicit PlainObject(std::string type) : type_(std::move(type)) {}
  const std::string& type_name() const override { return type_; }
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition& objref,
                                                    const std::optional<std::string>& index) override {
    asked.push_back(objref.name + (index ? "[" + *index + "]" : ""));
    if (while_finding) while_finding();
    if (index == "none") return std::shared_ptr<ServiceObject>();
    return std::shared_ptr<ServiceObject>(std::make_shared<PlainObject>("experimental.loopback.Tool"));
  }
  bool is_monitor_lockable() const override { return has_monitor; }
  std::vector<std::string> asked;
  std::function<void()> while_finding;
  bool has_monitor = true;

 private:
  std::string type_;
};

/// One client, one service `arm`, one connection.
class Loopback {
 public:
  explicit Loopback(Features client_features = {}, Features service_features = {}) {
    auto types = std::make_shared<TypeRegistry>();
    types->add({definition}, RobdefMode::strict).value();
    MapString attributes;
    attributes.items.emplace_back("location", Value("bench"));
    directory.add(HostedService::make("arm", root, types, attributes).value()).value();
    ClientOptions options;
    options.connection.self = {client_id, "test.client"};
    options.connection.features = client_features;
    options.service = "arm";
    client = std::make_unique<ClientSession>(options, now);
    ServiceSessionOptions service_options;
    service_options.connection.features = service_features;
    service_options.base_url = "rr+tcp://127.0.0.1:1/";
    service = std::make_unique<ServiceSession>(directory, service_options, now);
  }

  /// Carries bytes both ways until neither side has any, `step` bytes at a time.
  void pump(std::size_t step = 1u << 20) {
    while (carry(*client, *service, step) || carry(*service, *client, step)) {
    }
  }
  void advance(std::chrono::milliseconds time) {
    now.steady += time;
    now.utc =
        TimeSpec{now.utc.seconds, now.utc.nanoseconds + static_cast<std::int32_t>(time.count() % 1000) * 1'000'000}
            .normalized();
    now.utc.seconds += time.count() / 1000;
  }
  void connect() {
    pump();
    next_client<Connected>();
    next_service<ClientConnected>();
  }

  template <class Event>
  Event next_client() {
    return take<Event>(client->poll_event());
  }
  template <class Event>
  Event next_service() {
    return take<Event>(service->poll_event());
  }
  /// The completion of a request, after pumping.
  Result<Value> completion(RequestId id) {
    pump();
    auto done = next_client<Completed>();
    if (done.id != id) throw std::runtime_error("completed another request");
    return done.result;
  }

  /// What a peer of another make might send: `write` adds entries to a message of the sender's session, which carry()
  /// then takes across.
  template <class Session, class Write>
  void forge(Session& sender, Write&& write) {
    auto& connection = const_cast<Connection&>(sender.connection());
    Message message;
    connection.begin_message(message);
    write(message);
    connection.send(message, now).value();
  }
  /// Drops what the client has sent: the test answers in the service's place.
  void lose_requests() {
    std::size_t size = 0;
    for (const auto slice : client->poll_transmit()) size += slice.size();
    client->handle_transmitted(size, now);
  }
  /// The error of the service's answer to such a message; none where it is no error.
  template <class Write>
  Error answer_to(Write&& write) {
    forge(*client, write);
    carry(*client, *service, 1u << 20);
    Bytes bytes;
    for (const auto slice : service->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    service->handle_transmitted(bytes.size(), now);
    Message answer;
    decode(bytes, {.string_table = {true, true}}, answer).value();
    if (answer.entries.front().error == ErrorCode::none) return {ErrorCode::none, {}};
    return read_error(answer, answer.entries.front(), TypeRegistry{});
  }

  template <class From, class To>
  bool carry(From& from, To& to, std::size_t step) {
    Bytes bytes;
    for (const auto slice : from.poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    if (bytes.empty()) return false;
    from.handle_transmitted(bytes.size(), now);
    for (std::size_t at = 0; at < bytes.size(); at += step)
      to.handle_bytes(ByteSpan(bytes).subspan(at, std::min(step, bytes.size() - at)), now);
    return true;
  }

  Now now{TimePoint{} + std::chrono::hours(1), {1'700'000'000, 0}};
  std::shared_ptr<PlainObject> root = std::make_shared<PlainObject>("experimental.loopback.Arm");
  ServiceDirectory directory{{service_id, "test.service"}};
  std::unique_ptr<ClientSession> client;
  std::unique_ptr<ServiceSession> service;

 private:
  template <class Event, class Any>
  Event take(std::optional<Any> event) {
    if (!event) throw std::runtime_error("no event");
    if (!std::holds_alternative<Event>(*event)) {
      if constexpr (std::is_same_v<Any, ClientEvent>)
        if (const auto* closed = std::get_if<SessionClosed>(&*event))
          throw std::runtime_error("closed: " + closed->reason.message);
      throw std::runtime_error("another event: index " + std::to_string(event->index()));
    }
    return std::get<Event>(std::move(*event));
  }
};

inline std::string slot(int number) {
  return "arm.slots[" + std::to_string(number) + "]";
}

}  // namespace rr::test
