// rrgate info, robdef: what a service says of itself. Layer: server/cli.
#include <iostream>

#include "core/session/service_path.hpp"
#include "server/cli/printable.hpp"
#include "server/cli/recording_file.hpp"
#include "server/cli/remote_service.hpp"

namespace rrgate {

namespace {

std::string parameters_text(const rr::MemberDefinition& member) {
  std::string out;
  for (const auto& parameter : member.parameters)
    out += (out.empty() ? "" : ", ") + rr::format_type(parameter.type) + " " + parameter.name;
  return "(" + out + ")";
}

/// "function double move_to(double[] joints)", as a service definition says it.
std::string declaration(const rr::MemberDefinition& member) {
  std::string out(rr::member_kind_name(member.kind));
  if (member.kind != rr::MemberKind::event) out += " " + rr::format_type(member.type);
  out += " " + member.name;
  const bool has_parameters = member.kind == rr::MemberKind::function || member.kind == rr::MemberKind::event ||
                              member.kind == rr::MemberKind::callback;
  if (has_parameters) out += parameters_text(member);
  if (!member.modifiers.empty()) {
    out += " [";
    for (const auto& modifier : member.modifiers) out += (out.ends_with("[") ? "" : ", ") + modifier.name;
    out += "]";
  }
  return out;
}

/// Of documentation, where it mostly begins with the space behind "##".
std::string first_line(const std::string& text) {
  const auto line = text.substr(0, text.find('\n'));
  return line.starts_with(' ') ? line.substr(1) : line;
}

rr::OrderedJson describe(const RemoteMember& object) {
  auto out = rr::OrderedJson::object();
  out["path"] = object.object.path();
  out["type"] = object.type->qualified_name;
  auto implements = rr::OrderedJson::array();
  for (const auto& each : object.type->implements) implements.push_back(each.name);
  out["implements"] = std::move(implements);
  out["documentation"] = object.type->documentation;
  out["attributes"] = rr::OrderedJson::object();
  auto members = rr::OrderedJson::array();
  for (const auto& member : object.type->members) {
    auto each = rr::OrderedJson::object();
    each["name"] = member.name;
    each["kind"] = rr::member_kind_name(member.kind);
    each["declaration"] = declaration(member);
    each["documentation"] = member.documentation;
    members.push_back(std::move(each));
  }
  out["members"] = std::move(members);
  return out;
}

/// What the service says of itself, as "ServiceAttributes" of discovery has it.
rr::OrderedJson attributes_of(const rr::RemoteObject& root, const rr::TypeRegistry& types) {
  rr::TypeDefinition type;
  type.type = rr::DataType::varvalue_t;
  type.container = rr::ContainerKind::map_string;
  return to_json(rr::Value(root.connection().attributes()), type, types);
}

bool is_device_of_gateway(std::string_view url) {
  return url.starts_with("http") && url.find("/devices/") != std::string_view::npos;
}

/// Locks at, above and below an object, as the gateway's own service lists them. Robot Raconteur itself has no question
/// for them.
rr::OrderedJson locks_of(const RemoteAddress& address, std::string_view path) {
  auto url = rr::parse_url(address.url).value();
  if (url.path.ends_with('/')) url.path.pop_back();
  const auto gateway = open_gateway(address);
  const auto found = find_member(gateway, "locks");
  auto out = rr::OrderedJson::array();
  for (auto& lock : to_json(gateway.get("locks"), found.member->type, found.types())) {
    const auto locked = lock["path"].get<std::string>();
    const bool is_here = url.path.ends_with("/devices/" + rr::percent_encode(lock["device"].get<std::string>())) &&
                         lock["service_name"] == url.service;
    if (!is_here || !(rr::is_within(locked, path) || rr::is_within(path, locked))) continue;
    lock.erase("device");
    lock.erase("service_name");
    out.push_back(std::move(lock));
  }
  return out;
}

/// "monitor lock arm.tool: a client of user alice".
std::string lock_text(const rr::OrderedJson& lock) {
  const auto kind = lock["kind"].get<std::string>();
  const auto user = lock["user"].get<std::string>();
  auto holder = user.empty() ? "" : "user " + user;
  if (kind != "user") holder = holder.empty() ? "a client" : "a client of " + holder;
  return (kind == "monitor" ? "monitor lock " : "lock ") + lock["path"].get<std::string>() + ": " + holder;
}

void print_description(const rr::OrderedJson& description) {
  const auto print_line = [](const std::string& text) { std::cout << printable(text) << "\n"; };
  print_line(description["path"].get<std::string>() + ": " + description["type"].get<std::string>());
  if (const auto text = description["documentation"].get<std::string>(); !text.empty())
    print_line("  " + first_line(text));
  for (const auto& [name, value] : description["attributes"].items())
    print_line("  attribute " + name + ": " + rr::write_json(value));
  if (description.contains("locks"))
    for (const auto& lock : description["locks"]) print_line("  " + lock_text(lock));
  for (const auto& member : description["members"]) {
    print_line("  " + member["declaration"].get<std::string>());
    if (const auto text = member["documentation"].get<std::string>(); !text.empty())
      print_line("      " + first_line(text));
  }
}

struct InfoOptions : RemoteOptions {
  std::vector<std::string> more;  ///< of a service, the object; of a recording, its further files
};

int info(const InfoOptions& options) {
  if (is_recording_file(options.url)) {
    std::vector<std::string> files{options.url};
    files.insert(files.end(), options.more.begin(), options.more.end());
    return print_recording(files, options.is_json);
  }
  if (options.more.size() > 1)
    return usage_error("info", "expected one object or member, found also " + options.more[1]);
  const auto object = options.more.empty() ? std::string() : options.more.front();
  return run_remote("info", options.url, [&] {
    const auto address = remote_address(options);
    const auto root = open_service(address);
    const auto found = find_member(root, object);
    auto description = describe(found);
    if (is_device_of_gateway(options.url)) {
      try {
        description["locks"] = locks_of(address, found.object.path());
      } catch (const std::exception& refusal) {  // what the service is can be told all the same
        std::cerr << "rrgate info: the gateway does not tell of locks: " << refusal.what() << "\n";
      }
    }
    if (object.empty()) description["attributes"] = attributes_of(root, found.types());
    if (found.member) {  // one member alone
      auto& members = description["members"];
      const auto is_other = [&](const auto& each) { return each["name"] != found.member->name; };
      members.erase(std::remove_if(members.begin(), members.end(), is_other), members.end());
    }
    if (options.is_json)
      print_value(description, true);
    else
      print_description(description);
  });
}

int robdef(const RemoteOptions& options) {
  return run_remote("robdef", options.url, [&] {
    const auto root = open_service(remote_address(options));
    const auto& definitions = root.connection().asynchronous().session().types().definitions();
    if (options.is_json) {
      auto list = rr::OrderedJson::array();
      for (const auto& definition : definitions)
        list.push_back({{"name", definition->name}, {"text", definition->text}});
      return print_value(list, true);
    }
    std::string separator;
    for (const auto& definition : definitions) {
      std::cout << separator << text_for_output(definition->text);
      separator = definition->text.ends_with("\n") ? "\n" : "\n\n";
    }
    std::cout << std::endl;
  });
}

}  // namespace

void add_info(Commands& commands) {
  const auto [app, options] = commands.add("info", "Describe an object or a recording", info);
  auto* const url =
      app.add_option("URL", options.url, "A service, as \"rrgate ls\" prints it, or a file of \"rrgate record\"");
  takes_websocket_url(url)->required()->option_text(" ");
  app.add_option("OBJECT", options.more,
                 "Path of an object or member; default: the root object. Of a recording: its further files")
      ->option_text(" ");
  add_json(app, options);
  add_connection_options(app, options);
}

void add_robdef(Commands& commands) {
  const auto [app, options] = commands.add("robdef", "Print the service definitions of a service", robdef);
  add_url(app, options)->required();
  add_json(app, options);
  add_connection_options(app, options);
}

}  // namespace rrgate
