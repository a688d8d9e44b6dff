// Several clients of one service over a simulated network, in simulated time: one seed, one course of events. The
// network splits and delays what it carries, is slow to take it, and breaks connections; clocks jump. Everything that
// both sides say is judged while it happens, and once more when everything has come to rest.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/client/client_session.hpp"
#include "core/session/service/service_session.hpp"

namespace rr::test {

/// What must never happen has happened.
struct Broken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The same numbers for the same seed with every compiler (splitmix64).
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  /// From 0 to `n` - 1.
  std::size_t below(std::size_t n) { return next() % n; }
  bool one_in(std::size_t n) { return below(n) == 0; }

 private:
  std::uint64_t state_;
};

/// How often something was carried through, so that a simulation in which nothing happens is noticed.
enum class Deed {
  session,
  cut,
  call,
  error,
  packet,
  ack,
  wire,
  out_wire,
  event,
  memory,
  generator,
  callback,
  lock,
  monitor,
  object
};
using Deeds = std::array<std::size_t, static_cast<std::size_t>(Deed::object) + 1>;

class Simulation {
 public:
  /// `is_loud`  tells on stderr what happens.
  explicit Simulation(std::uint64_t seed, bool is_loud = false);
  ~Simulation();
  /// Throws   Broken.
  void run();
  const Deeds& deeds() const { return deeds_; }
  /// Of all that was carried and told, in its order: the same for the same seed.
  std::uint64_t trace() const { return trace_; }

 private:
  using Done = std::function<void(const Result<Value>&)>;
  struct Request {
    std::string what;
    Done done;
  };
  /// One direction of a connection: what the sender's system has taken and the receiver has not.
  struct Lane {
    Bytes bytes;
    TimePoint not_before = {};
    std::size_t capacity = 0;
  };
  struct ClientPipe {
    double stream = 0;  ///< numbers the packets of this endpoint
    int sent = 0, received = 0;
    double peer = 0;  ///< the stream of the service's end, once known
    bool is_closing = false;
    std::set<std::uint32_t> unacknowledged = {};
  };
  struct ServicePipe {
    std::string member;
    std::int32_t index = 0;
    double stream = 0, peer = 0;
    int sent = 0, received = 0;
    bool is_accepted = false;
    std::set<std::uint32_t> unacknowledged = {};
  };
  struct Generator {
    int given = 0;
    bool is_over = false;
  };
  struct RunningGenerator {
    std::int32_t index = 0;
    int asked = 0;  ///< for a next value
    bool is_ending = false;
  };
  struct OpenCall {
    CallId id = 0;
    Result<Value> result;
  };
  /// A client, its connection and the service's session with it.
  struct Link {
    int number = 0;
    std::unique_ptr<ClientSession> client;
    std::unique_ptr<ServiceSession> service;
    Lane up, down;
    bool is_cut = false, client_hears = false, service_hears = false;

    // what the client knows
    bool is_connected = false, is_closed = false;
    std::map<RequestId, Request> requests = {};
    std::map<std::pair<std::string, std::int32_t>, ClientPipe> pipes = {};
    bool wants_wire = false, has_wire = false;
    double in_value = 0, out_sent = 0;  ///< last of this connection of the wire; 0: none
    RequestId wire_request = 0;
    std::size_t events = 0;         ///< of `told` that have come
    std::size_t events_before = 0;  ///< that may be lost: told before it was connected
    std::map<std::int32_t, RunningGenerator> generators = {};
    std::vector<std::pair<CallbackId, double>> questions = {};
    std::set<double> asked = {};  ///< callbacks that came
    int unlocks = 0, exits = 0;
    std::set<std::string> objects = {};

    // what the service knows
    bool is_gone = false, has_client = false;
    std::vector<OpenCall> calls = {};
    std::map<PipeId, ServicePipe> service_pipes = {};
    double in_sent = 0, out_value = 0;
    std::vector<double> told = {};  ///< events
    std::map<GeneratorId, Generator> service_generators = {};
    std::map<CallbackId, double> callbacks = {};
  };
  struct Held {
    const Link* link = nullptr;
    std::string path;
    TimePoint until;
  };
  class Object;

  // actors
  void add_link();
  void act(Link& link);
  void act_as_service(Link& link);
  void call(Link& link);
  void use_pipe(Link& link);
  void use_wire(Link& link);
  void use_generator(Link& link);
  void use_memory(Link& link);
  void use_lock(Link& link);
  void use_monitor(Link& link);
  void use_object(Link& link);
  void request(Link& link, const std::string& what, RequestId id, Done done);
  void use_service_pipe(Link& link);
  void tell_all();
  void answer_one(Link& link);
  void answer_question(Link& link);

  // network and time
  void carry(Link& link, bool is_all);
  template <class From, class To>
  bool carry(Link& link, From& from, To& to, Lane& lane, bool is_all);
  void cut(Link& link);
  void hear_of_cut(Link& link, bool is_all);
  void pass_time(std::chrono::milliseconds time);
  void fire_timers(Link& link);
  bool settle_step();
  void settle();
  void end_all();

  // judges
  void poll(Link& link);
  void handle(Link& link, ClientEvent& event);
  void handle(Link& link, ServiceEvent& event);
  void handle_call(Link& link, Called& called);
  /// Returns what is wrong with it.
  template <class Pipe>
  std::string judge_packet(Pipe& pipe, double number);
  void take_packet(Link& link, const PipePacketReceived& packet);
  void take_packet(Link& link, const PipeReceived& packet);
  void check_lock(std::vector<Held>& held, const Link& link, std::string_view path, bool is_below_included);
  void give_up(std::vector<Held>& held, const Link& link, std::string_view path);
  void check_rest(const Link& link);
  void demand(bool is_so, const Link* link, const std::string& what) const;
  void note(std::uint64_t what);
  void tell(const Link& link, const std::string& what) const;
  void count(Deed deed) { ++deeds_[static_cast<std::size_t>(deed)]; }

  std::uint64_t seed_;
  bool is_loud_;
  Dice dice_;
  Now now_{TimePoint{} + std::chrono::hours(1), {1'700'000'000, 0}};
  std::shared_ptr<HostedService> arm_;
  std::unique_ptr<ServiceDirectory> directory_;
  std::size_t max_open_calls_;
  Features client_features_, service_features_;
  std::vector<std::unique_ptr<Link>> links_;
  int last_link_ = 0;
  double last_number_ = 0;  ///< of calls, streams, values: all differ
  std::map<double, int> executed_;
  std::map<double, int> sent_on_;  ///< packets, by stream
  std::vector<Held> locks_, monitors_;
  bool is_settling_ = false;
  std::size_t step_ = 0;
  std::uint64_t trace_ = 14695981039346656037u;
  Deeds deeds_{};
};

}  // namespace rr::test
