// What a proxy says of its clients, with what the clients have put in front of it: the PROXY header of a connection,
// and the headers Forwarded, X-Forwarded-* and Cookie of a request. The first byte chooses.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "server/front/proxy_protocol.hpp"
#include "server/http/forwarded.hpp"
#include "server/http/sign_in_cookie.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rrgate;
namespace ip = boost::asio::ip;

constexpr std::size_t largest_value = 60'000;  // Beast takes no longer ones

void require(bool holds, const char* rule) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", rule);
  std::abort();
}

/// However it arrives, it is the same header.
void check_proxy_header(rr::ByteSpan bytes) {
  const auto whole = parse_proxy_header(bytes);
  require(!whole || whole->size <= std::min(bytes.size(), largest_proxy_header), "a header is within what has come");
  require(whole || whole.error().message.size() < 1000, "an error is a sentence");
  const auto all = std::min(bytes.size(), largest_proxy_header + 16);
  for (std::size_t arrived = 0; arrived < all; ++arrived) {
    const auto part = parse_proxy_header(bytes.first(arrived));
    if (part && part->size == 0) continue;
    require(part.has_value() == whole.has_value(), "what is broken in part is broken as a whole");
    if (part) require(part->size == whole->size && part->client == whole->client, "what is complete stays as it is");
    return;
  }
}

/// Lines: what header it is, one letter, and its value. False: no HTTP request has such.
bool add_headers(HttpRequest& request, std::string_view text) {
  for (std::size_t begin = 0; begin < text.size();) {
    const auto end = std::min(text.find('\n', begin), text.size());
    const auto line = text.substr(begin, end - begin);
    begin = end + 1;
    if (line.empty()) continue;
    const auto value = line.substr(1);
    if (value.size() > largest_value) return false;
    for (const char c : value)
      if ((static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f) return false;
    const auto* const name = line[0] == 'f'   ? "X-Forwarded-For"
                             : line[0] == 'p' ? "X-Forwarded-Proto"
                             : line[0] == 'h' ? "X-Forwarded-Host"
                             : line[0] == 'x' ? "X-Forwarded-Prefix"
                             : line[0] == 'c' ? "Cookie"
                             : line[0] == 'o' ? "Host"
                                              : "Forwarded";
    request.message.insert(name, value);
  }
  return true;
}

void check_arrival(const HttpRequest& request, const Arrival& seen) {
  const bool is_host_of_request = seen.host == request.header(http::field::host);
  require(is_host_of_request || (!seen.host.empty() && seen.host.size() <= 255), "a host is one");
  require(is_path_prefix(seen.prefix), "a prefix is one");
  require(plain_address(seen.address) == seen.address, "an address has one form");
  require(!seen.peer.empty() && seen.peer.size() < 100, "a client has a name");
}

void check_headers(std::string_view text, ForwardedBy kind) {
  static const auto proxies = *parse_address_range("10.0.0.0/8");
  const ProxyTrust trust{{proxies}, kind};
  const Peer proxy{{ip::make_address("10.0.0.1"), 40000}, false};
  const Peer stranger{{ip::make_address("192.0.2.1"), 40000}, false};
  HttpRequest request;
  request.message.target("/robots/api");
  if (!add_headers(request, text)) return;

  request.arrival = see_through_proxies(request, proxy, trust);
  check_arrival(request, request.arrival);
  const auto cookie = sign_in_cookie(request);
  require(cookie.find(';') == std::string_view::npos, "a cookie ends before the next");
  const auto kept = format_sign_in_cookie(request.arrival, "abc");
  require(kept.find("; HttpOnly") != std::string::npos, "a cookie is out of reach for scripts");
  take_base_path(request, "/robots");
  require(request.path() == "/api" && request.arrival.prefix.ends_with("/robots"), "the base path is taken off");

  const auto direct = see_through_proxies(request, stranger, trust);
  require(direct.address == stranger.endpoint.address() && !direct.is_encrypted && direct.prefix.empty() &&
              direct.host == request.header(http::field::host),
          "who is no proxy says nothing");

  // Whatever is in front of it, what the proxy has added counts.
  if (kind == ForwardedBy::forwarded)
    request.message.insert("Forwarded", "for=203.0.113.9;proto=https");
  else
    request.message.insert("X-Forwarded-For", "203.0.113.9");
  const auto behind = see_through_proxies(request, proxy, trust);
  check_arrival(request, behind);
  require(behind.address == ip::make_address("203.0.113.9"), "a client has no address but that which its proxy saw");
  require(behind.is_encrypted || kind != ForwardedBy::forwarded, "a client's scheme is that which its proxy saw");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size == 0) return 0;
  const auto rest = rr::ByteSpan(data, size).subspan(1);
  if (data[0] == 'p')
    check_proxy_header(rest);
  else
    check_headers(rr::as_text(rest), data[0] == 'x' ? ForwardedBy::x_forwarded : ForwardedBy::forwarded);
  return 0;
}
