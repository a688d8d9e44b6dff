// What agents are told of by themselves: subscriptions/listen. Layer: server/mcp. See docs/mcp.md.
#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <set>

#include "server/http/endpoints/member_values.hpp"
#include "server/mcp/mcp_describe.hpp"
#include "server/mcp/mcp_tools.hpp"
#include "server/mcp/value_hash.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

using std::chrono::steady_clock;

/// Resources of one subscription.
constexpr std::size_t most_resources = 64;
/// A model can't use news that come faster.
constexpr std::chrono::seconds telling_period{1};
/// A property says nothing of its changes: it is asked for its value so often.
constexpr std::chrono::seconds property_period{2};
/// What can't be followed is tried again so often.
constexpr std::chrono::seconds search_period{5};
/// Until there is news: for as long as the client is there.
constexpr std::chrono::hours no_end{24};

/// What a client wants to hear of. What there is besides never changes here: tools, and prompts, of which there are
/// none.
struct Filter {
  bool wants_list = false;
  std::set<std::string> uris = {};
};

/// Throws   rr::Exception, invalid_argument.
Filter read_filter(const rr::Json& given) {
  Filter out;
  if (const auto list = given.find("resourcesListChanged"); list != given.end()) {
    if (!list->is_boolean())
      refuse(rr::ErrorCode::invalid_argument, "\"resourcesListChanged\" is neither true nor false");
    out.wants_list = list->get<bool>();
  }
  const auto uris = given.find("resourceSubscriptions");
  if (uris == given.end()) return out;
  if (!uris->is_array() || uris->size() > most_resources)
    refuse(rr::ErrorCode::invalid_argument,
           "\"resourceSubscriptions\" is no list of at most " + std::to_string(most_resources) + " URIs");
  for (const auto& uri : *uris) {
    if (!uri.is_string()) refuse(rr::ErrorCode::invalid_argument, "\"resourceSubscriptions\" has what is no string");
    out.uris.insert(uri.get<std::string>());
  }
  return out;
}

/// `id`  of the request that began the subscription; null: none did.
rr::OrderedJson notification(std::string_view method, rr::OrderedJson params, const rr::OrderedJson& id) {
  if (!id.is_null()) rr::add_key(params, "_meta")["io.modelcontextprotocol/subscriptionId"] = id;
  auto out = rr::OrderedJson::object();
  rr::add_key(out, "jsonrpc") = "2.0";
  rr::add_key(out, "method") = method;
  rr::add_key(out, "params") = std::move(params);
  return out;
}

std::size_t hash_of(const rr::OrderedJson& json) {
  return std::hash<std::string>()(rr::write_json(json));
}

}  // namespace

/// A resource whose changes a client is told of.
struct McpTools::Followed {
  std::string uri;
  std::string device;
  TargetPtr target = nullptr;                   ///< null: it is the device
  ValueClient::ListenerPtr listener = nullptr;  ///< of a wire
  std::size_t seen = 0;                         ///< hash of what it was
  bool has_seen = false;
  bool has_changed = false;
  bool is_asking = false;
  bool has_ended = false;  ///< the device has closed it, or has replaced its object
  steady_clock::time_point next_look = {};

  /// Nothing comes of it any more: it has to be followed anew.
  bool is_over() const { return has_ended || (target && target->client->upstream()->is_closed()); }

  Verb verb() const { return listener ? Verb::subscribe : Verb::read; }
  void note(std::size_t now) {
    has_changed = has_changed || (has_seen && seen != now);
    seen = now;
    has_seen = true;
  }

  /// Asks a property for its value. `pass`  of the device's rates, for as long as that takes.
  static rr::awaitable<void> ask(FollowedPtr self, [[maybe_unused]] std::optional<RateGate::Pass> pass = {}) {
    std::size_t now = 0;  // it can't be read
    try {
      const auto value = co_await self->target->ask(rr::CallKind::property_get);
      now = hash_of(value);
    } catch (const rr::Exception&) {
    }
    self->note(now);
    self->is_asking = false;
    self->next_look = steady_clock::now() + property_period;
  }
};

/// What a client is told.
struct McpTools::Listening {
  rr::OrderedJson id = nullptr;  ///< see notification()
  bool wants_list = false;
  std::vector<FollowedPtr> followed = {};
  bool has_list_changed = false;
  AccessStatePtr rights = nullptr;  ///< as of the last look at the list
  std::uint64_t changes = 0;        ///< likewise; see DeviceRegistry::changes()
  std::size_t names = 0;            ///< hash of the list
  steady_clock::time_point next_telling = steady_clock::now();
  bool are_missing = false;                   ///< resources that can't be followed now
  steady_clock::time_point next_search = {};  ///< for those
  std::set<std::string> refused = {};         ///< resources that the client may not follow
  AccessStatePtr refused_by = nullptr;        ///< as long as these are the rights
};

rr::awaitable<McpTools::FollowedPtr> McpTools::follow(std::string uri) {
  const auto out = std::make_shared<Followed>();
  const auto named = parse_resource(uri);
  out->uri = std::move(uri);
  out->device = named.device;
  if (named.path.empty()) {
    find_device(named.device, "");
    co_return out;
  }
  out->target = co_await find(request_of(named));
  const auto& member = expect_member(*out->target, "a subscription", {rr::MemberKind::property, rr::MemberKind::wire});
  expect_direction(member, rr::MemberDirection::writeonly);
  const auto entry = admit(*out->target, member.kind == rr::MemberKind::wire ? Verb::subscribe : Verb::read);
  if (member.kind == rr::MemberKind::property) {
    co_await out->ask(out);  // what it is now: the client is told of what comes behind the acknowledgement
  } else {
    auto place = out->target->place();
    // Also where it is lost, or back: what a reader is told changes with that.
    SampleHandler handler = [weak = std::weak_ptr(out)](const SamplePtr&, const rr::Error* error) {
      const auto self = weak.lock();
      if (!self) return;
      self->has_changed = true;
      if (error && error->code != rr::ErrorCode::connection_error) self->has_ended = true;
    };
    has_asked_device_ = true;
    out->listener = value_or_throw(co_await out->target->client->listen(std::move(place), 0, std::move(handler)));
  }
  if (entry) entry->finish({});
  co_return out;
}

void McpTools::look_at(const FollowedPtr& followed) {
  if (!followed->target) {
    const AccessRequest what{.device = followed->device};
    if (const auto allowed = standing_.check(what, Recorded::never); !allowed) throw rr::Exception(allowed.error());
    const auto* device = gateway_.devices().find(followed->device);
    followed->note(device ? hash_of(device_for_agent(gateway_, standing_.identity(), *device)) : 0);
    return;
  }
  go_on(*followed->target, followed->verb());
  if (followed->listener || followed->is_asking || steady_clock::now() < followed->next_look) return;
  auto pass = gateway_.http_access().enter_device(followed->device, gateway_.config().rates);
  if (!pass) return;  // others have more to ask: at the next look
  followed->is_asking = true;
  asio::co_spawn(reply_.writer().executor(), Followed::ask(followed, std::move(pass)), asio::detached);
}

/// Whether the devices that the client may use are others than at the last look.
bool McpTools::look_at_list(Listening& listening) {
  const auto& rights = gateway_.access().state_ptr();
  const auto changes = gateway_.devices().changes();
  if (listening.rights == rights && listening.changes == changes) return false;
  const bool is_first = listening.rights == nullptr;
  auto names = rr::OrderedJson::array();
  for (const auto& device : gateway_.devices().all())
    if (gateway_.access().sees(standing_.identity(), device->config().name)) names.push_back(device->config().name);
  const auto before = std::exchange(listening.names, hash_of(names));
  listening.rights = rights;
  listening.changes = changes;
  return !is_first && listening.names != before;
}

bool McpTools::look(Listening& listening) {
  if (listening.wants_list && look_at_list(listening)) listening.has_list_changed = true;
  if (std::erase_if(listening.followed, [](const auto& each) { return each->is_over(); }) > 0) {
    // Who subscribed by a request repeats it, and hears then what there is to follow.
    if (!listening.id.is_null()) refuse(rr::ErrorCode::invalid_state, "the device has closed what was followed");
    listening.are_missing = true;
    listening.next_search = steady_clock::now();
  }
  bool has_news = listening.has_list_changed;
  for (const auto& each : listening.followed) {
    look_at(each);
    has_news = has_news || each->has_changed;
  }
  return has_news && steady_clock::now() >= listening.next_telling;
}

rr::awaitable<void> McpTools::tell_news(Listening& listening) {
  if (std::exchange(listening.has_list_changed, false)) {
    const auto told = notification("notifications/resources/list_changed", rr::OrderedJson::object(), listening.id);
    co_await reply_.tell(told);
  }
  for (const auto& each : listening.followed) {
    if (!std::exchange(each->has_changed, false)) continue;
    auto which = rr::OrderedJson::object();
    rr::add_key(which, "uri") = each->uri;
    const auto told = notification("notifications/resources/updated", std::move(which), listening.id);
    co_await reply_.tell(told);
  }
  listening.next_telling = steady_clock::now() + telling_period;
}

rr::awaitable<void> McpTools::listen(const rr::Json& wanted, rr::OrderedJson id) {
  const auto filter = read_filter(wanted);
  reply_.set_progress(nullptr);  // it has no end to go towards
  Listening listening;
  listening.id = std::move(id);
  listening.wants_list = filter.wants_list;
  auto uris = rr::OrderedJson::array();
  for (const auto& uri : filter.uris) {
    const auto followed = co_await try_to_follow(uri);
    if (!followed) continue;  // the client hears which ones it is told of
    listening.followed.push_back(*followed);
    uris.push_back(uri);
  }
  auto honored = rr::OrderedJson::object();
  if (filter.wants_list) rr::add_key(honored, "resourcesListChanged") = true;
  if (!uris.empty()) rr::add_key(honored, "resourceSubscriptions") = std::move(uris);
  auto params = rr::OrderedJson::object();
  rr::add_key(params, "notifications") = std::move(honored);
  const auto begun = notification("notifications/subscriptions/acknowledged", std::move(params), listening.id);
  co_await reply_.tell(begun);
  const std::function<bool()> has_news = [&] { return look(listening); };
  for (;;) {
    co_await reply_.wait(no_end, has_news);
    co_await tell_news(listening);
  }
}

rr::awaitable<rr::Result<McpTools::FollowedPtr>> McpTools::try_to_follow(std::string uri) {
  reply_.expect_client();
  std::optional<rr::Error> failed;
  FollowedPtr followed;
  try {
    const auto named = parse_resource(uri);
    const auto* device = gateway_.devices().find(named.device);
    // To try would take long, and others wait meanwhile.
    if (device && device->state() == DeviceState::offline && !named.path.empty())
      refuse(rr::ErrorCode::connection_error, "the device is offline");
    followed = co_await follow(std::move(uri));
  } catch (const rr::Exception& exception) {
    failed = exception.error();
  }
  pass_.reset();  // what goes on from now on is no request to the device
  if (failed) co_return *failed;
  co_return followed;
}

rr::awaitable<void> McpTools::follow_again(Listening& listening, std::set<std::string> uris) {
  auto& followed = listening.followed;
  std::erase_if(followed, [&](const auto& each) { return !uris.contains(each->uri); });
  for (const auto& each : followed) uris.erase(each->uri);
  const auto rights = gateway_.access().state_ptr();
  if (std::exchange(listening.refused_by, rights) != rights) listening.refused.clear();
  for (const auto& uri : listening.refused) uris.erase(uri);  // each attempt would be recorded
  listening.are_missing = false;
  for (const auto& uri : uris) {
    const auto found = co_await try_to_follow(uri);
    if (found) {
      followed.push_back(*found);
      followed.back()->has_changed = true;  // since the client subscribed, or since a cut: nobody knows
    } else if (found.error().code == rr::ErrorCode::permission_denied) {
      listening.refused.insert(uri);
    } else {
      listening.are_missing = true;  // it was there when the client subscribed, and may be again
    }
  }
  listening.next_search = steady_clock::now() + search_period;
}

rr::awaitable<void> McpTools::tell_session(const AgentSubscriptions::Stream& session) {
  Listening listening;
  listening.wants_list = true;
  listening.has_list_changed = !reply_.request().header("Last-Event-ID").empty();  // since a cut: nobody knows
  auto seen = session.changes();
  co_await follow_again(listening, session.uris());
  const auto must_follow = [&] {
    return session.changes() != seen || (listening.are_missing && steady_clock::now() >= listening.next_search) ||
           (!listening.refused.empty() && listening.refused_by != gateway_.access().state_ptr());
  };
  const std::function<bool()> has_news = [&] { return must_follow() || look(listening); };
  for (;;) {
    co_await reply_.wait(no_end, has_news);
    if (must_follow()) {
      seen = session.changes();
      co_await follow_again(listening, session.uris());
    }
    co_await tell_news(listening);
  }
}

rr::awaitable<void> McpTools::expect_changing(std::string uri) {
  co_await follow(std::move(uri));
}

}  // namespace rrgate
