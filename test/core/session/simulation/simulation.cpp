#include "test/core/session/simulation/simulation.hpp"

#include <algorithm>
#include <iostream>
#include <utility>

#include "core/session/service_path.hpp"

namespace rr::test {

namespace {

using std::chrono::milliseconds;

constexpr NodeId service_id{{0x11, 0x11, 0x11, 0x11, 2}};
constexpr std::string_view arm_type = "experimental.simulation.Arm";
constexpr std::string_view tool_type = "experimental.simulation.Tool";
constexpr int steps = 1000;
constexpr int most_links = 8;
constexpr std::size_t memory_items = 3000;
constexpr int last_of_generator = 6;

const std::string definition = R"(service experimental.simulation
stdver 0.10

object Tool
  property string name
end

object Arm
  function double add(double left, double right)
  function double{generator} count()
  event bumped(double number)
  objref Tool{string} tools
  wire double torque
  pipe double samples
  pipe double quick [unreliable]
  memory double[] data
  callback double ask(double number)
end
)";

class NobodysAuthenticator final : public Authenticator {
 public:
  Result<AuthenticatedUser> authenticate(const LoginAttempt&) const override {
    return make_error(ErrorCode::internal_error, "not to be asked");
  }
};

Features random_features(Dice& dice) {
  Features features;
  if (dice.one_in(4)) features.v4 = false;
  if (dice.one_in(4)) features.combined_v2 = features.combined_v4 = false;
  if (dice.one_in(3)) features.string_table = {.local = false, .standard = false};
  return features;
}

/// Item `i` of the memory is `i`.
std::vector<double> items(std::uint64_t from, std::uint64_t count) {
  std::vector<double> numbers(count);
  for (std::size_t i = 0; i < count; ++i) numbers[i] = static_cast<double>(from + i);
  return numbers;
}

std::string text_of(const Result<Value>& result) {
  return result ? "a value" : result.error().message;
}

double number_of(const Value& value) {
  return value.to<double>().value();
}

/// Errors that a broken or closing connection explains.
bool is_loss(const Error& error) {
  return error.code == ErrorCode::connection_error || error.code == ErrorCode::request_timeout;
}

}  // namespace

std::uint64_t Dice::next() {
  auto word = state_ += 0x9e3779b97f4a7c15u;
  word = (word ^ (word >> 30)) * 0xbf58476d1ce4e5b9u;
  word = (word ^ (word >> 27)) * 0x94d049bb133111ebu;
  return word ^ (word >> 31);
}

class Simulation::Object final : public ServiceObject {
 public:
  explicit Object(std::string_view type) : type_(type) {}
  const std::string& type_name() const override { return type_; }
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition&,
                                                    const std::optional<std::string>&) override {
    return std::shared_ptr<ServiceObject>(std::make_shared<Object>(tool_type));
  }
  bool is_monitor_lockable() const override { return true; }

 private:
  std::string type_;
};

Simulation::Simulation(std::uint64_t seed, bool is_loud)
    : seed_(seed),
      is_loud_(is_loud),
      dice_(seed),
      max_open_calls_(dice_.one_in(3) ? 2 : 1024),
      client_features_(random_features(dice_)),
      service_features_(random_features(dice_)) {
  static const auto types = [] {
    auto made = std::make_shared<TypeRegistry>();
    made->add({definition}, RobdefMode::strict).value();
    return made;
  }();
  arm_ = HostedService::make("arm", std::make_shared<Object>(arm_type), types).value();
  arm_->set_policy({.authenticator = std::make_shared<NobodysAuthenticator>(), .allow_object_lock = true});
  directory_ = std::make_unique<ServiceDirectory>(NodeIdentity{service_id, "test.service"});
  directory_->add(arm_).value();
}

Simulation::~Simulation() = default;

void Simulation::run() {
  const auto clients = 1 + dice_.below(3);
  for (std::size_t i = 0; i < clients; ++i) add_link();
  for (; step_ < steps; ++step_) {
    auto& link = *links_[dice_.below(links_.size())];
    switch (dice_.below(12)) {
      case 0:
      case 1:
        act(link);
        break;
      case 2:
      case 3:
        act_as_service(link);
        break;
      case 4:
        pass_time(milliseconds(dice_.one_in(100) ? 1000 + dice_.below(20'000) : dice_.below(30)));
        break;
      case 5:
        if (dice_.one_in(40)) cut(link);
        if (dice_.one_in(6)) tell_all();
        break;
      default:
        carry(link, false);
    }
    for (auto& each : links_) {
      hear_of_cut(*each, false);
      poll(*each);
    }
    // Who has lost his session comes again.
    std::size_t alive = 0;
    for (const auto& each : links_) alive += each->is_closed && each->is_gone ? 0 : 1;
    if (alive < clients && last_link_ < most_links && dice_.one_in(4)) add_link();
  }
  settle();
  for (const auto& link : links_) check_rest(*link);
  end_all();
}

// --- actors ---

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

// --- network and time ---

void Simulation::carry(Link& link, bool is_all) {
  if (link.is_cut) return;
  const bool is_up = is_all || dice_.one_in(2);
  if (is_up) carry(link, *link.client, *link.service, link.up, is_all);
  if (!is_up || is_all) carry(link, *link.service, *link.client, link.down, is_all);
}

template <class From, class To>
bool Simulation::carry(Link& link, From& from, To& to, Lane& lane, bool is_all) {
  bool is_busy = false;
  std::size_t taken = 0;
  const auto room = lane.capacity - std::min(lane.capacity, lane.bytes.size());
  for (const auto slice : from.poll_transmit()) {
    const auto size = std::min(slice.size(), room - taken);
    lane.bytes.insert(lane.bytes.end(), slice.begin(), slice.begin() + static_cast<std::ptrdiff_t>(size));
    taken += size;
  }
  if (taken > 0) {
    if (lane.bytes.size() == taken && dice_.one_in(4)) lane.not_before = now_.steady + milliseconds(dice_.below(60));
    from.handle_transmitted(taken, now_);
    is_busy = true;
  }
  if (!lane.bytes.empty() && (is_all || now_.steady >= lane.not_before)) {
    const auto size = is_all || dice_.one_in(2) ? lane.bytes.size() : 1 + dice_.below(lane.bytes.size());
    const auto consumed = to.handle_bytes(ByteSpan(lane.bytes).first(size), now_);
    demand(consumed <= size, &link, "more was consumed than there was");
    lane.bytes.erase(lane.bytes.begin(), lane.bytes.begin() + static_cast<std::ptrdiff_t>(consumed));
    note(consumed);
    is_busy = is_busy || consumed > 0;
  }
  // Who has closed has nothing more to say: the other side hears of it behind the last byte.
  if (from.wants_close() && from.poll_transmit().empty() && lane.bytes.empty() && !to.wants_close()) {
    to.handle_closed({ErrorCode::connection_error, "closed by the other side"}, now_);
    is_busy = true;
  }
  return is_busy;
}

void Simulation::cut(Link& link) {
  if (link.is_cut || link.is_closed || link.is_gone) return;
  count(Deed::cut);
  link.is_cut = true;
  link.up.bytes.clear();
  link.down.bytes.clear();
}

/// Each side hears of a broken connection some time, or finds out by itself.
void Simulation::hear_of_cut(Link& link, bool is_all) {
  if (!link.is_cut) return;
  const Error reason{ErrorCode::connection_error, "connection reset"};
  if (!link.is_closed && (is_all || dice_.one_in(20))) link.client->handle_closed(reason, now_);
  if (!link.is_gone && (is_all || dice_.one_in(20))) link.service->handle_closed(reason, now_);
}

void Simulation::pass_time(milliseconds time) {
  now_.steady += time;
  now_.utc.seconds += time.count() / 1000;
  now_.utc.nanoseconds += static_cast<std::int32_t>(time.count() % 1000) * 1'000'000;
  // The clock of the day is set forth now and then, and back.
  if (dice_.one_in(50)) now_.utc.seconds += static_cast<std::int64_t>(dice_.below(7200)) - 3600;
  now_.utc = now_.utc.normalized();
  for (auto& link : links_) fire_timers(*link);
}

void Simulation::fire_timers(Link& link) {
  if (link.client->poll_timeout() <= now_.steady) {
    link.client->handle_timeout(now_);
    demand(link.client->poll_timeout() > now_.steady, &link, "the client's timer fires for ever");
  }
  if (link.service->poll_timeout() <= now_.steady) {
    link.service->handle_timeout(now_);
    poll(link);
    demand(link.service->poll_timeout() > now_.steady, &link, "the service's timer fires for ever");
  }
}

/// Everything that can happen without time passing. Returns whether anything did.
bool Simulation::settle_step() {
  bool is_busy = false;
  for (auto& each : links_) {
    auto& link = *each;
    const auto before = trace_;
    hear_of_cut(link, true);
    carry(link, true);
    poll(link);
    while (!link.calls.empty()) answer_one(link);
    while (!link.questions.empty()) answer_question(link);
    for (auto& [id, pipe] : link.service_pipes) link.service->accept_pipe(id, now_);
    for (auto& [key, pipe] : link.pipes) link.client->hold_pipe_acks("arm", key.first, key.second, false, now_);
    poll(link);
    const auto has_more = [](auto& session) { return !session.poll_transmit().empty() && !session.wants_close(); };
    is_busy = is_busy || trace_ != before || (!link.is_cut && (has_more(*link.client) || has_more(*link.service)));
  }
  return is_busy;
}

/// The application rests, the network carries all: everything that was begun has to end.
void Simulation::settle() {
  is_settling_ = true;
  for (auto& link : links_) {
    if (!link->is_connected || link->is_closed) continue;
    ++link->exits;
    give_up(monitors_, *link, "arm");
    request(*link, "exit monitor", link->client->exit_monitor("arm", now_), [](const Result<Value>&) {});
  }
  for (int rounds = 0; rounds < 300; ++rounds) {
    for (int i = 0; settle_step(); ++i) demand(i < 2000, nullptr, "both sides talk for ever");
    bool is_done = true;
    for (const auto& link : links_)
      is_done = is_done && (link->requests.empty() && link->callbacks.empty() &&
                            (link->is_closed ? link->is_gone : link->is_connected));
    if (is_done) return;
    // No further than to the next timer: nobody is to fall silent.
    pass_time(milliseconds(500));
  }
  for (const auto& link : links_) {
    demand(link->requests.empty(), link.get(), std::to_string(link->requests.size()) + " requests never ended");
    demand(link->callbacks.empty(), link.get(), "a callback never ended");
    demand(link->is_closed == link->is_gone, link.get(), "one side has closed and the other does not hear of it");
  }
  demand(false, nullptr, "no rest");
}

/// Every client goes, one way or another.
void Simulation::end_all() {
  for (auto& link : links_) {
    if (dice_.one_in(2))
      link->client->disconnect(now_);
    else
      cut(*link);
  }
  for (int i = 0; i < 20; ++i) {
    while (settle_step()) {
    }
    pass_time(milliseconds(200));
  }
  for (const auto& link : links_) {
    demand(link->is_closed && link->is_gone, link.get(), "a session does not end");
    demand(link->requests.empty() && link->callbacks.empty(), link.get(), "something outlives its session");
  }
  demand(arm_->object_locks().empty(), nullptr, "a lock outlives its session");
  demand(!arm_->monitor_locks().has_waiting(), nullptr, "a wait for a monitor outlives its session");
}

// --- judges ---

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
