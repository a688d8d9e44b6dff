// rrgate health: asks a running gateway whether it is well; for containers, which have no curl. Layer: server/cli.
#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <iostream>
#include <memory>

#include "core/support/error.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

namespace {

struct Address {
  std::string host = "127.0.0.1";
  std::string port = "8080";
};

/// "HOST:PORT", "[IPv6]:PORT"; nullopt for anything else.
std::optional<Address> parse_address(std::string_view text) {
  const auto colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0 || colon + 1 == text.size()) return std::nullopt;
  auto host = text.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return Address{std::string(host), std::string(text.substr(colon + 1))};
}

/// The head of the answer, as far as it came within the time; empty where nobody answers.
std::string ask(const Address& address, std::string_view path) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found) != 0) return {};
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  std::string answer;
  for (const auto* each = found; each && answer.empty(); each = each->ai_next) {
    const int socket = ::socket(each->ai_family, each->ai_socktype | SOCK_CLOEXEC, each->ai_protocol);
    if (socket < 0) continue;
    const timeval patience{3, 0};
    ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    ::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    const auto request = "GET " + std::string(path) + " HTTP/1.0\r\nHost: localhost\r\n\r\n";
    if (::connect(socket, each->ai_addr, each->ai_addrlen) == 0 &&
        ::send(socket, request.data(), request.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(request.size())) {
      char buffer[64];
      const auto size = ::recv(socket, buffer, sizeof(buffer), MSG_WAITALL);
      if (size > 0) answer.assign(buffer, static_cast<std::size_t>(size));
    }
    ::close(socket);
  }
  return answer;
}

}  // namespace

int run_health(Arguments arguments) {
  constexpr std::string_view flags[] = {"--ready"};
  const auto parsed = parse_arguments(arguments, {{}, flags});
  if (!parsed.error.empty()) return usage_error("health", parsed.error);
  if (parsed.operands.size() > 1) return usage_error("health", "unexpected " + rr::quote(parsed.operands[1]));
  Address address;
  if (!parsed.operands.empty()) {
    const auto given = parse_address(parsed.operands.front());
    if (!given) return usage_error("health", rr::quote(parsed.operands.front()) + ": expected HOST:PORT");
    address = *given;
  }
  const auto answer = ask(address, parsed.flags.contains("--ready") ? "/readyz" : "/healthz");
  const auto line = answer.substr(0, answer.find('\r'));
  const bool is_well = line.find(" 200 ") != std::string::npos;
  (is_well ? std::cout : std::cerr) << address.host << ":" << address.port << ": "
                                    << (line.empty() ? "no answer" : line) << '\n';
  return is_well ? exit_ok : exit_failed;
}

}  // namespace rrgate
