// rrgate health: asks a running gateway whether it is well; for containers, which have no curl. Layer: server/cli.
#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/support/error.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

namespace {

struct Address {
  std::string host;
  std::string port;
};

/// "HOST:PORT", "[IPv6]:PORT"; nullopt for anything else.
std::optional<Address> parse_address(std::string_view text) {
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size()) return std::nullopt;
  auto host = text.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return Address{std::string(host), std::string(text.substr(colon + 1))};
}

/// What comes back, as far as it comes within the time; empty where the connection is closed without an answer.
/// nullopt: nobody is there, or whoever is says nothing.
std::optional<std::string> ask_once(const addrinfo& address, const std::string& request) {
  const int socket = ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC, address.ai_protocol);
  if (socket < 0) return std::nullopt;
  const timeval patience{3, 0};
  ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  ::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
  std::optional<std::string> out;
  if (::connect(socket, address.ai_addr, address.ai_addrlen) == 0 &&
      ::send(socket, request.data(), request.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(request.size())) {
    char buffer[64];
    const auto size = ::recv(socket, buffer, sizeof(buffer), MSG_WAITALL);
    if (size >= 0)
      out.emplace(buffer, static_cast<std::size_t>(size));
    else if (errno == ECONNRESET)
      out.emplace();
  }
  ::close(socket);
  return out;
}

/// The head of the answer, as far as it came within the time; empty where nobody answers.
std::string ask(const Address& address, std::string_view path) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found) != 0) return {};
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  const auto request = "GET " + std::string(path) + " HTTP/1.0\r\nHost: localhost\r\n\r\n";
  std::string answer;
  for (const auto* each = found; each && answer.empty(); each = each->ai_next) {
    auto received = ask_once(*each, request);
    // A gateway closes it that takes its own machine for a proxy and has "proxy_protocol": "required".
    if (received && received->empty()) received = ask_once(*each, "PROXY UNKNOWN\r\n" + request);
    if (received) answer = std::move(*received);
  }
  return answer;
}

struct HealthOptions {
  std::string address = "127.0.0.1:8080";
  bool asks_ready = false;
  bool is_json = false;
};

int ask_health(const HealthOptions& options) {
  const auto address = parse_address(options.address);
  if (!address) return usage_error("health", rr::quote(options.address) + ": expected HOST:PORT");
  const auto answer = ask(*address, options.asks_ready ? "/readyz" : "/healthz");
  const auto line = answer.substr(0, answer.find('\r'));
  const bool is_well = line.find(" 200 ") != std::string::npos;
  if (options.is_json) {
    print_json_line({{"address", address->host + ":" + address->port}, {"good", is_well}, {"answer", line}});
    return is_well ? exit_ok : exit_failed;
  }
  (is_well ? std::cout : std::cerr) << address->host << ":" << address->port << ": "
                                    << (line.empty() ? "no answer" : line) << '\n';
  return is_well ? exit_ok : exit_failed;
}

}  // namespace

void add_health(Commands& commands) {
  const auto [app, options] = commands.add("health", "Check the health of a running gateway", ask_health);
  app.add_option("ADDRESS", options.address, "Address of the gateway")
      ->capture_default_str()
      ->option_text("[127.0.0.1:8080]");
  app.add_flag("--ready", options.asks_ready, "Ask whether it accepts clients");
  app.add_flag("--json", options.is_json, "Print the answer as one line of JSON");
}

}  // namespace rrgate
