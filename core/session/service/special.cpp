// Node-level requests: definitions, types, connect and disconnect. They need no session. Layer: session.
// Source: sessions spec sections 2.2, 2.3, 2.4.
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/robdef/model/names.hpp"
#include "core/session/known_definitions.hpp"
#include "core/session/service/service_session.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

// The names that 1.2.8 gives these two, against its own table: clients may know them by name.
Error service_not_found() {
  return {ErrorCode::service_not_found, "Service not found", "RobotRaconteur.ServiceNotFoundException"};
}

Error object_not_found() {
  return {ErrorCode::object_not_found, "Object not found", "RobotRaconteur.ObjectNotFoundException"};
}

Error login_failed() {
  return {ErrorCode::authentication_error, "Authentication Failed"};
}

Error has_session_already() {
  return {ErrorCode::invalid_operation, "this connection has a session already"};
}

const MessageElement* find_text(const Message& message, const MessageEntry& entry, std::string_view name) {
  const auto* element = message.elements_of(entry).find(name);
  return element && element->type == DataType::string_t ? element : nullptr;
}

std::optional<std::string> read_known_tag(const Message& message, const MessageEntry& entry) {
  const auto* element = find_text(message, entry, definitions_element);
  return element ? std::optional<std::string>(element->text()) : std::nullopt;
}

bool has_login(const Message& message, const MessageEntry& entry) {
  const auto elements = message.elements_of(entry);
  return elements.find("username") && elements.find("credentials");
}

std::string_view service_name_of(const MessageEntry& entry) {
  return entry.service_path.substr(0, entry.service_path.find('.'));
}

/// Writes the tag of `texts` where the client has asked for it by saying what it has. Returns whether it has just
/// those.
bool write_tag(Message& message, const std::optional<std::string>& known_tag,
               const std::vector<std::string_view>& texts) {
  if (!known_tag) return false;
  const auto tag = make_definitions_tag(texts);
  message.add_text(definitions_element, message.store(std::string_view(tag)));
  return tag == *known_tag;
}

void add_text_list(Message& message, std::string_view name, const std::vector<std::string_view>& texts) {
  message.begin_nested(name, DataType::list_t);
  std::int32_t number = 0;
  for (const auto text : texts)
    message.add_numbered(number++, DataType::string_t, static_cast<std::uint32_t>(text.size()), as_bytes(text));
  message.end_nested();
}

void add_implements(Message& message, const EntityDefinition& type) {
  if (type.implements.empty()) return;
  std::vector<std::string_view> names;
  for (const auto& base : type.implements) names.push_back(implements_name(type, base));
  add_text_list(message, "objectimplements", names);
}

}  // namespace

void ServiceSession::handle_special(const Message& message, Now now) {
  const auto& header = message.header;
  const auto& self = directory_.identity();
  const bool is_for_us = header.receiver_node_id == self.id ||
                         (header.receiver_node_id.is_any() &&
                          (header.receiver_node_name.empty() || header.receiver_node_name == self.name));
  outgoing_.clear();
  told_attributes_ = {};
  session_attributes_ = {};
  outgoing_.header.receiver_node_id = header.sender_node_id;
  outgoing_.header.receiver_node_name = header.sender_node_name;
  outgoing_.header.sender_endpoint = header.receiver_endpoint;
  outgoing_.header.receiver_endpoint = header.sender_endpoint;
  bool is_refused = false;
  for (const auto& entry : message.entries) {
    if (static_cast<std::uint16_t>(entry.type) % 2 == 0) continue;  // replies are not for a service
    outgoing_.begin_entry(reply_type(entry.type), entry.service_path, entry.member_name, entry.request_id);
    const bool had_login = login_ != nullptr;
    const bool was_leaving = leaving_ != nullptr;
    const bool is_of_node = entry.type == EntryType::get_node_info || entry.type == EntryType::node_check_capability;
    const bool is_unwanted = options_.refusal && !is_of_node;
    const Result<> done = !is_for_us    ? make_error(ErrorCode::node_not_found, "Could not find route to remote node")
                          : is_unwanted ? Result<>(*options_.refusal)
                                        : answer_special(message, entry, now);
    is_refused = is_refused || is_unwanted;
    if (!done) {
      // A failure may leave a half-built entry behind: it starts anew.
      outgoing_.elements.resize(outgoing_.entries.back().first_element);
      outgoing_.entries.pop_back();
      outgoing_.begin_entry(reply_type(entry.type), entry.service_path, entry.member_name, entry.request_id);
      write_error(outgoing_, done.error());
    } else if ((login_ && !had_login) || (leaving_ && !was_leaving)) {
      outgoing_.entries.pop_back();  // it is answered once the login is judged, or the client's things are given up
    }
  }
  if (!outgoing_.entries.empty()) send_outgoing(now);
  outgoing_ = {};  // such answers are rare and long: what theirs took is not kept
  if (is_refused) leave(*options_.refusal, now);
}

/// Whoever logs in as he connects is asked about as whom he has logged in.
Result<> ServiceSession::admit_special(const Message& message, const MessageEntry& entry) const {
  switch (entry.type) {
    case EntryType::connect_client_combined:
      if (has_login(message, entry)) return {};
      break;
    case EntryType::get_service_desc:
    case EntryType::object_type_name:
    case EntryType::connect_client:
    case EntryType::get_service_attributes:
      break;
    default:
      return {};
  }
  const bool names_object = entry.type == EntryType::object_type_name;
  return admit(entry.type, names_object ? entry.service_path : service_name_of(entry), nullptr);
}

Result<> ServiceSession::answer_special(const Message& message, const MessageEntry& entry, Now now) {
  if (auto admitted = admit_special(message, entry); !admitted) return admitted;
  switch (entry.type) {
    case EntryType::get_service_desc:
      return write_service_desc(message, entry);
    case EntryType::object_type_name:
      return write_root_type(message, entry);
    case EntryType::connect_client:
      if (auto service = directory_.find(entry.service_path))
        return connect(std::move(service), message.header.sender_node_id, message.header.sender_endpoint, std::nullopt,
                       now);
      return missing_service(entry.service_path);
    case EntryType::connect_client_combined:
      return write_combined(message, entry, now);
    case EntryType::disconnect_client:
      return disconnect(message, entry, now);
    case EntryType::get_node_info:
      return {};  // the header says it all
    case EntryType::node_check_capability:
      outgoing_.add_scalar("return", DataType::uint32_t, std::uint32_t{0});
      return {};
    case EntryType::get_service_attributes: {
      const auto service = directory_.find(service_name_of(entry));
      if (!service) return make_error(ErrorCode::service_error, "Service not found");
      // Once a message: it is a long answer to a short question.
      const bool tells_losses = service == service_ && may_use_service() && told_attributes_.is_null();
      if (tells_losses) told_attributes_ = attributes_with_losses();
      return tells_losses ? pack_varvalue(outgoing_, "return", told_attributes_, service->types())
                          : write_attributes("return", *service);
    }
    default:
      return protocol_error("Invalid Special Operation");
  }
}

Result<> ServiceSession::write_attributes(std::string_view element, const HostedService& service) {
  if (options_.attributes.items.empty() || !session_attributes_.is_null())  // once a message, which borrows them
    return pack_varvalue(outgoing_, element, service.attributes(), service.types());
  session_attributes_ = Value(attributes_of(service));
  return pack_varvalue(outgoing_, element, session_attributes_, service.types());
}

/// From `clientversion`; unspecified where it is absent.
Result<Version> ServiceSession::read_client_version(const Message& message, const MessageEntry& entry) {
  const auto* element = message.elements_of(entry).find("clientversion");
  if (!element) return Version{};
  auto version = element->type == DataType::string_t
                     ? parse_version(element->text())
                     : Result<Version>(make_error(ErrorCode::data_type_mismatch, "not a string"));
  if (!version) return make_error(ErrorCode::invalid_argument, "clientversion: " + version.error().message);
  return version;
}

Result<> ServiceSession::write_service_desc(const Message& message, const MessageEntry& entry) {
  const auto version = read_client_version(message, entry);
  if (!version) return version.error();
  const auto* type = find_text(message, entry, "ServiceType");
  if (!type) type = find_text(message, entry, "servicetype");
  if (type) {
    // Services of a node may have definitions of one name and two texts: the one that the client asks counts.
    const auto* definition = find_definition(entry.service_path, type->text());
    if (!definition) return service_not_found();
    if (!write_tag(outgoing_, read_known_tag(message, entry), {definition->text}))
      outgoing_.add_text("servicedef", definition->text);
    return {};
  }
  const auto service = directory_.find(entry.service_path);
  if (!service) return missing_service(entry.service_path);
  const auto* root = service->type_for_client(service->root_type(), *version);
  if (!root) return service_not_found();
  if (auto packed = write_attributes("attributes", *service); !packed) return packed;
  if (const auto extra = service->extra_imports_for_client(*version); !extra.empty())
    add_text_list(outgoing_, "extraimports", extra);
  keep_types(*service);
  outgoing_.add_text("servicedef", service->definition_of(*root).text);
  return {};
}

Error ServiceSession::missing_service(std::string_view name) const {
  const bool is_told = options_.why_missing && admits(EntryType::null, name, nullptr);
  return (is_told ? options_.why_missing(name) : std::nullopt).value_or(service_not_found());
}

const TypeRegistry& ServiceSession::keep_types(const HostedService& service) {
  outgoing_.keep_alive(service.shared_types());
  return service.types();
}

/// Of one service, else of any other that the client may know of.
const ServiceDefinition* ServiceSession::find_definition(std::string_view service, std::string_view name) {
  if (const auto asked = directory_.find(service))
    if (const auto* definition = keep_types(*asked).find_service(name)) return definition;
  for (const auto& [service_name, other] : directory_.services())
    if (other->types().find_service(name) && admits(EntryType::null, service_name, nullptr))
      return keep_types(*other).find_service(name);
  return nullptr;
}

/// ObjectTypeName without a session: every failure is "Object not found".
Result<> ServiceSession::write_root_type(const Message& message, const MessageEntry& entry) {
  const auto version = read_client_version(message, entry);
  if (!version) return version.error();
  const auto service = directory_.find(service_name_of(entry));
  if (!service) return object_not_found();
  if (service->policy().require_valid_user && entry.service_path != service->name()) return object_not_found();
  auto begun = std::exchange(outgoing_, {});  // the application, which is asked, may have this session send something
  const auto found = service->find_object(entry.service_path, RememberObjects::no);
  outgoing_ = std::move(begun);
  const auto* type = found ? service->type_for_client(*found->type, *version) : nullptr;
  if (!type) return object_not_found();
  keep_types(*service);
  outgoing_.add_text("objecttype", type->qualified_name);
  add_implements(outgoing_, *type);
  return {};
}

Result<> ServiceSession::write_combined(const Message& message, const MessageEntry& entry, Now now) {
  const auto version = read_client_version(message, entry);
  if (!version) return version.error();
  const auto service = directory_.find(entry.service_path);
  const bool logs_in = has_login(message, entry);
  // Who may not connect without a login does not hear by it either what there is.
  if (!service && logs_in && !admits(entry.type, entry.service_path, nullptr)) return login_failed();
  if (!service) return missing_service(entry.service_path);
  const auto* type = service->type_for_client(service->root_type(), *version);
  if (!type) return service_not_found();
  OpenLogin request;
  request.service = service;
  request.client = {message.header.sender_node_id, std::string(message.header.sender_node_name)};
  request.client_endpoint = message.header.sender_endpoint;
  request.client_version = *version;
  request.type_for_client = type;
  const auto* flag = find_text(message, entry, "returnservicedefs");
  const auto wish = flag ? to_lower(trim(flag->text())) : std::string();
  request.wants_definitions = wish != "0" && wish != "false";
  request.known_tag = read_known_tag(message, entry);

  const auto& policy = service->policy();
  // As the reference does: where no user is required, a login in this request fails; AuthenticateUser is for that. In
  // front of a remote service nobody knows what that one requires.
  const bool may_log_in = policy.authenticator && (policy.require_valid_user || service->is_remote());
  if (logs_in ? !may_log_in : policy.require_valid_user) return login_failed();
  if (!logs_in) return accept_combined(request, std::nullopt, now);
  if (service_) return has_session_already();
  if (auto begun = begin_login(message, entry, service, now); !begun) return begun;
  login_->client = std::move(request.client);
  login_->client_endpoint = request.client_endpoint;
  login_->client_version = request.client_version;
  login_->type_for_client = request.type_for_client;
  login_->wants_definitions = request.wants_definitions;
  login_->known_tag = std::move(request.known_tag);
  return {};
}

Result<> ServiceSession::accept_combined(const OpenLogin& request, std::optional<AuthenticatedUser> user, Now now) {
  const auto& service = request.service;
  if (user)
    if (auto admitted = admit(request.type, service->name(), nullptr, &*user); !admitted) return admitted;
  if (auto connected = connect(service, request.client.id, request.client_endpoint, std::move(user), now); !connected)
    return connected;
  outgoing_.add_text("objecttype", request.type_for_client->qualified_name);
  add_implements(outgoing_, *request.type_for_client);
  if (request.wants_definitions) {
    std::vector<std::string_view> texts;
    for (const auto* definition : service->definitions_for_client(*request.type_for_client, request.client_version))
      texts.push_back(definition->text);
    keep_types(*service);
    if (!write_tag(outgoing_, request.known_tag, texts)) add_text_list(outgoing_, "servicedefs", texts);
  }
  return write_attributes("attributes", *service);
}

void ServiceSession::finish_combined(const OpenLogin& login, Result<AuthenticatedUser> result, Now now) {
  const auto begin = [&] {
    outgoing_.clear();
    outgoing_.header.receiver_node_id = login.client.id;
    outgoing_.header.receiver_node_name = login.client.name;
    outgoing_.header.receiver_endpoint = login.client_endpoint;
    outgoing_.begin_entry(reply_type(login.type), login.path, login.member, login.request_id);
  };
  begin();
  const Result<> done = result                        ? accept_combined(login, std::move(*result), now)
                        : is_unjudged(result.error()) ? Result<>(result.error())
                                                      : login_failed();
  if (!done) {
    begin();
    write_error(outgoing_, done.error());
  }
  send_outgoing(now);
}

/// `service` may be null. It may have been withdrawn while a login was judged, and another one be of its name now.
Result<> ServiceSession::connect(std::shared_ptr<HostedService> service, const NodeId& client,
                                 std::uint32_t client_endpoint, std::optional<AuthenticatedUser> user, Now now) {
  if (!service || is_gone_ || directory_.find(service->name()) != service) return service_not_found();
  if (service_) return has_session_already();
  service_ = std::move(service);
  endpoint_ = directory_.endpoints().take(now.steady);
  client_node_ = client;
  last_session_message_ = now.steady;
  connection_.set_endpoints(endpoint_, client_endpoint);
  outgoing_.header.sender_endpoint = endpoint_;
  session_id_ = service_->next_session_id();
  set_user(std::move(user), now);
  if (client_endpoint != 0 && may_use_service()) connection_.authorise();
  events_.push(ClientConnected{service_.get()});
  return {};
}

Result<> ServiceSession::disconnect(const Message& message, const MessageEntry& entry, Now now) {
  const auto* name = find_text(message, entry, "servicename");
  if (!is_of_session(message.header) || !name || name->text() != service_->name()) return service_not_found();
  if (!service_->is_remote()) {
    leave({ErrorCode::none, "the client disconnected"}, now);
  } else if (!leaving_) {
    leaving_ = std::make_unique<OpenLeave>();
    leaving_->client = {message.header.sender_node_id, std::string(message.header.sender_node_name)};
    leaving_->client_endpoint = message.header.sender_endpoint;
    leaving_->path = entry.service_path;
    leaving_->member = entry.member_name;
    leaving_->request_id = entry.request_id;
    parked_.clear();
    events_.push(LeaveWanted{});
  }
  return {};
}

}  // namespace rr
