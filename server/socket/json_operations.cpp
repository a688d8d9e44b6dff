#include "server/socket/json_operations.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/http/endpoints/call_log.hpp"
#include "server/http/endpoints/large_json.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// Requests that are not answered yet.
constexpr std::size_t max_running = 64;  ///< and as many that are urgent
/// Packets that wait for those before them. Where there are so many, the socket is not read for so long; a device that
/// takes none meanwhile must not keep the gateway from reading what stops it.
constexpr std::size_t max_packets = 1024;
constexpr std::chrono::milliseconds longest_pause{100};

/// What has ended a request: also what is nobody's intention, as a lack of memory, whose text is not for the client.
rr::Error error_of(const std::exception_ptr& thrown) {
  auto error = rr::handler_error(thrown);
  if (!rr::is_unhandled(error)) return error;
  log(LogLevel::error, "request of a JSON socket failed", {{"error", error.message}});
  return rr::make_error(rr::ErrorCode::internal_error, "the gateway could not do it");
}

}  // namespace

template <auto Answer>
rr::awaitable<rr::OrderedJson> JsonOperations::pass_on(JsonRequestPtr request, TargetPtr target) {
  return Answer(std::move(request), std::move(target), making());
}

const JsonOperations::Operation JsonOperations::operations[] = {
    {"describe", Verb::read, &JsonOperations::pass_on<&describe_target>},
    {"get", Verb::read, &JsonOperations::pass_on<&get_value>},
    {"set", Verb::write, &JsonOperations::pass_on<&set_value>},
    {"call", Verb::call, &JsonOperations::pass_on<&call_function>},
    {"open", Verb::call, &JsonOperations::open},
    {"next", Verb::call, &JsonOperations::next, {.has_target = false}},
    {"close", Verb::call, &JsonOperations::close, {.has_target = false, .is_free = true}},
    {"abort", Verb::call, &JsonOperations::abort, {.has_target = false, .is_free = true}},
    {"subscribe", Verb::subscribe, &JsonOperations::subscribe},
    {"unsubscribe", Verb::subscribe, &JsonOperations::unsubscribe, {.has_target = false, .is_free = true}},
    {"send",
     Verb::write,
     &JsonOperations::send,
     {.needs_own = true, .keeps_order = true, .is_free = true, .recorded = Recorded::first_time}},
    {"callback", Verb::subscribe, &JsonOperations::callback, {.needs_own = true}},
    {"answer", Verb::subscribe, &JsonOperations::answer, {.has_target = false, .is_free = true}},
    {"shape", Verb::read, &JsonOperations::pass_on<&get_shape>, {.asks_shape = true}},
    {"read", Verb::read, &JsonOperations::pass_on<&read_memory>},
    {"write", Verb::write, &JsonOperations::pass_on<&write_memory>},
    {"lock", Verb::lock, &JsonOperations::pass_on<&lock_object>, {.needs_own = true}},
    {"unlock", Verb::lock, &JsonOperations::pass_on<&unlock_object>, {.needs_own = true, .gives_back = true}},
    {"lease", Verb::lock, &JsonOperations::pass_on<&lease_object>, {.needs_own = true}},
    {"renew",
     Verb::lock,
     &JsonOperations::pass_on<&renew_lease>,
     {.needs_own = true, .is_free = true, .recorded = Recorded::never}},
    {"release",
     Verb::lock,
     &JsonOperations::pass_on<&release_lease>,
     {.needs_own = true, .gives_back = true, .recorded = Recorded::never}},
    {"login", Verb::read, &JsonOperations::login, {.has_target = false, .comes_first = true}},
};

const JsonOperations::Operation JsonOperations::unknown_operation = {
    "", Verb::read, &JsonOperations::refuse_unknown, {.has_target = false}};

const JsonOperations::Operation& JsonOperations::operation_of(const JsonRequest& request) {
  const auto* name = request.find("op");
  if (!name || !name->is_string()) return unknown_operation;
  const auto* found = std::find_if(std::begin(operations), std::end(operations), [&](const Operation& each) {
    return each.name == name->get_ref<const std::string&>();
  });
  return found == std::end(operations) ? unknown_operation : *found;
}

JsonOperations::JsonOperations(GatewayState& gateway, JsonSocketPlace place, std::shared_ptr<Outbox> outbox)
    : gateway_(gateway),
      place_(std::move(place)),
      outbox_(std::move(outbox)),
      questions_(place_.device->executor(), place_.form, outbox_),
      sent_(place_.device->executor()) {}

rr::awaitable<void> JsonOperations::take(const std::string& message) {
  const bool is_large = message.size() > large_json_bytes;
  const auto measure = [&message] { return rr::memory_of_json(message); };
  auto memory = gateway_.memory().charge(place_.from.network);
  const bool is_small = message.size() <= largest_urgent;  // it may stop something
  bool has_room = memory.has_room(least_room);
  if (has_room || is_small) {
    // Named: g++ 12 destroys twice what a co_await within ?: gives.
    std::size_t needed = 0;
    if (is_large)
      needed = co_await gateway_.workers().run(measure);
    else
      needed = measure();
    has_room = has_room && memory.resize(needed);
    if (is_small) memory.hold(needed);
  }
  const auto tell_no_room = [&](const std::string& id) {
    tell_error(id, rr::make_error(rr::ErrorCode::out_of_system_resource,
                                  "the gateway has no memory left for a message of " + std::to_string(message.size()) +
                                      " bytes; try again in a moment"));
  };
  if (!has_room && !is_small) co_return tell_no_room("null");
  const auto parse = [&message] { return JsonRequest::from_text(message); };
  rr::Result<JsonRequest> read = rr::Error();
  if (is_large)
    read = co_await gateway_.workers().run(parse);
  else
    read = parse();
  if (!read) co_return tell_error("null", read.error());
  JsonRequestPtr request = std::make_shared<const JsonRequest>(std::move(*read));
  const auto& operation = operation_of(*request);
  const bool passes = operation.traits.gives_back || is_urgent(*request, operation);
  if (!has_room && !passes) co_return tell_no_room(request->id());
  if (operation.traits.keeps_order && !passes) {
    Packet packet{std::move(request), operation, std::move(memory)};  // named: see above
    co_await queue(std::move(packet));
    co_return;
  }
  if (running_ >= (passes ? 2 * max_running : max_running))
    co_return tell_error(request->id(),
                         rr::make_error(rr::ErrorCode::out_of_system_resource,
                                        "more than " + std::to_string(max_running) + " requests are not answered yet"));
  Passes held;
  if (!passes && !operation.traits.is_free) {
    auto entered = gateway_.http_access().enter(place_.from.network, place_.standing->identity().subject(),
                                                place_.device->config().name, gateway_.config().rates);
    if (!entered) {
      gateway_.reject(Rejection::rate);
      gateway_.access().record_too_much(place_.standing->identity(), nullptr, entered.error().message);
      co_return outbox_->add(json_refusal(request->id(), entered.error(), 1));
    }
    held = std::move(*entered);
  }
  ++running_;
  auto running = run(shared_from_this(), std::move(request), operation, std::move(held), std::move(memory));
  if (operation.traits.comes_first)
    co_await std::move(running);
  else
    asio::co_spawn(place_.device->executor(), std::move(running), asio::detached);
}

rr::awaitable<void> JsonOperations::queue(Packet packet) {
  for (;;) {
    const auto end_of_pause = last_sent_ + longest_pause;
    if (packets_.size() < max_packets || is_stopped_ || std::chrono::steady_clock::now() >= end_of_pause) break;
    sent_.expires_at(end_of_pause);
    co_await sent_.async_wait(asio::as_tuple(asio::use_awaitable));
  }
  if (is_stopped_) co_return;
  if (packets_.size() >= max_packets)
    co_return tell_error(
        packet.request->id(),
        rr::make_error(rr::ErrorCode::out_of_system_resource,
                       std::to_string(packets_.size()) + " packets wait to be sent already, and the device takes "
                                                         "none; wait for the answers"));
  packets_.push_back(std::move(packet));
  if (packets_.size() > 1) co_return;
  last_sent_ = std::chrono::steady_clock::now();
  asio::co_spawn(place_.device->executor(), send_queued(shared_from_this()), asio::detached);
}

rr::awaitable<void> JsonOperations::send_queued(std::shared_ptr<JsonOperations> self) {
  auto& packets = self->packets_;
  while (!packets.empty()) {
    auto& packet = packets.front();
    const Passes none;
    ++self->running_;
    co_await run(self, std::move(packet.request), packet.operation, none, std::move(packet.memory));
    packets.pop_front();
    if (self->is_stopped_) packets.clear();
    self->last_sent_ = std::chrono::steady_clock::now();
    self->sent_.cancel();
  }
}

bool JsonOperations::is_urgent(const JsonRequest& request, const Operation& operation) const {
  if (operation.verb != Verb::call && operation.verb != Verb::write) return false;
  const auto* path = request.find("path");
  auto place = place_.key.service;
  for (const auto& segment : place_.segments) place += "." + segment;
  const auto rest = split_path(path && path->is_string() ? path->get_ref<const std::string&>() : std::string());
  if (!rest) return false;
  for (const auto& segment : *rest) place += "." + segment;
  return place_.device->config().leases.is_urgent(place);
}

rr::awaitable<void> JsonOperations::run(std::shared_ptr<JsonOperations> self, JsonRequestPtr request,
                                        const Operation& operation, [[maybe_unused]] Passes passes,
                                        [[maybe_unused]] MemoryBudget::Charge memory) {
  std::optional<rr::Error> error;
  std::string answer;
  try {
    auto result = co_await self->perform(request, operation);
    const bool is_wanted = request->id() != "null";
    const bool is_large = held_bytes(result) > large_json_bytes;
    auto write = [id = request->id(), result = std::move(result)] { return json_answer(id, result); };
    if (is_wanted && !is_large)
      answer = write();
    else if (is_wanted)
      answer = co_await self->gateway_.workers().run(std::move(write));
  } catch (...) {
    error = error_of(std::current_exception());
  }
  --self->running_;
  if (error)
    self->tell_error(request->id(), *error);
  else if (!answer.empty())
    self->outbox_->add(std::move(answer));
  if (!request->is_large()) co_return;
  auto free = [freed = std::move(request)] { return freed.use_count(); };
  co_await self->gateway_.workers().run(std::move(free));
}

rr::awaitable<rr::OrderedJson> JsonOperations::perform(JsonRequestPtr request, const Operation& operation) {
  TargetPtr target;
  if (!operation.traits.has_target) co_return co_await (this->*operation.perform)(request, target);
  target = co_await find(request, operation);
  const CallLog logged(place_.trace, place_.device->config().name, operation.name, name_of(*target));
  const auto entry = admit(*target, operation);
  rr::OrderedJson result;
  std::optional<rr::Error> error;
  try {
    result = co_await (this->*operation.perform)(request, target);
  } catch (...) {
    error = error_of(std::current_exception());
  }
  if (entry) entry->finish(error ? rr::Result<>(*error) : rr::Result<>());
  if (error) throw rr::Exception(std::move(*error));
  co_return result;
}

rr::awaitable<TargetPtr> JsonOperations::find(JsonRequestPtr request, const Operation& operation) {
  auto segments = place_.segments;
  for (auto& segment : value_or_throw(split_path(request->text("path", "")))) segments.push_back(std::move(segment));
  auto used = co_await client();
  LookJudge may_look = [standing = place_.standing](const AccessRequest& object) { return standing->check(object); };
  auto target = value_or_throw(co_await find_target(used, segments, std::move(may_look)));
  // Who comes back says the number of the last event that it had: all must have them from the client that all share.
  const bool is_events =
      operation.verb == Verb::subscribe && target->member && target->member->kind == rr::MemberKind::event;
  if (is_events && used == own_) target->client = co_await shared_client();
  if (is_stopped_) refuse(rr::ErrorCode::operation_cancelled, "the WebSocket has ended");
  // Packets to a client come on the endpoint on which it has sent: nobody else's.
  const bool is_two_way = target->member && target->member->kind == rr::MemberKind::pipe &&
                          target->member->direction() == rr::MemberDirection::both;
  if ((operation.traits.needs_own || (is_two_way && operation.verb == Verb::subscribe)) && used != own_) {
    if (!own_) {
      const auto& who = place_.standing->identity();
      auto user = who.is_proven() ? who.subject() : place_.key.subject();
      own_ = value_or_throw(gateway_.clients().make_another(used->upstream(), std::move(user)));
      own_->set_standing(place_.standing);
      own_->on_lease_ended([outbox = outbox_](const std::string& path, const std::string& why) {
        auto news = rr::OrderedJson::object();
        rr::add_key(news, "lease") = path;
        rr::add_key(news, "state") = "ended";
        rr::add_key(news, "reason") = why;
        outbox->add(rr::write_json(news));
      });
    }
    target->client = own_;
  }
  co_return target;
}

AuditEntryPtr JsonOperations::admit(const Target& target, const Operation& operation) {
  auto wanted = access_request(target, operation.verb);
  wanted.is_shape = operation.traits.asks_shape;
  if (operation.traits.gives_back && target.client->has_lock(target.path()))
    return operation.traits.recorded == Recorded::never ? nullptr : place_.standing->begin(wanted, operation.name);
  auto begun = place_.standing->check_and_begin(wanted, place_.trace, operation.traits.recorded,
                                                operation.verb == Verb::lock ? operation.name : std::string_view());
  if (begun) return std::move(*begun);
  if (begun.error().code == rr::ErrorCode::out_of_system_resource) gateway_.reject(begun.error());
  throw rr::Exception(begun.error());
}

rr::awaitable<std::shared_ptr<ValueClient>> JsonOperations::client() {
  if (const auto own = own_) {  // which may leave while this waits
    if (const auto opened = co_await own->upstream()->opened(); !opened) throw rr::Exception(opened.error());
    co_return own;
  }
  co_return co_await shared_client();
}

rr::awaitable<std::shared_ptr<ValueClient>> JsonOperations::shared_client() {
  auto key = place_.key;
  auto from = place_.from;
  co_return value_or_throw(co_await open_session(gateway_, place_.device, std::move(key), std::move(from)));
}

void JsonOperations::tell_error(const std::string& id, const rr::Error& error) {
  outbox_->add(json_refusal(id, error));
}

void JsonOperations::stop() {
  is_stopped_ = true;
  sent_.cancel();
  for (auto& [id, open] : std::exchange(open_, {}))
    if (const auto* generator = std::get_if<Generator>(&open.what))
      generator->target->client->drop_generator(generator->id);
  senders_.clear();
  questions_.end_all();
  // Not when the last request that is under way lets go of it: the device may take long to answer that.
  if (const auto own = std::exchange(own_, nullptr)) own->leave();
}

rr::awaitable<rr::OrderedJson> JsonOperations::refuse_unknown(JsonRequestPtr request, TargetPtr) {
  refuse(rr::ErrorCode::invalid_argument, "no operation \"op\": " + rr::quote(request->text("op", "")));
}

rr::awaitable<rr::OrderedJson> JsonOperations::login(JsonRequestPtr request, TargetPtr) {
  if (own_ || !open_.empty() || !packets_.empty() || running_ > 1)
    refuse(rr::ErrorCode::invalid_operation, "\"login\" comes first: others are under way, or something is open");
  auto key = place_.key;
  key.username = request->text("username", "");
  key.password = request->text("password", "");
  auto tried = key;
  auto from = place_.from;
  value_or_throw(co_await open_session(gateway_, place_.device, std::move(tried), std::move(from)));
  place_.key = std::move(key);  // not before: a failed login leaves the one that there was
  co_return nullptr;
}

}  // namespace rrgate
