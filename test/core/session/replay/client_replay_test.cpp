// The service's half of every recorded session, fed to our client: doing what the recorded client did, it must send
// what that one sent, and understand every answer.
#include <catch2/catch.hpp>
#include <deque>
#include <map>
#include <memory>
#include <set>

#include "core/member/arguments.hpp"
#include "core/member/error_entry.hpp"
#include "core/member/generator.hpp"
#include "core/member/memory.hpp"
#include "core/member/pipe.hpp"
#include "core/member/wire.hpp"
#include "core/session/client/client_session.hpp"
#include "test/core/session/replay/recorded_peer.hpp"
#include "test/support/print.hpp"

namespace rr::test {
namespace {

struct Client : RecordedPeer<ClientSession> {
  std::set<std::string> known_limits;  ///< memories whose MaxTransferSize was asked for
  std::deque<CallbackId> callbacks;    ///< not answered yet, in the order that they came
  std::set<std::uint32_t> left_out;    ///< recorded requests that ours does not make
};

class ClientReplay {
 public:
  explicit ClientReplay(Transcript transcript) : transcript_(std::move(transcript)) {
    types_.add({transcript_definition()}, RobdefMode::strict).value();
  }

  void play() {
    for (std::size_t at = 0; at < transcript_.steps.size(); ++at) {
      const auto& step = transcript_.steps[at];
      INFO(transcript_.name << ", message " << at << ": " << step.text.substr(0, 400));
      auto& client = this->client(step);
      advance(step.time);
      if (step.is_clients)
        expect(client, at);
      else
        deliver(client, at);
    }
    for (auto& [number, client] : clients_) {
      INFO(transcript_.name << ", connection " << number);
      CHECK(client.sent.empty());
      CHECK(client.session->pending_requests() == 0);
      CHECK((client.heartbeats_sent > 0) == (client.heartbeats_expected > 0));
    }
  }

 private:
  Client& client(const Step& step) {
    auto& client = clients_[step.connection];
    if (client.session) return client;
    ClientOptions options;
    options.connection.self = {step.message->header.sender_node_id, "transcript.client"};
    options.connection.features = transcript_.client_features();
    options.connection.heartbeat_period = transcript_.client_heartbeat_period();
    for (const auto& later : transcript_.steps) {
      if (later.connection != step.connection || !later.is_clients) continue;
      if (options.service.empty()) options.service = later.entry().service_path;
      read_login(*later.message, options);
    }
    if (options.service.empty()) options.service = "station";
    client.session = std::make_unique<ClientSession>(options, now_);
    client.collect(now_);
    return client;
  }

  void read_login(const Message& message, ClientOptions& options) {
    const auto elements = message.elements_of(message.entries.front());
    if (const auto* username = elements.find("username")) options.username = username->text();
    if (const auto* credentials = elements.find("credentials"))
      options.credentials = unpack_varvalue(message, *credentials, types_).value();
  }

  void advance(std::chrono::microseconds time) {
    now_.steady = start_ + time;
    for (auto& [number, client] : clients_) {
      if (client.session->poll_timeout() > now_.steady) continue;
      client.session->handle_timeout(now_);
      client.collect(now_);
    }
  }

  void deliver(Client& client, std::size_t at) {
    auto& step = transcript_.steps[at];
    if (client.left_out.contains(step.entry().request_id)) return;
    client.session->handle_bytes(client.for_session(step), now_);
    while (auto event = client.session->poll_event()) {
      if (const auto* completed = std::get_if<Completed>(&*event)) check_completion(client, at, *completed);
      if (const auto* called = std::get_if<CallbackCalled>(&*event)) client.callbacks.push_back(called->id);
    }
    client.collect(now_);
  }

  /// The error is the recorded one, and a value reads as the record does.
  void check_completion(Client& client, std::size_t at, const Completed& completed) {
    const auto& step = transcript_.steps[at];
    CHECK(client.to_recorded.requests.contains(completed.id));
    const auto& entry = step.entry();
    if (entry.type == EntryType::service_closed) {
      CHECK(completed.result.error().code == ErrorCode::connection_error);
      return;
    }
    const auto code = completed.result ? ErrorCode::none : completed.result.error().code;
    CHECK(code == entry.error);
    if (entry.error != ErrorCode::none)
      CHECK(completed.result.error().message == read_error(*step.message, entry, types_).message);
  }

  void expect(Client& client, std::size_t at) {
    const auto& step = transcript_.steps[at];
    if (step.entry().type == EntryType::connection_test) {
      ++client.heartbeats_expected;
      return;
    }
    if (is_departure(client, step)) {
      client.left_out.insert(step.entry().request_id);
      return;
    }
    if (client.find_sent(step.entry(), false) == client.sent.end()) {
      act(client, *step.message, step.entry());
      client.collect(now_);
      answer_parameters(client);
    }
    const auto found = client.find_sent(step.entry(), false);
    REQUIRE(found != client.sent.end());
    auto& message = **found;
    if (message.header.sender_endpoint != 0)
      client.to_recorded.endpoints[message.header.sender_endpoint] = transcript_.endpoint(step.connection, true);
    client.to_recorded.requests[message.entries.front().request_id] = step.entry().request_id;
    client.to_recorded.apply(message);
    // On local transports the reference's client always writes the full header; either is understood.
    if (transcript_.name.starts_with("rr+local")) message.header = step.message->header;
    // Where the reference asks for any endpoint once it has closed one, ours names one that the session has not had.
    if (step.entry().type == EntryType::pipe_connect_req &&
        load<std::int32_t>(step.message->elements.front().data.data()) == any_pipe_index)
      message.elements.front().data = step.message->elements.front().data;
    CHECK(compare(message, *step.message) == "");
    client.sent.erase(found);
  }

  /// Our client asks for a memory's size before each use and for its limit once, the reference for its limit before
  /// each transfer: whatever is asked gets the recorded answer.
  void answer_parameters(Client& client) {
    while (!client.sent.empty() && client.sent.front()->entries.front().type == EntryType::memory_get_param) {
      const auto asked = std::move(client.sent.front());
      client.sent.pop_front();
      auto& answer = recorded_answer(*asked);
      const auto recorded_id = answer.entry().request_id;
      client.to_recorded.requests = {{asked->entries.front().request_id, recorded_id}};
      client.to_recorded.endpoints[client.session->connection().local_endpoint()] =
          transcript_.endpoint(answer.connection, true);
      client.session->handle_bytes(client.for_session(answer), now_);
      client.collect(now_);
    }
  }

  Step& recorded_answer(const Message& asked) {
    const auto parameter = asked.elements_of(asked.entries.front()).find("parameter")->text();
    for (std::size_t at = 0; at < transcript_.steps.size(); ++at) {
      const auto& step = transcript_.steps[at];
      if (step.entry().type != EntryType::memory_get_param ||
          step.entry().member_name != asked.entries.front().member_name ||
          step.message->elements_of(step.entry()).find("parameter")->text() != parameter)
        continue;
      for (auto& answer : transcript_.steps)
        if (!answer.is_clients && answer.entry().request_id == step.entry().request_id &&
            answer.entry().type == EntryType::memory_get_param_ret)
          return answer;
    }
    throw std::runtime_error("nobody asked for " + std::string(parameter));
  }

  /// Where our client asks otherwise than the reference on purpose.
  bool is_departure(const Client& client, const Step& step) const {
    const auto& entry = step.entry();
    // The reference takes leave of a service that has refused it; ours closes the connection.
    if (entry.type == EntryType::disconnect_client && client.session->state() == ClientState::closed) return true;
    // When the parameters of a memory are asked for differs: see answer_parameters().
    if (entry.type == EntryType::memory_get_param) return true;
    // The reference goes on using an object that the service has released; ours has to look it up again.
    return entry.type == EntryType::function_call_req && !client.session->object_type(entry.service_path);
  }

  /// Asks the session for what the recorded client's application asked for.
  void act(Client& client, const Message& message, const MessageEntry& entry) {
    auto& session = *client.session;
    const auto path = entry.service_path;
    const auto name = entry.member_name;
    const auto* type = session.object_type(path);
    const auto* member = type ? type->find_member(name) : nullptr;
    switch (entry.type) {
      case EntryType::disconnect_client:
        session.disconnect(now_);
        break;
      case EntryType::object_type_name:
        session.find_object(path, now_);
        break;
      case EntryType::client_session_op_req:
        act_on_session(session, message, entry);
        break;
      case EntryType::property_get_req:
        session.get_property(path, name, now_);
        break;
      case EntryType::property_set_req:
        session.set_property(path, name, read_property(message, entry, *member, types_).value(), now_);
        break;
      case EntryType::function_call_req: {
        const auto arguments = read_arguments(message, entry, *member, types_).value();
        if (member->is_generator())
          session.open_generator(path, name, arguments, now_);
        else
          session.call_function(path, name, arguments, now_);
        break;
      }
      case EntryType::generator_next_req: {
        const auto index = read_generator_index(message, entry, *member).value();
        const auto step = generator_step(entry);
        if (step == GeneratorStep::close) session.close_generator(path, name, index, now_);
        if (step == GeneratorStep::abort) session.abort_generator(path, name, index, now_);
        if (step == GeneratorStep::next)
          session.next_generator(path, name, index, read_generator_parameter(message, entry, *member, types_).value(),
                                 now_);
        break;
      }
      case EntryType::callback_call_ret: {
        REQUIRE(!client.callbacks.empty());
        const auto id = client.callbacks.front();
        client.callbacks.pop_front();
        session.reply_callback(id,
                               entry.error != ErrorCode::none ? Result<Value>(read_error(message, entry, types_))
                                                              : read_return(message, entry, *member, types_),
                               now_);
        break;
      }
      case EntryType::memory_read: {
        const auto range = read_memory_range(message, entry, *member).value();
        session.read_memory(path, name, range.position, range.count, now_);
        break;
      }
      case EntryType::memory_write: {
        const auto range = read_memory_range(message, entry, *member).value();
        session.write_memory(path, name, range.position,
                             read_memory_data(message, entry, range.count, *member, types_).value(), now_);
        break;
      }
      case EntryType::pipe_connect_req:
        session.connect_pipe(path, name, read_pipe_index_element(message, entry, *member).value(), now_);
        break;
      case EntryType::pipe_disconnect_req:
        session.disconnect_pipe(path, name, read_pipe_index_element(message, entry, *member).value(), now_);
        break;
      case EntryType::pipe_packet:
        for (const auto& element : message.elements_of(entry)) {
          auto packet = read_pipe_packet_head(message, element, *member).value();
          REQUIRE(read_pipe_packet_value(message, element, *member, types_, packet));
          CHECK(
              session
                  .send_pipe_packet(path, name, read_pipe_index(element).value(), packet.value, now_, packet.wants_ack)
                  .value() == packet.number);
        }
        break;
      case EntryType::wire_connect_req:
        session.connect_wire(path, name, now_);
        break;
      case EntryType::wire_disconnect_req:
        session.disconnect_wire(path, name, now_);
        break;
      case EntryType::wire_packet:
        REQUIRE(session.send_wire(path, name, read_wire_value(message, entry, *member, types_).value().value, now_));
        break;
      case EntryType::wire_peek_in_value_req:
        session.peek_in_value(path, name, now_);
        break;
      case EntryType::wire_peek_out_value_req:
        session.peek_out_value(path, name, now_);
        break;
      case EntryType::wire_poke_out_value_req:
        session.poke_out_value(path, name, read_wire_value(message, entry, *member, types_).value().value, now_);
        break;
      default:
        FAIL("nobody asks for that");
    }
  }

  void act_on_session(ClientSession& session, const Message& message, const MessageEntry& entry) {
    const auto path = entry.service_path;
    if (entry.member_name == "RequestObjectLock") session.lock(path, LockKind::user, now_);
    if (entry.member_name == "RequestClientObjectLock") session.lock(path, LockKind::client, now_);
    if (entry.member_name == "ReleaseObjectLock") session.unlock(path, now_);
    if (entry.member_name == "LogoutUser") session.logout(now_);
    if (entry.member_name == "MonitorExit") session.exit_monitor(path, now_);
    if (entry.member_name == "MonitorEnter") {
      const auto* timeout = message.elements_of(entry).find("timeout");
      session.enter_monitor(path, std::chrono::milliseconds(load<std::int32_t>(timeout->data.data())), now_);
    }
  }

  Transcript transcript_;
  TypeRegistry types_;
  std::map<int, Client> clients_;
  TimePoint start_ = TimePoint{} + std::chrono::hours(1);
  Now now_{start_, {1'700'000'000, 0}};
};

/// Their requests were made by a test program, many of them wrong on purpose: no client of ours sends them.
bool is_of_a_client(const std::string& name) {
  return !name.ends_with("node-requests") && !name.ends_with("session-errors");
}

}  // namespace

TEST_CASE("our client asks as the recorded one did") {
  for (const auto& name : transcript_names()) {
    if (!is_of_a_client(name)) continue;
    DYNAMIC_SECTION(name) {
      ClientReplay(read_transcript(name)).play();
    }
  }
}

}  // namespace rr::test
