// What stays open for a client of a JSON WebSocket: what it has subscribed to, sends on, and answers. Layer:
// server/socket. See docs/http-api.md.
#include "server/http/endpoints/member_values.hpp"
#include "server/http/endpoints/sample_text.hpp"
#include "server/socket/json_operations.hpp"

namespace rrgate {

namespace {

/// Subscriptions, generators and callbacks at a time, and as many wires and pipes that are sent on.
constexpr std::size_t max_open = 256;

/// {"subscription": id, ...}
std::string news_of(const std::string& id, const rr::OrderedJson& news) {
  return "{\"subscription\":" + id + "," + rr::write_json(news).substr(1);
}

/// A sample as the client gets it; also why it can't get it.
std::string value_news(const std::string& id, const Sample& sample, const Target& target, const rr::JsonForm& form,
                       MemoryBudget& memory) {
  const auto& value = sample_text(sample, *target.member, target.types(), form, memory);
  if (!value) return news_of(id, rr::error_to_json(value.error(), target.types()));
  auto out = "{\"subscription\":" + id + ",\"value\":" + *value;
  if (target.member->kind == rr::MemberKind::event) out += ",\"number\":" + std::to_string(sample.number);
  if (target.member->kind == rr::MemberKind::wire)
    out += ",\"time\":{\"seconds\":\"" + std::to_string(sample.time.seconds) +
           "\",\"nanoseconds\":" + std::to_string(sample.time.nanoseconds) + "}";
  return out + "}";
}

}  // namespace

JsonOperations::Reserved JsonOperations::reserve(const JsonRequest& request) {
  const auto& id = request.id();
  if (id == "null") refuse(rr::ErrorCode::invalid_argument, "what stays open is named by its \"id\": it needs one");
  if (open_.contains(id)) refuse(rr::ErrorCode::invalid_argument, "the id " + id + " names something that is open");
  if (open_.size() >= max_open)
    refuse(rr::ErrorCode::out_of_system_resource,
           "this WebSocket has " + std::to_string(max_open) + " subscriptions, generators and callbacks already");
  const auto made = open_.try_emplace(id, outbox_).first;
  return {id, made->second.opening.token()};
}

JsonOperations::Open* JsonOperations::find_open(const Reserved& reserved) {
  const auto found = open_.find(reserved.id);
  return found != open_.end() && found->second.opening.token() == reserved.token ? &found->second : nullptr;
}

void JsonOperations::drop_open(const Reserved& reserved) {
  if (find_open(reserved)) open_.erase(reserved.id);
}

rr::awaitable<rr::OrderedJson> JsonOperations::subscribe(JsonRequestPtr request, TargetPtr target) {
  const auto& member =
      expect_member(*target, "subscribe", {rr::MemberKind::event, rr::MemberKind::wire, rr::MemberKind::pipe});
  expect_direction(member, rr::MemberDirection::writeonly);
  const auto* after = request->find("after");
  if (after && !after->is_number_unsigned())
    refuse(rr::ErrorCode::invalid_argument, "\"after\" is the number of an event");
  const auto reserved = reserve(*request);
  const auto told = std::make_shared<Target>(*target);
  told->client.reset();  // it would keep itself
  SampleHandler handler = [outbox = outbox_, id = reserved.id, token = reserved.token, told, form = place_.form,
                           memory = &gateway_.memory()](const SamplePtr& sample, const rr::Error* error) {
    if (!sample) {
      auto out = rr::OrderedJson::object();
      rr::add_key(out, "state") = state_name(error);
      if (error) rr::add_key(out, "detail") = rr::error_to_json(*error, told->types())["error"]["message"];
      outbox->add(token, news_of(id, out));
    } else if (told->member->kind == rr::MemberKind::wire) {
      outbox->add_newest(token, sample->bytes,
                         [id, told, form, memory, sample] { return value_news(id, *sample, *told, form, *memory); });
    } else {
      outbox->add(token, value_news(id, *sample, *told, form, *memory));
    }
  };
  auto place = target->place();
  const auto from = after ? after->get<std::uint64_t>() : 0;
  auto listening = co_await target->client->listen(std::move(place), from, std::move(handler));
  keep(reserved, std::move(listening), *target);
  co_return nullptr;
}

void JsonOperations::keep(const Reserved& reserved, rr::Result<ValueClient::ListenerPtr> listener,
                          const Target& target) {
  auto* open = find_open(reserved);
  if (!listener) drop_open(reserved);
  auto kept = value_or_throw(std::move(listener));
  if (!open) refuse(rr::ErrorCode::operation_cancelled, "it was ended before it was open");
  open->what = Subscription{std::move(kept), target.path(), target.member->name};
}

rr::awaitable<rr::OrderedJson> JsonOperations::unsubscribe(JsonRequestPtr request, TargetPtr) {
  const auto found = open_.find(request->at("subscription").dump());
  if (found == open_.end() || std::holds_alternative<Generator>(found->second.what))
    refuse(rr::ErrorCode::invalid_argument, "\"subscription\" is not the id of one that is open");
  const auto gone = open_.extract(found);
  co_return nullptr;
}

rr::awaitable<rr::OrderedJson> JsonOperations::send(JsonRequestPtr request, TargetPtr target) {
  const auto& member = expect_member(*target, "send", {rr::MemberKind::wire, rr::MemberKind::pipe});
  expect_direction(member, rr::MemberDirection::readonly);
  auto value = co_await value_of(*request, *target, member.type, member.name, making());
  const std::pair key(target->path(), member.name);
  if (!senders_.contains(key)) {
    if (senders_.size() >= max_open)
      refuse(rr::ErrorCode::out_of_system_resource,
             "this WebSocket sends on " + std::to_string(max_open) + " wires and pipes already");
    value_or_throw(place_.standing->check(access_request(*target, verb_to_connect(*target->member)), Recorded::never));
    SampleHandler nothing = [](const SamplePtr&, const rr::Error*) {};
    auto place = target->place();
    auto listening = value_or_throw(co_await target->client->listen(std::move(place), 0, std::move(nothing)));
    if (is_stopped_) co_return nullptr;
    senders_[key] = std::move(listening);
  }
  auto place = target->place();
  const auto sent = co_await target->client->send(std::move(place), std::move(value));
  if (!sent) throw rr::Exception(sent.error());
  co_return nullptr;
}

void JsonOperations::review() {
  for (auto it = open_.begin(); it != open_.end();) {
    const auto* open = std::get_if<Subscription>(&it->second.what);
    rr::Result<> allowed;
    if (open)
      allowed = place_.standing->check({.device = place_.device->config().name,
                                        .service = place_.key.service,
                                        .path = open->path,
                                        .member = open->member,
                                        .verb = Verb::subscribe},
                                       Recorded::never);
    if (allowed) {
      ++it;
      continue;
    }
    questions_.end_of(open->path, open->member, allowed.error());
    auto news = rr::OrderedJson::object();
    rr::add_key(news, "state") = "ended";
    rr::add_key(news, "detail") = allowed.error().message;
    outbox_->add(it->second.opening.token(), news_of(it->first, news));
    const auto id = it->first;
    open_.erase(it);  // which may end others, too
    it = open_.upper_bound(id);
  }
  if (const auto own = own_) own->review_locks();
}

// --- the device asks ---

rr::awaitable<rr::OrderedJson> JsonOperations::callback(JsonRequestPtr request, TargetPtr target) {
  expect_member(*target, "callback", {rr::MemberKind::callback});
  const auto reserved = reserve(*request);
  const auto asked = std::make_shared<Target>(*target);
  asked->client.reset();
  rr::ClientConnection::LateCallbackHandler handler = [weak = weak_from_this(), id = reserved.id, asked](
                                                          std::span<const rr::Value> arguments, const auto& reply) {
    if (const auto self = weak.lock())
      self->questions_.ask(id, asked, arguments, reply);
    else
      reply(client_gone());
  };
  auto answering = target->client->answer_callback(target->place(), std::move(handler));
  keep(reserved, std::move(answering), *target);
  co_return nullptr;
}

rr::awaitable<rr::OrderedJson> JsonOperations::answer(JsonRequestPtr request, TargetPtr) {
  questions_.answer(*request);
  co_return nullptr;
}

}  // namespace rrgate
