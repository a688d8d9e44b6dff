// How a client session comes to be: the combined request, or the older sequence; and how missing definitions are
// fetched. Layer: session. Source: sessions spec sections 2.3 and 2.4.
#include <algorithm>
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/robdef/model/names.hpp"
#include "core/session/client/client_session.hpp"

namespace rr {

namespace {

constexpr std::size_t max_fetched_definitions = 1024;
constexpr std::size_t max_fetched_bytes = 8u * 1024 * 1024;  // a byte may become forty

std::string read_text(const Message& message, const MessageEntry& entry, std::string_view name) {
  const auto* element = message.elements_of(entry).find(name);
  return element && element->type == DataType::string_t ? std::string(element->text()) : std::string();
}

std::vector<std::string> read_texts(const Message& message, const MessageEntry& entry, std::string_view name) {
  std::vector<std::string> texts;
  if (const auto* list = message.elements_of(entry).find(name); list && is_nested(list->type))
    for (const auto& item : message.children_of(*list))
      if (item.type == DataType::string_t) texts.emplace_back(item.text());
  return texts;
}

}  // namespace

void ClientSession::Fetch::add(std::string_view text) {
  bytes += text.size();
  if (bytes > max_fetched_bytes) return;  // advance_fetch() says so
  const auto& definition = parsed.emplace_back(parse_service_definition(text, RobdefMode::compat)).definition;
  names.insert(definition.name);
  for (const auto& import : definition.imports) wanted.insert(import.name);
}

void ClientSession::start_session(Now now) {
  has_started_ = true;
  connection_.set_endpoints(endpoint_, 0);
  if (connection_.features().combined())
    request_combined(now);
  else
    request_special(EntryType::get_service_desc, options_.service, now);
}

/// A node-level request with `clientversion`, part of the connect sequence.
void ClientSession::request_special(EntryType type, std::string_view path, Now now) {
  const auto id = begin_request(type, path, {});
  if (type != EntryType::connect_client) outgoing_.add_text("clientversion", protocol_level);
  if (auto sent = send_outgoing(now); !sent) return fail(sent.error());
  add_pending(id, type, nullptr, {}, now);
}

void ClientSession::add_login() {
  outgoing_.add_text("username", options_.username);
  // A name alone is no login: services that do not insist on one connect whoever gives it.
  if (options_.credentials.is_null()) return;
  // Credentials hold what the application gave: a value that cannot be packed is refused by the service's login.
  if (!pack_varvalue(outgoing_, "credentials", options_.credentials, types_))
    outgoing_.add("credentials", DataType::void_t, 0, {});
}

void ClientSession::request_combined(Now now) {
  const auto id = begin_request(EntryType::connect_client_combined, options_.service, {});
  outgoing_.add_text("clientversion", protocol_level);
  outgoing_.add_text("returnservicedefs", "true");
  if (options_.known_definitions) add_known_tag({});
  if (!options_.username.empty()) add_login();
  if (auto sent = send_outgoing(now); !sent) return fail(sent.error());
  add_pending(id, EntryType::connect_client_combined, nullptr, {}, now);
}

void ClientSession::handle_connect_reply(const MessageEntry& entry, EntryType request, Now now) {
  const auto& message = *connection_.message();
  if (entry.error != ErrorCode::none) {
    auto error = read_error(message, entry, types_);
    error.message = "connect to " + quote(options_.service) + ": " + error.message;
    return fail(std::move(error));
  }
  switch (request) {
    case EntryType::connect_client_combined: {
      connection_.set_endpoints(endpoint_, message.header.sender_endpoint);
      connection_.authorise();
      read_object_type(entry);
      keep_attributes(entry);
      const auto texts = take_definitions(entry, {}, read_texts(message, entry, "servicedefs"));
      Fetch fetch;
      if (!options_.read_definitions || !options_.read_definitions->find(texts, types_))
        for (const auto& text : texts) fetch.add(text);
      return advance_fetch(std::move(fetch), now);
    }
    case EntryType::get_service_desc: {
      keep_attributes(entry);
      Fetch fetch;
      for (auto& name : read_texts(message, entry, "extraimports")) fetch.wanted.insert(std::move(name));
      fetch.add(read_text(message, entry, "servicedef"));
      return advance_fetch(std::move(fetch), now);
    }
    case EntryType::object_type_name:
      read_object_type(entry);
      return request_special(EntryType::connect_client, options_.service, now);
    case EntryType::connect_client: {
      connection_.set_endpoints(endpoint_, message.header.sender_endpoint);
      connection_.authorise();
      if (options_.username.empty()) return become_connected(now);
      const auto id = begin_request(EntryType::client_session_op_req, options_.service, "AuthenticateUser");
      add_login();
      if (auto sent = send_outgoing(now); !sent) return fail(sent.error());
      return add_pending(id, EntryType::client_session_op_req, nullptr, {}, now);
    }
    case EntryType::client_session_op_req:
      return become_connected(now);
    default:
      return;
  }
}

KnownDefinitions* ClientSession::find_known(std::string_view name) {
  auto& known = *options_.known_definitions;
  const auto found = std::find_if(known.begin(), known.end(), [name](const auto& each) { return each.name == name; });
  return found == known.end() ? nullptr : &*found;
}

void ClientSession::add_known_tag(std::string_view name) {
  const auto* known = find_known(name);
  outgoing_.add_text(definitions_element, known ? known->tag : std::string_view());
}

/// What a reply has `sent`, or what it confirms instead; what has a tag is remembered by `name`.
std::vector<std::string> ClientSession::take_definitions(const MessageEntry& entry, std::string_view name,
                                                         std::vector<std::string> sent) {
  if (!options_.known_definitions) return sent;
  auto tag = read_text(*connection_.message(), entry, definitions_element);
  if (tag.empty()) return sent;
  service_has_tags_ = true;
  auto* known = find_known(name);
  if (sent.empty()) return known && known->tag == tag ? known->texts : sent;
  if (known)
    *known = {std::string(name), std::move(tag), sent};
  else if (options_.known_definitions->size() < max_known_definitions)
    options_.known_definitions->push_back({std::string(name), std::move(tag), sent});
  return sent;
}

void ClientSession::read_object_type(const MessageEntry& entry) {
  const auto& message = *connection_.message();
  root_type_ = read_text(message, entry, "objecttype");
  root_implements_ = read_texts(message, entry, "objectimplements");
}

Result<Value> ClientSession::read_attributes(const MessageEntry& entry, std::string_view name) const {
  const auto& message = *connection_.message();
  const auto* element = message.elements_of(entry).find(name);
  if (!element) return Value(MapString{});
  auto value = unpack_varvalue(message, *element, types_);
  if (value && !value->get_if<MapString>())
    return make_error(ErrorCode::data_type_mismatch, "attributes are " + value->type_text() + ", expected map{string}");
  return value;
}

void ClientSession::keep_attributes(const MessageEntry& entry) {
  // Attributes only describe; a service whose attributes cannot be read is still a service.
  if (auto value = read_attributes(entry, "attributes")) attributes_ = std::move(*value->get_if<MapString>());
}

RequestId ClientSession::get_attributes(Now now) {
  if (state_ != ClientState::connected) return fail_request(next_request_id(), not_connected());
  const auto id = begin_request(EntryType::get_service_attributes, options_.service, {});
  if (auto sent = send_outgoing(now); !sent) return fail_request(id, sent.error());
  add_pending(id, EntryType::get_service_attributes, nullptr, {}, now);
  return id;
}

/// Asks for the next definition that is missing, one at a time, or goes on when there is none.
void ClientSession::advance_fetch(Fetch fetch, Now now) {
  if (fetch.asked.size() > max_fetched_definitions || fetch.bytes > max_fetched_bytes)
    return fail_fetch(fetch, make_error(ErrorCode::service_definition_error,
                                        "the definitions import more than 1024 others, or have more than 8 MiB"));
  const auto missing = std::find_if(fetch.wanted.begin(), fetch.wanted.end(), [&](const std::string& name) {
    return !fetch.names.contains(name) && !types_.find_service(name);
  });
  if (missing == fetch.wanted.end()) return finish_fetch(std::move(fetch), now);
  if (!fetch.asked.insert(*missing).second)
    return fail_fetch(fetch, make_error(ErrorCode::service_definition_error,
                                        "the node answered with another definition than " + quote(*missing)));
  const auto id = begin_request(EntryType::get_service_desc, options_.service, {});
  outgoing_.add_text("ServiceType", *missing);
  outgoing_.add_text("clientversion", protocol_level);
  if (service_has_tags_) add_known_tag(*missing);
  fetch.last_asked = *missing;
  if (auto sent = send_outgoing(now); !sent) return fail(sent.error());
  add_pending(id, EntryType::get_service_desc, nullptr, {}, now);
  pending_.find(id)->second.fetch = std::make_unique<Fetch>(std::move(fetch));
}

void ClientSession::handle_fetch_reply(const MessageEntry& entry, Fetch fetch, Now now) {
  const auto& message = *connection_.message();
  if (entry.error != ErrorCode::none) return fail_fetch(fetch, read_error(message, entry, types_));
  std::vector<std::string> sent;
  if (message.elements_of(entry).find("servicedef")) sent.push_back(read_text(message, entry, "servicedef"));
  sent = take_definitions(entry, fetch.last_asked, std::move(sent));
  // Without any, advance_fetch() says that the node answered with another one.
  fetch.add(sent.empty() ? std::string_view() : sent.front());
  advance_fetch(std::move(fetch), now);
}

void ClientSession::finish_fetch(Fetch fetch, Now now) {
  if (auto added = types_.add_parsed(std::move(fetch.parsed), RobdefMode::compat); !added)
    return fail_fetch(fetch, added.error());
  if (fetch.lookup == 0) {
    // The older sequence has asked for definitions only; the combined one is at its end.
    if (root_type_.empty()) return request_special(EntryType::object_type_name, options_.service, now);
    return become_connected(now);
  }
  const auto* type = types_.find_entity(fetch.object_type);
  if (!type || type->kind != EntityKind::object)
    return fail_fetch(fetch,
                      make_error(ErrorCode::service_error,
                                 "object " + quote(fetch.path) + " has the unknown type " + quote(fetch.object_type)));
  objects_.insert_or_assign(fetch.path, type);
  emit(Completed{fetch.lookup, Value(fetch.object_type)});
}

void ClientSession::fail_fetch(const Fetch& fetch, Error error) {
  if (fetch.lookup != 0) return emit(Completed{fetch.lookup, std::move(error)});
  error.message = "connect to " + quote(options_.service) + ": " + error.message;
  fail(std::move(error));
}

void ClientSession::handle_type_name_reply(const MessageEntry& entry, RequestId id, std::string path, Now now) {
  Fetch fetch;
  fetch.lookup = id;
  fetch.path = std::move(path);
  fetch.object_type = read_text(*connection_.message(), entry, "objecttype");
  if (!types_.find_entity(fetch.object_type))
    fetch.wanted.insert(std::string(split_qualified(fetch.object_type).service));
  advance_fetch(std::move(fetch), now);
}

Result<std::string> ClientSession::choose_root_type() const {
  const auto& wanted = options_.object_type;
  if (wanted.empty() || wanted == root_type_) return root_type_;
  // The list that the service sent names local objects without their definition.
  const std::string home(split_qualified(root_type_).service);
  for (const auto& base : root_implements_)
    if (base == wanted || home + "." + base == wanted) return wanted;
  std::vector<const EntityDefinition*> open{types_.find_entity(root_type_)};
  std::set<const EntityDefinition*> seen;
  while (!open.empty()) {
    const auto* type = open.back();
    open.pop_back();
    if (!type || !seen.insert(type).second) continue;
    for (const auto& base : type->implements) {
      if (base.qualified_name == wanted) return wanted;
      open.push_back(types_.find_entity(base.qualified_name));
    }
  }
  return make_error(ErrorCode::service_error, "Invalid object type: " + quote(options_.service) + " is a " +
                                                  root_type_ + ", which does not implement " + quote(wanted));
}

void ClientSession::become_connected(Now) {
  const auto chosen = choose_root_type();
  if (!chosen) return fail(chosen.error());
  const auto* type = types_.find_entity(*chosen);
  if (!type || type->kind != EntityKind::object)
    return fail(make_error(ErrorCode::service_error, "the root object of " + quote(options_.service) +
                                                         " has the unknown type " + quote(*chosen)));
  objects_.emplace(options_.service, type);
  options_.credentials = {};  // nothing needs the secret any more
  if (options_.read_definitions) options_.read_definitions->keep(types_);
  state_ = ClientState::connected;
  emit(Connected{*chosen});
}

}  // namespace rr
