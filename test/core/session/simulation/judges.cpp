// What is judged of what both sides of a simulation say.
#include <algorithm>
#include <iostream>
#include <utility>

#include "core/session/service_path.hpp"
#include "test/core/session/simulation/simulated_values.hpp"
#include "test/core/session/simulation/simulation.hpp"

namespace rr::test {

using std::chrono::milliseconds;

void Simulation::demand(bool is_so, const Link* link, const std::string& what) const {
  if (!is_so)
    throw Broken("seed " + std::to_string(seed_) + ", step " + std::to_string(step_) +
                 (link ? ", connection " + std::to_string(link->number) : "") + ": " + what);
}

void Simulation::tell(const Link& link, const std::string& what) const {
  if (is_loud_)
    std::cerr << std::chrono::duration_cast<milliseconds>(now_.steady - TimePoint{}).count() << " step " << step_
              << ", connection " << link.number << ": " << what << "\n";
}

void Simulation::note(std::uint64_t what) {
  trace_ = (trace_ ^ what) * 1099511628211u;
}

void Simulation::poll(Link& link) {
  while (auto event = link.service->poll_event()) {
    demand(!link.is_gone, &link, "an event behind the last one");
    note(event->index() + 100);
    handle(link, *event);
  }
  while (auto event = link.client->poll_event()) {
    demand(!link.is_closed, &link, "an event behind the last one");
    note(event->index());
    handle(link, *event);
  }
}

void Simulation::handle(Link& link, ClientEvent& event) {
  if (std::holds_alternative<Connected>(event)) {
    demand(!link.is_connected, &link, "connected twice");
    count(Deed::session);
    link.is_connected = true;
    link.events_before = link.told.size();
  } else if (auto* completed = std::get_if<Completed>(&event)) {
    auto request = link.requests.extract(completed->id);
    demand(!request.empty(), &link, "a request ended that nobody waits for: " + text_of(completed->result));
    tell(link, request.mapped().what + " #" + std::to_string(completed->id) + ": " + text_of(completed->result));
    request.mapped().done(completed->result);
  } else if (auto* told = std::get_if<EventReceived>(&event)) {
    const auto number = number_of(told->arguments.at(0));
    while (link.events < link.events_before && link.told[link.events] != number) ++link.events;
    demand(link.events < link.told.size() && link.told[link.events++] == number, &link,
           "an event was lost, came twice or out of order");
    count(Deed::event);
  } else if (auto* value = std::get_if<WireValueReceived>(&event)) {
    demand(link.has_wire, &link, "a value of a wire that is not connected");
    demand(number_of(value->value) > link.in_value, &link, "a wire went back to an older value");
    link.in_value = number_of(value->value);
    count(Deed::wire);
  } else if (std::holds_alternative<WireClosedByService>(event)) {
    tell(link, "the service closed the wire");
    link.wants_wire = link.has_wire = false;
    link.wire_request = 0;
    link.in_value = link.out_sent = 0;
  } else if (auto* packet = std::get_if<PipePacketReceived>(&event)) {
    take_packet(link, *packet);
  } else if (auto* arrived = std::get_if<PipePacketsAcknowledged>(&event)) {
    const auto pipe = link.pipes.find({arrived->member, arrived->index});
    demand(pipe != link.pipes.end(), &link, "an acknowledgement for an endpoint that is closed");
    for (const auto number : arrived->numbers)
      demand(pipe->second.unacknowledged.erase(number) == 1, &link, "a packet was acknowledged twice");
    count(Deed::ack);
  } else if (auto* closed = std::get_if<PipeClosedByService>(&event)) {
    tell(link, "pipe closed by the service: " + closed->member + " " + std::to_string(closed->index));
    const auto pipe = link.pipes.extract({closed->member, closed->index});
    demand(!pipe.empty() && !pipe.mapped().is_closing, &link, "an endpoint was closed that is not open");
    demand(pipe.mapped().peer == 0 || pipe.mapped().received == sent_on_[pipe.mapped().peer], &link,
           "packets were lost when the service closed the endpoint");
  } else if (auto* asked = std::get_if<CallbackCalled>(&event)) {
    const auto number = number_of(asked->arguments.at(0));
    demand(link.asked.insert(number).second, &link, "a callback ran twice");
    link.questions.emplace_back(asked->id, number);
  } else if (std::holds_alternative<PathReleased>(event)) {
    demand(false, &link, "nobody released a path");
  } else if (std::holds_alternative<SessionClosed>(event)) {
    demand(link.requests.empty(), &link, "a request outlives its session");
    link.is_closed = true;
    link.pipes.clear();
    link.questions.clear();
  }
}

void Simulation::handle(Link& link, ServiceEvent& event) {
  if (std::holds_alternative<ClientConnected>(event)) {
    link.has_client = true;
  } else if (auto* login = std::get_if<LoginRequested>(&event)) {
    link.service->answer_login(login->id, AuthenticatedUser{login->attempt.username, {"objectlock"}}, now_);
  } else if (auto* called = std::get_if<Called>(&event)) {
    handle_call(link, *called);
  } else if (std::holds_alternative<LocksChanged>(event)) {
    for (auto& each : links_) each->service->handle_locks_changed(now_);
  } else if (std::holds_alternative<WireConnected>(event) || std::holds_alternative<WireDisconnected>(event)) {
    tell(link, "service: wire connected or disconnected");
    link.in_sent = link.out_value = 0;
  } else if (auto* value = std::get_if<WireReceived>(&event)) {
    demand(number_of(value->value) > link.out_value, &link, "a wire went back to an older value");
    link.out_value = number_of(value->value);
    count(Deed::out_wire);
  } else if (auto* wanted = std::get_if<PipeConnected>(&event)) {
    tell(link, "service: pipe connected " + wanted->member->name + " " + std::to_string(wanted->index));
    link.service_pipes.emplace(
        wanted->id, ServicePipe{.member = wanted->member->name, .index = wanted->index, .stream = ++last_number_});
  } else if (auto* packet = std::get_if<PipeReceived>(&event)) {
    take_packet(link, *packet);
  } else if (auto* arrived = std::get_if<PipeAcknowledged>(&event)) {
    const auto pipe = link.service_pipes.find(arrived->id);
    demand(pipe != link.service_pipes.end(), &link, "an acknowledgement for an endpoint that is closed");
    for (const auto number : arrived->numbers)
      demand(pipe->second.unacknowledged.erase(number) == 1, &link, "a packet was acknowledged twice");
    count(Deed::ack);
  } else if (auto* closed = std::get_if<PipeClosed>(&event)) {
    tell(link, "service: pipe closed by the client");
    const auto pipe = link.service_pipes.extract(closed->id);
    demand(!pipe.empty(), &link, "an endpoint was closed that is not open");
    demand(pipe.mapped().peer == 0 || pipe.mapped().received == sent_on_[pipe.mapped().peer], &link,
           "packets were lost when the client closed the endpoint");
  } else if (auto* ended = std::get_if<GeneratorEnded>(&event)) {
    demand(link.service_generators.erase(ended->id) == 1, &link, "a generator ended that does not run");
  } else if (auto* done = std::get_if<CallbackCompleted>(&event)) {
    const auto callback = link.callbacks.extract(done->id);
    demand(!callback.empty(), &link, "a callback ended that nobody waits for");
    if (!done->result) return;
    demand(number_of(*done->result) == callback.mapped() + 2, &link, "a callback was given the answer of another");
    count(Deed::callback);
  } else if (std::holds_alternative<ClientGone>(event)) {
    demand(link.callbacks.empty(), &link, "a callback outlives its session");
    link.is_gone = true;
    link.calls.clear();
    link.service_pipes.clear();
    give_up(locks_, link, "");
    give_up(monitors_, link, "");
  }
}

/// What the application does; its answer is kept for a while.
void Simulation::handle_call(Link& link, Called& called) {
  const auto is_arm = called.object->type_name() == arm_type;
  if (is_arm) check_lock(monitors_, link, "arm", false);
  if (is_arm) check_lock(locks_, link, "arm", false);
  Result<Value> result = Value{};
  switch (called.kind) {
    case CallKind::function: {
      const auto number = number_of(called.arguments.at(0));
      demand(++executed_[number] == 1, &link, "a call ran twice");
      result = Value(number + number_of(called.arguments.at(1)));
      break;
    }
    case CallKind::property_get:
      for (const auto& path : arm_->paths_of(*called.object)) {
        check_lock(locks_, link, path, false);
        result = Value(path);
      }
      break;
    case CallKind::generator_open:
      link.service_generators[called.generator] = {};
      break;
    case CallKind::generator_next: {
      auto& generator = link.service_generators[called.generator];
      if (++generator.given > last_of_generator)
        result = make_error(ErrorCode::stop_iteration, "");
      else
        result = Value(static_cast<double>(generator.given));
      break;
    }
    case CallKind::generator_close:
    case CallKind::generator_abort:
      demand(!std::exchange(link.service_generators[called.generator].is_over, true), &link, "a generator ended twice");
      break;
    case CallKind::memory_dimensions:
      result = Value(MemoryShape{memory_items});
      break;
    case CallKind::memory_read:
      result = Value(items(called.range.position.at(0), called.range.count.at(0)));
      break;
    case CallKind::memory_write:
      demand(called.arguments.at(0) == Value(items(called.range.position.at(0), called.range.count.at(0))), &link,
             "other items were written than were sent");
      break;
    default:
      demand(false, &link, "a call that nobody made");
  }
  link.calls.push_back({called.id, std::move(result)});
}

template <class Pipe>
std::string Simulation::judge_packet(Pipe& pipe, double number) {
  const auto stream = static_cast<double>(static_cast<std::int64_t>(number) / 1000);
  if (pipe.peer == 0) pipe.peer = stream;
  if (pipe.peer != stream) return "a packet of another endpoint";
  if (number != stream * 1000 + ++pipe.received)
    return "packet " + std::to_string(static_cast<int>(number - stream * 1000)) + " came as number " +
           std::to_string(pipe.received);
  count(Deed::packet);
  return {};
}

void Simulation::take_packet(Link& link, const PipePacketReceived& packet) {
  const auto pipe = link.pipes.find({packet.member, packet.index});
  demand(pipe != link.pipes.end() && !pipe->second.is_closing, &link, "a packet for an endpoint that is closed");
  const auto fault = judge_packet(pipe->second, number_of(packet.value));
  demand(fault.empty(), &link, fault);
}

void Simulation::take_packet(Link& link, const PipeReceived& packet) {
  const auto pipe = link.service_pipes.find(packet.id);
  demand(pipe != link.service_pipes.end(), &link, "a packet for an endpoint that is closed");
  const auto fault = judge_packet(pipe->second, number_of(packet.value));
  demand(fault.empty(), &link, fault);
}

/// Nobody else may hold what covers `path` (or, for a new lock, what lies below it).
void Simulation::check_lock(std::vector<Held>& held, const Link& link, std::string_view path, bool is_below_included) {
  for (const auto& each : held) {
    if (each.link == &link || now_.steady >= each.until) continue;
    const bool overlaps = is_within(path, each.path) || (is_below_included && is_within(each.path, path));
    demand(
        !overlaps, &link,
        std::string(path) + " is used while connection " + std::to_string(each.link->number) + " holds " + each.path);
  }
}

void Simulation::give_up(std::vector<Held>& held, const Link& link, std::string_view path) {
  std::erase_if(held, [&](const Held& each) { return each.link == &link && (path.empty() || each.path == path); });
}

/// What both sides know must agree once nothing is on the way any more.
void Simulation::check_rest(const Link& link) {
  if (link.is_closed || link.is_gone) return;
  demand(link.client->pending_requests() == 0, &link, "the client waits for an answer");
  demand(link.client->queued_bytes() == 0 && link.service->held_bytes() == 0, &link, "bytes are left");
  demand(std::max(link.events, link.events_before) == link.told.size(), &link, "the last event was lost");
  demand(link.has_wire == link.service->has_wire("arm", "torque"), &link, "a wire is connected on one side alone");
  if (link.has_wire) {
    // A value of the connection before may still have come, where the service told this one none.
    demand(link.in_value == link.in_sent || link.in_sent == 0, &link,
           "the client has " + std::to_string(link.in_value) + " of the wire, and not " + std::to_string(link.in_sent));
    demand(link.out_value == link.out_sent, &link, "the service has not the last value of the wire");
  }
  demand(link.pipes.size() == link.service_pipes.size(), &link, "a pipe endpoint is open on one side alone");
  for (const auto& [id, pipe] : link.service_pipes) {
    const auto other = link.pipes.find({pipe.member, pipe.index});
    demand(other != link.pipes.end(), &link, "a pipe endpoint is open at the service alone");
    demand(other->second.received == pipe.sent && pipe.received == other->second.sent, &link, "packets were lost");
    demand(other->second.unacknowledged.empty() && pipe.unacknowledged.empty(), &link, "packets were not acknowledged");
  }
}

}  // namespace rr::test
