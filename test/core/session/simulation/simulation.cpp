#include "test/core/session/simulation/simulation.hpp"

#include <algorithm>
#include <utility>

#include "test/core/session/simulation/simulated_values.hpp"

namespace rr::test {

namespace {

using std::chrono::milliseconds;

constexpr NodeId service_id{{0x11, 0x11, 0x11, 0x11, 2}};
constexpr int steps = 1000;
constexpr int most_links = 8;

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

}  // namespace rr::test
