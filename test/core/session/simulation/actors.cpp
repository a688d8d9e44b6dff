// What clients and the service of a simulation do.
#include <algorithm>
#include <utility>

#include "test/core/session/simulation/simulated_values.hpp"
#include "test/core/session/simulation/simulation.hpp"

namespace rr::test {

using std::chrono::milliseconds;

void Simulation::add_link() {
  auto link = std::make_unique<Link>();
  link->number = ++last_link_;
  link->up.capacity = dice_.one_in(3) ? 100 + dice_.below(400) : 100'000;
  link->down.capacity = dice_.one_in(3) ? 100 + dice_.below(400) : 100'000;
  ClientOptions options;
  options.connection.self = {NodeId{{0xaa, static_cast<std::uint8_t>(link->number)}}, "test.client"};
  options.connection.features = client_features_;
  options.service = "arm";
  options.username = "user" + std::to_string(link->number);
  options.credentials = Value(MapString{});
  options.max_memory_transfer = 2000;
  link->client = std::make_unique<ClientSession>(options, now_);
  ServiceSessionOptions service;
  service.connection.features = service_features_;
  service.max_open_calls = max_open_calls_;
  link->service = std::make_unique<ServiceSession>(*directory_, service, now_);
  links_.push_back(std::move(link));
}

void Simulation::act(Link& link) {
  if (link.client->state() != ClientState::connected) return;
  if (dice_.one_in(400)) return link.client->disconnect(now_);
  using Act = void (Simulation::*)(Link&);
  static constexpr Act acts[] = {&Simulation::call,       &Simulation::call,          &Simulation::use_pipe,
                                 &Simulation::use_pipe,   &Simulation::use_wire,      &Simulation::use_wire,
                                 &Simulation::use_memory, &Simulation::use_generator, &Simulation::use_lock,
                                 &Simulation::use_object, &Simulation::use_monitor,   &Simulation::answer_question};
  (this->*acts[dice_.below(std::size(acts))])(link);
}

void Simulation::act_as_service(Link& link) {
  if (!link.has_client || link.is_gone) return;
  if (dice_.one_in(400)) return link.service->close_service(now_);
  switch (dice_.below(4)) {
    case 0:
      return use_service_pipe(link);
    case 1:
      if (dice_.one_in(4)) return tell_all();
      if (dice_.one_in(6)) {
        tell(link, "service closes the wire");
        link.in_sent = link.out_value = 0;
        return link.service->close_wire("arm", *arm_->root_type().find_member("torque"), now_);
      }
      if (const auto number = ++last_number_;
          const auto id = link.service->call_callback("arm", *arm_->root_type().find_member("ask"),
                                                      std::vector<Value>{Value(number)}, now_))
        link.callbacks.emplace(*id, number);
      return;
    default:
      return answer_one(link);
  }
}

void Simulation::request(Link& link, const std::string& what, RequestId id, Done done) {
  tell(link, what + " #" + std::to_string(id));
  demand(link.requests.emplace(id, Request{what, std::move(done)}).second, &link, "a request id is given twice");
}

void Simulation::call(Link& link) {
  const auto number = ++last_number_;
  const std::vector<Value> arguments{Value(number), Value(1.0)};
  const auto id = link.client->call_function("arm", "add", arguments, now_);
  if (dice_.one_in(12)) return link.client->cancel(id);
  request(link, "call", id, [this, &link, number](const Result<Value>& result) {
    const auto runs = executed_.find(number);
    if (!result) return count(Deed::error);
    demand(runs != executed_.end(), &link, "a call was answered that never ran");
    demand(number_of(*result) == number + 1, &link, "a call was given the answer of another");
    count(Deed::call);
  });
}

void Simulation::use_pipe(Link& link) {
  if (link.pipes.empty() || dice_.one_in(6)) {
    const std::string member = dice_.one_in(2) ? "samples" : "quick";
    const auto index = dice_.one_in(2) ? any_pipe_index : static_cast<std::int32_t>(dice_.below(4));
    const auto id = link.client->connect_pipe("arm", member, index, now_);
    if (dice_.one_in(8)) return link.client->cancel(id);
    return request(link, "connect pipe " + member + " " + std::to_string(index), id,
                   [this, &link, member](const Result<Value>& result) {
                     if (!result) return;
                     link.pipes[{member, result->to<std::int32_t>().value()}] = ClientPipe{.stream = ++last_number_};
                   });
  }
  const auto chosen = std::next(link.pipes.begin(), static_cast<std::ptrdiff_t>(dice_.below(link.pipes.size())));
  const auto& [member, index] = chosen->first;
  auto& pipe = chosen->second;
  if (pipe.is_closing) return;
  if (dice_.one_in(12)) {
    pipe.is_closing = true;
    const auto stream = pipe.stream;
    const auto key = chosen->first;
    return request(link, "disconnect pipe", link.client->disconnect_pipe("arm", member, index, now_),
                   [this, &link, key, stream](const Result<Value>& result) {
                     demand(result || result.error().code != ErrorCode::invalid_argument, &link, text_of(result));
                     const auto ended = link.pipes.find(key);
                     if (ended != link.pipes.end() && ended->second.stream == stream) link.pipes.erase(ended);
                   });
  }
  if (dice_.one_in(10)) return link.client->hold_pipe_acks("arm", member, index, dice_.one_in(2), now_);
  for (auto left = 1 + dice_.below(3); left > 0; --left) {
    const bool wants_ack = dice_.one_in(3);
    const Value value(pipe.stream * 1000 + pipe.sent + 1);
    const auto number = link.client->send_pipe_packet("arm", member, index, value, now_, wants_ack);
    if (!number) return demand(link.client->state() != ClientState::connected, &link, number.error().message);
    sent_on_[pipe.stream] = ++pipe.sent;
    if (wants_ack) pipe.unacknowledged.insert(*number);
  }
}

void Simulation::use_wire(Link& link) {
  if (link.has_wire && !dice_.one_in(6)) {
    const auto value = ++last_number_;
    if (link.client->send_wire("arm", "torque", Value(value), now_)) link.out_sent = value;
    return;
  }
  if (link.wants_wire) {
    link.wants_wire = link.has_wire = false;
    link.wire_request = 0;
    link.in_value = link.out_sent = 0;
    request(link, "disconnect wire", link.client->disconnect_wire("arm", "torque", now_), [](const Result<Value>&) {});
    if (dice_.one_in(2)) return;
  }
  link.wants_wire = true;
  const auto id = link.client->connect_wire("arm", "torque", now_);
  link.wire_request = id;
  request(link, "connect wire", id, [this, &link, id](const Result<Value>& result) {
    if (id != link.wire_request) return;  // disconnected meanwhile
    link.has_wire = link.wants_wire = result.has_value();
    demand(result || is_loss(result.error()) || result.error().code == ErrorCode::object_locked_error ||
               result.error().code == ErrorCode::invalid_operation,
           &link, text_of(result));
  });
}

void Simulation::use_generator(Link& link) {
  if (link.generators.empty() || dice_.one_in(5)) {
    return request(link, "open generator", link.client->open_generator("arm", "count", {}, now_),
                   [&link](const Result<Value>& result) {
                     if (result) link.generators[result->to<std::int32_t>().value()] = {};
                   });
  }
  const auto chosen =
      std::next(link.generators.begin(), static_cast<std::ptrdiff_t>(dice_.below(link.generators.size())));
  const auto index = chosen->first;
  auto& running = chosen->second;
  if (running.is_ending) return;
  if (dice_.one_in(8)) {
    running.is_ending = true;
    const auto id = dice_.one_in(2) ? link.client->close_generator("arm", "count", index, now_)
                                    : link.client->abort_generator("arm", "count", index, now_);
    return request(link, "end generator", id, [&link, index](const Result<Value>&) { link.generators.erase(index); });
  }
  const auto which = ++running.asked;
  request(link, "next of generator", link.client->next_generator("arm", "count", index, std::nullopt, now_),
          [this, &link, index, which](const Result<Value>& result) {
            if (!result) {
              if (result.error().code != ErrorCode::object_locked_error &&
                  result.error().code != ErrorCode::invalid_operation)
                link.generators.erase(index);
              else if (const auto found = link.generators.find(index); found != link.generators.end())
                found->second.is_ending = true;  // the count is not known any more
              return;
            }
            count(Deed::generator);
            demand(number_of(*result) <= which, &link, "a generator gave a value twice");
          });
}

void Simulation::use_memory(Link& link) {
  const auto from = dice_.below(memory_items);
  const auto size = dice_.below(std::min<std::size_t>(memory_items - from, 1000) + 1);
  const MemoryShape position{from}, sizes{size};
  if (dice_.one_in(2))
    return request(link, "write memory",
                   link.client->write_memory("arm", "data", position, Value(items(from, size)), now_),
                   [](const Result<Value>&) {});
  request(link, "read memory", link.client->read_memory("arm", "data", position, sizes, now_),
          [this, &link, from, size](const Result<Value>& result) {
            if (!result) return;
            count(Deed::memory);
            demand(*result == Value(items(from, size)), &link, "a memory gave other items");
          });
}

void Simulation::use_lock(Link& link) {
  const std::string path = dice_.one_in(2) ? "arm" : "arm.tools[a]";
  if (dice_.one_in(2)) {
    ++link.unlocks;
    give_up(locks_, link, path);
    return request(link, "unlock", link.client->unlock(path, now_), [](const Result<Value>&) {});
  }
  const auto kind = dice_.one_in(2) ? LockKind::user : LockKind::client;
  request(link, "lock", link.client->lock(path, kind, now_),
          [this, &link, path, before = link.unlocks](const Result<Value>& result) {
            if (!result || link.is_gone || link.unlocks != before) return;
            count(Deed::lock);
            check_lock(locks_, link, path, true);
            locks_.push_back({&link, path, TimePoint::max()});
          });
}

void Simulation::use_monitor(Link& link) {
  const auto leave = [this, &link] {
    ++link.exits;
    give_up(monitors_, link, "arm");
    request(link, "exit monitor", link.client->exit_monitor("arm", now_), [](const Result<Value>&) {});
  };
  if (dice_.one_in(2)) return leave();
  const auto timeout = dice_.one_in(3) ? milliseconds(-1) : milliseconds(dice_.below(3000));
  // An owner that does nothing for 30 s has lost it.
  const auto until = now_.steady + std::chrono::seconds(30);
  request(link, "enter monitor", link.client->enter_monitor("arm", timeout, now_),
          [this, &link, leave, until, before = link.exits](const Result<Value>& result) {
            if (!result || link.is_gone || link.exits != before) return;
            count(Deed::monitor);
            check_lock(monitors_, link, "arm", false);
            monitors_.push_back({&link, "arm", until});
            if (is_settling_) leave();
          });
}

void Simulation::use_object(Link& link) {
  const std::string path = dice_.one_in(2) ? "arm.tools[a]" : "arm.tools[b]";
  if (!link.objects.contains(path))
    return request(link, "find object", link.client->find_object(path, now_),
                   [this, &link, path](const Result<Value>& result) {
                     if (!result) return;
                     demand(*result == Value(tool_type), &link, "an object of another type");
                     if (link.client->object_type(path)) link.objects.insert(path);
                   });
  request(link, "get property", link.client->get_property(path, "name", now_),
          [this, &link, path](const Result<Value>& result) {
            if (!result) return;
            count(Deed::object);
            demand(*result == Value(path), &link, "the property of another object");
          });
}

void Simulation::answer_question(Link& link) {
  if (link.questions.empty()) return;
  const auto chosen = link.questions.begin() + static_cast<std::ptrdiff_t>(dice_.below(link.questions.size()));
  const auto [id, number] = *chosen;
  link.questions.erase(chosen);
  link.client->reply_callback(id, Value(number + 2), now_);
}

void Simulation::use_service_pipe(Link& link) {
  if (link.service_pipes.empty()) return;
  const auto chosen =
      std::next(link.service_pipes.begin(), static_cast<std::ptrdiff_t>(dice_.below(link.service_pipes.size())));
  const auto id = chosen->first;
  auto& pipe = chosen->second;
  if (!pipe.is_accepted) {
    pipe.is_accepted = true;
    if (dice_.one_in(6)) {
      link.service->refuse_pipe(id, make_error(ErrorCode::operation_failed, "not now"), now_);
      link.service_pipes.erase(chosen);
    } else if (dice_.one_in(2)) {
      link.service->accept_pipe(id, now_);  // otherwise the first packet lets the client in
    }
    return;
  }
  if (dice_.one_in(15)) {
    tell(link, "service closes pipe " + pipe.member + " " + std::to_string(pipe.index));
    link.service->close_pipe(id, now_);
    link.service_pipes.erase(chosen);
    return;
  }
  for (auto left = 1 + dice_.below(3); left > 0; --left) {
    const bool wants_ack = dice_.one_in(3);
    const auto number = link.service->send_pipe_packet(id, Value(pipe.stream * 1000 + pipe.sent + 1), now_, wants_ack);
    if (!number) return demand(link.service->wants_close(), &link, number.error().message);
    sent_on_[pipe.stream] = ++pipe.sent;
    if (wants_ack) pipe.unacknowledged.insert(*number);
  }
}

/// An event and a value of the wire, each encoded once for all clients.
void Simulation::tell_all() {
  const auto value = Value(++last_number_);
  EventPacket event("arm", *arm_->root_type().find_member("bumped"), std::span(&value, 1));
  WirePacket packet("arm", *arm_->root_type().find_member("torque"), value, now_.utc, now_.steady);
  for (auto& link : links_) {
    if (!link->has_client || link->is_gone) continue;
    if (link->service->send_event(event, now_)) link->told.push_back(last_number_);
    const bool has_wire = link->service->has_wire("arm", "torque");
    if (link->service->send_wire(packet, now_) && has_wire) link->in_sent = last_number_;
  }
}

void Simulation::answer_one(Link& link) {
  if (link.calls.empty()) return;
  const auto chosen = link.calls.begin() + static_cast<std::ptrdiff_t>(dice_.below(link.calls.size()));
  const auto call = std::move(*chosen);
  link.calls.erase(chosen);
  link.service->reply(call.id, call.result, now_);
}

}  // namespace rr::test
