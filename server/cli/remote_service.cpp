#include "server/cli/remote_service.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>

#include "core/support/utf8.hpp"
#include "node/tls/base64.hpp"
#include "server/cli/printable.hpp"
#include "server/cli/stored_logins.hpp"
#include "server/http/split_path.hpp"
#include "server/json/value_from_json.hpp"

namespace rrgate {

namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): there is one thread
  return value ? value : "";
}

/// Empty: no login.
std::string authorization(const StoredLogin& login) {
  if (!login.token.empty()) return "Bearer " + login.token;
  if (!login.user.empty()) return "Basic " + rr::encode_base64(rr::as_bytes(login.user + ":" + login.password));
  return {};
}

/// What a gateway refuses a WebSocket for, it says in HTTP.
bool is_refusal(std::string_view text) {
  return text.find("refused with status 401") != std::string_view::npos ||
         text.find("refused with status 403") != std::string_view::npos;
}

std::string member_names(const rr::EntityDefinition& type) {
  std::string out;
  for (const auto& member : type.members) out += (out.empty() ? "" : ", ") + member.name;
  return out.empty() ? "none" : out;
}

struct ReadArgument {
  std::string source;  ///< for errors
  std::string content;
};

/// The line end with which editors and `echo` end text is no part of it.
std::string read_text(std::istream& in) {
  std::string out(std::istreambuf_iterator<char>(in), {});
  for (const std::string_view line_end : {"\r\n", "\n"})
    if (out.ends_with(line_end)) return out.substr(0, out.size() - line_end.size());
  return out;
}

/// Throws   NotUnderstood: the file can't be read.
ReadArgument read_argument(std::string_view text) {
  if (text == "-") return {"standard input", read_text(std::cin)};
  if (!text.starts_with("@")) return {rr::quote(text), std::string(text)};
  const auto source = "file " + rr::quote(text.substr(1));
  std::ifstream file{std::string(text.substr(1)), std::ios::binary};
  if (!file) throw NotUnderstood(source + " can't be read");
  return {source, read_text(file)};
}

}  // namespace

CLI::Option* add_url(CLI::App& app, RemoteOptions& options) {
  auto* const option = app.add_option("URL", options.url, "A service, as \"rrgate ls\" prints it");
  return takes_websocket_url(option)->option_text(" ");
}

CLI::Option* takes_websocket_url(CLI::Option* option) {
  return option->transform([](const std::string& url) {
    const bool is_page_url = url.starts_with("ws://") || url.starts_with("wss://");
    return is_page_url ? "http" + url.substr(2) : url;
  });
}

void add_connection_options(CLI::App& app, RemoteOptions& options) {
  app.footer(
      "Exit codes: 0 done; 1 failed; 2 wrong options, URL, member or arguments; 3 not reached, lost or no answer in "
      "time; 4 refused; 5 error of the device");
  app.add_option("--user", options.user, "Log in, with the password of $RRGATE_PASSWORD")->option_text("NAME");
  app.add_option("--timeout", options.timeout, "Limit for connecting and for each request")
      ->check([](const std::string& text) {
        double seconds = 0;
        const bool is_good = CLI::detail::lexical_cast(text, seconds) && seconds > 0 && seconds <= 86'400;
        return is_good ? std::string() : "found " + rr::quote(text) + ", expected seconds, 86400 at most";
      })
      ->option_text("SECONDS [10]");
}

CLI::Option* add_json(CLI::App& app, RemoteOptions& options) {
  return app.add_flag("--json", options.is_json, "One line of JSON for each value");
}

CLI::Option* add_count(CLI::App& app, const std::string& name, std::uint32_t& count, const std::string& summary) {
  return app.add_option(name, count, summary)->check(CLI::Range(1, 1'000'000'000))->option_text("N");
}

std::string user_password() {
  auto out = environment("RRGATE_PASSWORD");
  if (out.empty()) throw NotUnderstood("--user needs the password in the environment: RRGATE_PASSWORD");
  return out;
}

RemoteAddress remote_address(const RemoteOptions& options) {
  RemoteAddress out;
  const auto& [url, user, timeout, is_json] = options;
  out.timeout = std::chrono::milliseconds(static_cast<std::int64_t>(timeout * 1000));
  out.options.request_timeout = out.options.connect_timeout = out.timeout;
  const auto password = user.empty() ? std::string() : user_password();
  out.url = gateway_url(url);
  if (out.url.empty()) {
    out.url = url;
    out.options.username = user;
    rr::MapString credentials;
    credentials.items.emplace_back("password", rr::Value(password));
    if (!user.empty()) out.options.credentials = rr::Value(std::move(credentials));
  } else {
    StoredLogin login{user, password, user.empty() ? environment("RRGATE_TOKEN") : ""};
    if (login.user.empty() && login.token.empty()) login = find_stored_login(gateway_base(url));
    const auto header = authorization(login);
    if (!header.empty()) out.options.dial.headers.emplace_back("Authorization", header);
  }
  if (const auto parsed_url = rr::parse_url(out.url, rr::ServiceInUrl::optional); !parsed_url)
    throw NotUnderstood(parsed_url.error().message);
  return out;
}

rr::RemoteObject open_service(const RemoteAddress& address) {
  if (const auto parsed = rr::parse_url(address.url); !parsed)
    throw NotUnderstood(parsed.error().message + "; rrgate ls lists services");
  try {
    return rr::connect(address.url, address.options);
  } catch (const rr::Exception& failure) {
    auto error = failure.error();
    // The gateway has taken the login in the header, else there would be no WebSocket.
    if (error.code != rr::ErrorCode::authentication_error || address.options.dial.headers.empty()) throw;
    error.message +=
        "; the login was for the gateway, and the device wants one of its own: \"login\" of a shared device in the "
        "gateway's configuration";
    throw rr::ClientException(std::move(error));
  }
}

std::string address_of_page(std::string_view url) {
  constexpr std::string_view mark = "#/devices/";
  const auto at = url.find(mark);
  if (at == std::string_view::npos) return std::string(url);
  auto path = url.substr(at + mark.size());
  path = path.substr(0, path.find('?'));
  const auto slash = path.find('/');
  const auto device = path.substr(0, slash);
  const auto service = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
  if (device.empty() || service.find('/') != std::string_view::npos) return std::string(url);  // of an object
  return gateway_base(url) + "/devices/" + std::string(device) +
         (service.empty() ? "" : "?service=" + std::string(service));
}

std::string gateway_url(std::string_view url) {
  const auto address = address_of_page(url);
  for (const auto& [web, native] : {std::pair{"http://", "rr+ws://"}, std::pair{"https://", "rr+wss://"}})
    if (address.starts_with(web)) return native + address.substr(std::string_view(web).size());
  return {};
}

std::string gateway_base(std::string_view url) {
  url = url.substr(0, url.find_first_of("?#"));
  url = url.substr(0, url.find("/devices/"));
  while (url.ends_with('/')) url.remove_suffix(1);
  return std::string(url);
}

rr::RemoteObject open_gateway(RemoteAddress address) {
  // By this path whatever its node is called: one with a single relayed device leads whoever asks at "/" to that.
  address.url = gateway_base(address.url) + "/gateway?service=gateway";
  return open_service(address);
}

RemoteMember find_member(const rr::RemoteObject& root, std::string_view path) {
  RemoteMember out{root};
  const auto look_at = [&](const rr::RemoteObject& object) {
    out.object = object;
    out.type = out.types().find_entity(object.type_name());
    if (!out.type) throw NotUnderstood("the type of " + rr::quote(object.path()) + " is not known");
  };
  look_at(root);
  const auto segments = split_path(path);
  if (!segments)
    throw NotUnderstood(rr::quote(path) + " is no path of a member; expected \"position\" or \"axes/0/position\"");
  for (std::size_t i = 0; i < segments->size(); ++i) {
    const auto& name = (*segments)[i];
    const auto* member = out.type->find_member(name);
    if (!member)
      throw NotUnderstood("no member " + rr::quote(name) + " in " + out.type->qualified_name +
                          "; it has: " + member_names(*out.type));
    if (member->kind != rr::MemberKind::objref) {
      if (i + 1 != segments->size()) throw NotUnderstood(rr::quote(name) + " is no object: nothing is below it");
      out.member = member;
      break;
    }
    if (member->is_indexed() && ++i == segments->size())
      throw NotUnderstood("objref " + rr::quote(name) + " needs an index: " + name + "/INDEX");
    look_at(member->is_indexed() ? out.object.object(name, (*segments)[i]) : out.object.object(name));
  }
  return out;
}

void expect_kind(const RemoteMember& found, const std::vector<rr::MemberKind>& kinds, std::string_view verb) {
  std::string expected;
  for (const auto kind : kinds) {
    if (found.member && found.member->kind == kind) return;
    expected += (expected.empty() ? "" : ", ") + std::string(rr::member_kind_name(kind));
  }
  const auto what =
      found.member ? rr::quote(found.member->name) + " is a " + std::string(rr::member_kind_name(found.member->kind))
                   : rr::quote(found.object.path()) + " is an object";
  throw NotUnderstood(what + "; " + std::string(verb) + " expects one of: " + expected);
}

rr::Json read_json_argument(std::string_view text, const rr::TypeDefinition& type) {
  const auto [source, content] = read_argument(text);
  if (!rr::is_utf8(content)) throw NotUnderstood(source + " is not UTF-8");
  const bool is_one = type.container == rr::ContainerKind::none && type.array == rr::ArrayKind::none;
  const bool takes_text = is_one && type.type == rr::DataType::string_t;
  const bool takes_word = takes_text || (is_one && type.type == rr::DataType::enum_t);
  auto json = rr::read_json(content);
  if (json && (!takes_text || json->is_string())) return std::move(*json);
  // What a shell makes of "red" is red, and 5 is text where text is wanted.
  const bool is_word = !content.starts_with('{') && !content.starts_with('[');
  if (takes_text || (takes_word && is_word)) return rr::Json(content);
  throw NotUnderstood(source + " is not JSON: " + json.error().message);
}

rr::OrderedJson to_json(const rr::Value& value, const rr::TypeDefinition& type, const rr::TypeRegistry& types) {
  auto json = rr::value_to_json(value, type, types);
  if (!json) throw rr::ClientException(json.error());
  return std::move(*json);
}

std::string text_for_output(const std::string& text) {
  return ::isatty(STDOUT_FILENO) ? printable(text, LineEnds::kept) : text;
}

void print_value(const rr::OrderedJson& json, bool is_json) {
  if (is_json)
    std::cout << rr::write_json(json);
  else if (json.is_string())
    std::cout << text_for_output(json.get_ref<const std::string&>());
  else
    std::cout << text_for_output(json.dump(json.is_object() ? 2 : -1));
  std::cout << std::endl;  // whoever reads a pipe sees each value as it comes
}

int exit_code_of(const rr::Exception& failure) {
  using enum rr::ErrorCode;
  if (is_refusal(failure.what())) return exit_refused;
  switch (failure.error().code) {
    case connection_error:
    case request_timeout:
    case node_not_found:
    case service_not_found:
    case endpoint_communication_fatal_error:
      return exit_unreachable;
    case authentication_error:
    case permission_denied:
    case object_locked_error:
      return exit_refused;
    case read_only_member:
    case write_only_member:
      return exit_usage;
    default:
      return exit_device_error;
  }
}

int run_remote(std::string_view command, std::string_view url, const std::function<void()>& run) {
  const auto tell = [&](std::string_view what, int code) {
    for (const auto& each : {std::string(url), gateway_url(url)}) {  // named once, as it was given
      const auto named = "URL " + rr::quote(each, 200) + ": ";
      if (what.starts_with(named)) what.remove_prefix(named.size());
    }
    std::cerr << "rrgate " << command << ": " << url << ": " << printable(what) << "\n";
    return code;
  };
  try {
    run();
    return exit_ok;
  } catch (const NotUnderstood& mistake) {
    return tell(mistake.what(), exit_usage);
  } catch (const rr::Exception& failure) {
    return tell(failure.what(), exit_code_of(failure));
  } catch (const std::exception& failure) {
    return tell(failure.what(), exit_failed);
  }
}

}  // namespace rrgate
