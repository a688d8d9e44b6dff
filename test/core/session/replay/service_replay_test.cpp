// The client's half of every recorded session, fed to our service: it must answer as the reference did. What the
// application behind the service does (return values, errors, events, packets) is taken from the record as well.
#include <catch2/catch.hpp>
#include <map>
#include <memory>

#include "core/member/arguments.hpp"
#include "core/member/error_entry.hpp"
#include "core/member/generator.hpp"
#include "core/member/memory.hpp"
#include "core/member/pipe.hpp"
#include "core/member/wire.hpp"
#include "core/session/service/service_session.hpp"
#include "test/core/session/replay/recorded_peer.hpp"
#include "test/support/format_message.hpp"
#include "test/support/print.hpp"

namespace rr::test {
namespace {

const std::string station_type = "experimental.transcript.station";
const std::string part_type = "experimental.transcript.part";

/// The recorded objects: all children are parts, and one key has none.
class RecordedObject : public ServiceObject {
 public:
  explicit RecordedObject(std::string type) : type_(std::move(type)) {}
  const std::string& type_name() const override { return type_; }
  bool is_monitor_lockable() const override { return true; }
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition&,
                                                    const std::optional<std::string>& index) override {
    if (index == "none") return Error{ErrorCode::invalid_argument, "no such part"};
    return std::shared_ptr<ServiceObject>(std::make_shared<RecordedObject>(part_type));
  }

 private:
  std::string type_;
};

/// The users of `guarded`.
class RecordedUsers : public Authenticator {
 public:
  Result<AuthenticatedUser> authenticate(const LoginAttempt& attempt) const override {
    const auto* password = attempt.credentials.find("password");
    const auto text = password ? password->to_text() : Result<std::string_view>(std::string_view());
    if (attempt.username == "alice" && text && *text == "secret") return AuthenticatedUser{"alice", {"objectlock"}};
    if (attempt.username == "bob" && text && *text == "hunter2") return AuthenticatedUser{"bob", {"objectlock"}};
    if (attempt.username == "root" && text && *text == "toor")
      return AuthenticatedUser{"root", {"objectlock", "objectlockoverride"}};
    return make_error(ErrorCode::authentication_error, "Authentication Failed");
  }
};

/// Where we answer otherwise than the reference on purpose.
struct Departure {
  std::string_view message;  ///< a part of its text
  std::string_view why;
};
constexpr Departure departures[] = {
    {"ObjectTypeNameRet path=station.parts[-1]", "RobotRaconteurWeb escapes indices so; the reference refuses it"},
    {"ConnectClientCombinedRet path=guarded req=1 ERROR 150", "a client that is refused has no endpoint"},
    {"count:uint64=[0, ", "the reference writes the position into `count` as well"},
    {"StreamOpRet member=CreateConnection ERROR 7", "a client that is refused needs no capabilities"},
};

struct Server : RecordedPeer<ServiceSession> {
  std::map<std::uint32_t, Called> calls;                         ///< not answered yet, by the recorded request id
  std::map<std::pair<std::string, std::int32_t>, PipeId> pipes;  ///< by member and index
};

class ServiceReplay {
 public:
  explicit ServiceReplay(Transcript transcript) : transcript_(std::move(transcript)) {
    auto types = std::make_shared<TypeRegistry>();
    types->add({transcript_definition()}, RobdefMode::compat).value();
    MapString attributes;
    attributes.items.emplace_back("place", Value("bench"));
    attributes.items.emplace_back("revision", Value(std::int32_t{3}));
    const auto add = [&](const std::string& name, MapString with) {
      if (!transcript_.has_service(name)) return;
      const auto root = std::make_shared<RecordedObject>(station_type);
      services_.push_back(HostedService::make(name, root, types, std::move(with)).value());
      directory_.add(services_.back()).value();
    };
    add("station", attributes);
    add("closing", {});
    add("guarded", {});
    if (services_.back()->name() == "guarded")
      services_.back()->set_policy({std::make_shared<RecordedUsers>(), true, true});
  }

  void play() {
    for (std::size_t at = 0; at < transcript_.steps.size(); ++at) {
      const auto& step = transcript_.steps[at];
      advance(step.time);
      INFO(transcript_.name << ", message " << at << ": " << step.text.substr(0, 400));
      auto& server = this->server(step.connection);
      if (step.is_clients)
        deliver(server, at);
      else if (!was_repeated(at))
        expect(server, at);
    }
    for (auto& [number, server] : servers_) {
      INFO(transcript_.name << ", connection " << number);
      // Some recorded clients hung up before their leave-taking was answered; to a wrong endpoint the reference is
      // silent.
      std::erase_if(server.sent, [](const auto& message) {
        const auto& entry = message->entries.front();
        return entry.type == EntryType::disconnect_client_ret || entry.error == ErrorCode::invalid_endpoint;
      });
      for (const auto& message : server.sent) FAIL_CHECK("not recorded: " << format_message(*message));
      CHECK(server.calls.empty());
      CHECK((server.heartbeats_sent > 0) == (server.heartbeats_expected > 0));
    }
  }

 private:
  Server& server(int connection) {
    auto& server = servers_[connection];
    if (!server.session) {
      ServiceSessionOptions options;
      options.connection.features = transcript_.service_features();
      options.base_url = transcript_.base_url();
      options.max_memory_transfer = 1024;
      options.connection.heartbeat_period = transcript_.service_heartbeat_period();
      server.session = std::make_unique<ServiceSession>(directory_, options, now_);
    }
    return server;
  }

  void advance(std::chrono::microseconds time) {
    now_.steady = start_ + time;
    for (auto& [number, server] : servers_)
      if (server.session->poll_timeout() <= now_.steady) {
        server.session->handle_timeout(now_);
        server.collect(now_);
      }
  }

  void deliver(Server& server, std::size_t at) {
    server.session->handle_bytes(server.for_session(transcript_.steps[at]), now_);
    poll(server, at);
  }

  void poll(Server& server, std::size_t at) {
    while (auto event = server.session->poll_event()) {
      if (auto* called = std::get_if<Called>(&*event))
        server.calls.emplace(recorded_request(*called, at), std::move(*called));
      if (auto* pipe = std::get_if<PipeConnected>(&*event)) server.pipes[{pipe->member->name, pipe->index}] = pipe->id;
      if (std::get_if<LocksChanged>(&*event)) {
        for (auto& [number, other] : servers_) {
          other.session->handle_locks_changed(now_);
          other.collect(now_);
        }
      }
      if (auto* login = std::get_if<LoginRequested>(&*event))
        server.session->answer_login(login->id, login->authenticator->authenticate(login->attempt), now_);
    }
    server.collect(now_);
  }

  /// Requests come in the order of their entries, and each event names its member.
  std::uint32_t recorded_request(const Called& called, std::size_t at) {
    const auto& step = transcript_.steps[at];
    for (const auto& entry : step.message->entries)
      if (entry.member_name == called.member->name && !servers_[step.connection].calls.contains(entry.request_id))
        return entry.request_id;
    FAIL("a call that nobody made: " << called.member->name);
    return 0;
  }

  /// The reference sends some answers twice.
  bool was_repeated(std::size_t at) const {
    const auto& step = transcript_.steps[at];
    if (step.entry().type != EntryType::object_type_name_ret) return false;
    for (std::size_t before = 0; before < at; ++before)
      if (transcript_.steps[before].connection == step.connection && transcript_.steps[before].text == step.text)
        return true;
    return false;
  }

  void expect(Server& server, std::size_t at) {
    const auto& step = transcript_.steps[at];
    if (step.entry().type == EntryType::connection_test) {
      ++server.heartbeats_expected;
      return;
    }
    bool is_application_error = false;
    for (const auto& entry : step.message->entries) {
      is_application_error |= server.calls.contains(entry.request_id);
      act(server, *step.message, entry);
    }
    server.collect(now_);
    if (step.message->entries.size() > 1) return expect_one_by_one(server, step);
    auto found = server.find_sent(step.entry(), true);
    if (found == server.sent.end() && step.entry().type == EntryType::memory_read_ret) {
      // The reference answers a write as if it were a read; its clients take either.
      auto write_reply = step.entry();
      write_reply.type = EntryType::memory_write_ret;
      found = server.find_sent(write_reply, true);
      if (found != server.sent.end()) (*found)->entries.front().type = EntryType::memory_read_ret;
    }
    REQUIRE(found != server.sent.end());
    auto& message = **found;
    if (message.header.sender_endpoint != 0)
      server.to_recorded.endpoints[message.header.sender_endpoint] = transcript_.endpoint(step.connection, false);
    learn_generator(server, message, *step.message);
    server.to_recorded.apply(message);
    if (!is_application_error) {
      wipe_error_texts(message);
      wipe_error_texts(*step.message);
    }
    const auto difference = compare(message, *step.message);
    const auto* departure = find_departure(step);
    INFO((departure ? departure->why : "as recorded"));
    CHECK(difference.empty() == !departure);
    if (!departure) CHECK(difference == "");
    server.sent.erase(found);
  }

  static void learn_generator(Server& server, const Message& found, const Message& recorded) {
    const auto* ours = found.elements_of(found.entries.front()).find("index");
    const auto* theirs = recorded.elements_of(recorded.entries.front()).find("index");
    if (found.entries.front().type == EntryType::function_call_res && ours && theirs)
      server.to_recorded.generators[load<std::int32_t>(ours->data.data())] = load<std::int32_t>(theirs->data.data());
  }

  /// The reference joins its replies to the requests of one message; ours come one by one.
  void expect_one_by_one(Server& server, const Step& step) {
    for (const auto& entry : step.message->entries) {
      const auto found = server.find_sent(entry, true);
      REQUIRE(found != server.sent.end());
      const auto text = format_message(**found);
      CHECK(step.text.find(text.substr(text.rfind(" | "))) != std::string::npos);
      server.sent.erase(found);
    }
  }

  static const Departure* find_departure(const Step& step) {
    for (const auto& departure : departures)
      if (step.text.find(departure.message) != std::string::npos) return &departure;
    return nullptr;
  }

  /// Does what the recorded application did for this entry to be sent.
  void act(Server& server, const Message& message, const MessageEntry& entry) {
    if (const auto call = server.calls.extract(entry.request_id); !call.empty())
      return server.session->reply(call.mapped().id, recorded_result(message, entry, call.mapped()), now_);
    auto& session = *server.session;
    const auto* type = object_type(session, entry.service_path);
    const auto* member = type ? type->find_member(entry.member_name) : nullptr;
    switch (entry.type) {
      case EntryType::event_req:
        REQUIRE(session.send_event(entry.service_path, *member,
                                   read_arguments(message, entry, *member, types()).value(), now_));
        break;
      case EntryType::callback_call_req:
        REQUIRE(session.call_callback(entry.service_path, *member,
                                      read_arguments(message, entry, *member, types()).value(), now_));
        break;
      case EntryType::wire_packet:
        REQUIRE(session.send_wire(entry.service_path, *member,
                                  read_wire_value(message, entry, *member, types()).value().value, now_));
        break;
      case EntryType::wire_closed:
        session.close_wire(entry.service_path, *member, now_);
        break;
      case EntryType::pipe_connect_ret:
        session.accept_pipe(pipe_of(server, entry, read_pipe_index_element(message, entry, *member).value()), now_);
        break;
      case EntryType::pipe_packet:
        for (const auto& element : message.elements_of(entry)) {
          auto packet = read_pipe_packet_head(message, element, *member).value();
          REQUIRE(read_pipe_packet_value(message, element, *member, types(), packet));
          const auto id = pipe_of(server, entry, read_pipe_index(element).value());
          CHECK(session.send_pipe_packet(id, packet.value, now_, packet.wants_ack).value() == packet.number);
        }
        break;
      case EntryType::pipe_closed:
        session.close_pipe(pipe_of(server, entry, read_pipe_index_element(message, entry, *member).value()), now_);
        break;
      case EntryType::service_path_released_req:
        session.release_path(entry.service_path, now_);
        break;
      case EntryType::service_closed:
        server.calls.clear();
        session.close_service(now_);
        break;
      default:
        break;  // the session answers by itself
    }
  }

  static PipeId pipe_of(const Server& server, const MessageEntry& entry, std::int32_t index) {
    const auto found = server.pipes.find({std::string(entry.member_name), index});
    return found == server.pipes.end() ? 0 : found->second;
  }

  const TypeRegistry& types() const { return services_.front()->types(); }

  const EntityDefinition* object_type(const ServiceSession& session, std::string_view path) {
    if (!session.service()) return nullptr;
    const auto found = session.service()->find_object(path);
    return found ? found->type : nullptr;
  }

  Result<Value> recorded_result(const Message& message, const MessageEntry& entry, const Called& called) {
    if (entry.error != ErrorCode::none) return read_error(message, entry, types());
    switch (called.kind) {
      case CallKind::property_get:
        return read_property(message, entry, *called.member, types());
      case CallKind::function:
        return read_return(message, entry, *called.member, types());
      case CallKind::memory_dimensions:
        return Value(read_memory_shape(message, entry, *called.member).value());
      case CallKind::memory_read:
        return read_memory_data(message, entry, called.range.count, *called.member, types());
      case CallKind::generator_next:
        return read_generator_return(message, entry, GeneratorStep::next, *called.member, types());
      case CallKind::peek_in:
      case CallKind::peek_out:
        return read_wire_value(message, entry, *called.member, types()).value().value;
      default:
        return Value{};
    }
  }

  Transcript transcript_;
  ServiceDirectory directory_{{parse_node_id("11111111-2222-3333-4444-555555555555").value(), "transcript.service"}};
  std::vector<std::shared_ptr<HostedService>> services_;
  std::map<int, Server> servers_;
  TimePoint start_ = TimePoint{} + std::chrono::hours(1);
  Now now_{start_, {1'700'000'000, 0}};
};

}  // namespace

TEST_CASE("our service answers as the recorded one did") {
  for (const auto& name : transcript_names()) {
    DYNAMIC_SECTION(name) {
      ServiceReplay(read_transcript(name)).play();
    }
  }
}

}  // namespace rr::test
