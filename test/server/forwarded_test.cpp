// What trusted proxies say about clients, and what others can't.
#include "server/http/forwarded.hpp"

#include <catch2/catch.hpp>

#include "server/front/proxy_protocol.hpp"
#include "server/state/admission.hpp"

using namespace rrgate;

namespace {

namespace ip = boost::asio::ip;
using Headers = std::vector<std::pair<std::string, std::string>>;

HttpRequest request_with(const Headers& headers, const std::string& target = "/") {
  HttpRequest request;
  request.message.target(target);
  request.message.set("Host", "gw:8080");
  for (const auto& [name, value] : headers) request.message.insert(name, value);
  return request;
}

Arrival seen(const Headers& headers, const std::string& from = "10.0.0.1",
             ForwardedBy kind = ForwardedBy::x_forwarded) {
  const ProxyTrust trust{{*parse_address_range("10.0.0.0/8"), *parse_address_range("fd00::/8")}, kind};
  const Peer peer{ip::tcp::endpoint(ip::make_address(from), 40000), false};
  return see_through_proxies(request_with(headers), peer, trust);
}

rr::ByteSpan bytes(std::string_view text) {
  return rr::as_bytes(text);
}

const std::string binary_start("\r\n\r\n\0\r\nQUIT\n", 12);

}  // namespace

TEST_CASE("address ranges") {
  const auto holds = [](const char* range, const char* address) {
    return parse_address_range(range)->contains(ip::make_address(address));
  };
  CHECK(holds("10.0.0.0/8", "10.255.0.1"));
  CHECK_FALSE(holds("10.0.0.0/8", "11.0.0.1"));
  CHECK(holds("192.0.2.64/26", "192.0.2.127"));
  CHECK_FALSE(holds("192.0.2.64/26", "192.0.2.128"));
  CHECK(holds("0.0.0.0/0", "1.2.3.4"));
  CHECK_FALSE(holds("0.0.0.0/0", "::1"));
  CHECK(holds("::1", "::1"));
  CHECK(holds("127.0.0.1", "::ffff:127.0.0.1"));
  for (const auto* wrong : {"", "10.0.0.1/8", "10.0.0.0/33", "10.0.0.0/", "10.0.0.0/8x", "localhost", "::/129"})
    CHECK_FALSE(parse_address_range(wrong).has_value());
}

TEST_CASE("headers of whoever is no trusted proxy are ignored") {
  const Headers all = {{"X-Forwarded-For", "1.2.3.4"},
                       {"X-Forwarded-Proto", "https"},
                       {"X-Forwarded-Host", "evil.example"},
                       {"X-Forwarded-Prefix", "/evil"},
                       {"Forwarded", "for=1.2.3.4;proto=https;host=evil.example"}};
  for (const auto kind : {ForwardedBy::x_forwarded, ForwardedBy::forwarded}) {
    const auto arrival = seen(all, "192.0.2.9", kind);
    CHECK(arrival.peer == "192.0.2.9:40000");
    CHECK(arrival.host == "gw:8080");
    CHECK(arrival.prefix.empty());
    CHECK_FALSE(arrival.is_encrypted);
  }
}

TEST_CASE("X-Forwarded headers of a trusted proxy") {
  const auto arrival = seen({{"X-Forwarded-For", "192.0.2.7"},
                             {"X-Forwarded-Proto", "https"},
                             {"X-Forwarded-Host", "lab.example"},
                             {"X-Forwarded-Prefix", "/robots/"}});
  CHECK(arrival.peer == "192.0.2.7");
  CHECK(arrival.is_encrypted);
  CHECK(arrival.host == "lab.example");
  CHECK(arrival.prefix == "/robots");

  SECTION("the client is the last address that no trusted proxy has") {
    CHECK(seen({{"X-Forwarded-For", "6.6.6.6, 192.0.2.7, 10.1.1.1"}}).peer == "192.0.2.7");
    CHECK(seen({{"X-Forwarded-For", "6.6.6.6"}, {"X-Forwarded-For", "192.0.2.7:99"}}).peer == "192.0.2.7");
    CHECK(seen({{"X-Forwarded-For", "10.2.2.2, 10.1.1.1"}}).peer == "10.2.2.2");
    CHECK(seen({{"X-Forwarded-For", "2001:db8::7"}}).peer == "2001:db8::7");
  }
  SECTION("what can't be read ends the row") {
    CHECK(seen({{"X-Forwarded-For", "192.0.2.7, unknown"}}).peer == "10.0.0.1:40000");
    CHECK(seen({{"X-Forwarded-For", ""}}).peer == "10.0.0.1:40000");
  }
  SECTION("a client hides nothing that proxies add behind what it has sent") {
    for (const auto* sent : {"[6.6.6.6]\"", "6.6.6.6:\"", "\"6.6.6.6", "6.6.6.6\\", "\"6.6.6.6\\"}) {
      INFO(sent);
      CHECK(seen({{"X-Forwarded-For", sent + std::string(", 192.0.2.7")}}).peer == "192.0.2.7");
      CHECK(seen({{"X-Forwarded-For", sent}, {"X-Forwarded-For", "192.0.2.7"}}).peer == "192.0.2.7");
    }
    for (const auto* wrong : {"[2001:db8::1]x", "6.6.6.6:80x!", "[2001:db8::1"})
      CHECK(seen({{"X-Forwarded-For", wrong}}).peer == "10.0.0.1:40000");
  }
  SECTION("the other kind is not read") {
    CHECK(seen({{"Forwarded", "for=6.6.6.6"}, {"X-Forwarded-For", "192.0.2.7"}}).peer == "192.0.2.7");
    CHECK(seen({{"Forwarded", "for=192.0.2.7"}, {"X-Forwarded-For", "6.6.6.6"}}, "10.0.0.1", ForwardedBy::forwarded)
              .peer == "192.0.2.7");
  }
  SECTION("hosts and paths are checked") {
    CHECK(seen({{"X-Forwarded-Host", "a/b"}}).host == "gw:8080");
    for (const auto* wrong : {"robots", "/a/../b", "//evil.example", "/a\"b", "/a b"})
      CHECK(seen({{"X-Forwarded-Prefix", wrong}}).prefix.empty());
  }
}

TEST_CASE("Forwarded of a trusted proxy") {
  const auto arrival = seen(
      {{"Forwarded", R"(for=6.6.6.6;host=evil.example, For="[2001:db8::7]:4711";Proto=https;host="lab.example:444")"},
       {"Forwarded", "for=10.9.9.9;proto=http;host=inner"}},
      "10.0.0.1", ForwardedBy::forwarded);
  CHECK(arrival.peer == "2001:db8::7");
  CHECK(arrival.is_encrypted);
  CHECK(arrival.host == "lab.example:444");
  CHECK(seen({{"Forwarded", "for=_hidden, for=\"never ends"}}, "10.0.0.1", ForwardedBy::forwarded).peer ==
        "10.0.0.1:40000");
  const std::string hiding = R"(for=6.6.6.6;proto=https;x=")";
  for (const auto* added : {"for=192.0.2.7", R"(for="[2001:db8::7]")", R"(for="[2001:db8::7]";host="a:1")"}) {
    const auto one_line = seen({{"Forwarded", hiding + ", " + added}}, "10.0.0.1", ForwardedBy::forwarded);
    CHECK(one_line.peer == "10.0.0.1:40000");
    CHECK_FALSE(one_line.is_encrypted);
    const auto two_lines = seen({{"Forwarded", hiding}, {"Forwarded", added}}, "10.0.0.1", ForwardedBy::forwarded);
    CHECK(two_lines.peer != "6.6.6.6");
    CHECK(two_lines.peer != "10.0.0.1:40000");
    CHECK_FALSE(two_lines.is_encrypted);
  }
}

TEST_CASE("the base path is taken from the front of paths") {
  const auto path_of = [](const std::string& target) {
    auto request = request_with({}, target);
    take_base_path(request, "/robots");
    return std::pair(std::string(request.message.target()), request.arrival.prefix);
  };
  CHECK(path_of("/robots/api/v1/devices?x=1") == std::pair<std::string, std::string>("/api/v1/devices?x=1", "/robots"));
  CHECK(path_of("/robots/") == std::pair<std::string, std::string>("/", "/robots"));
  CHECK(path_of("/robots") == std::pair<std::string, std::string>("/robots", ""));
  CHECK(path_of("/robotsx/") == std::pair<std::string, std::string>("/robotsx/", ""));
  CHECK(path_of("/healthz") == std::pair<std::string, std::string>("/healthz", ""));
}

TEST_CASE("PROXY headers") {
  const auto line = parse_proxy_header(bytes("PROXY TCP4 192.0.2.7 10.0.0.1 4711 80\r\nGET")).value();
  CHECK(line.size == 39);
  CHECK(*line.client == ip::tcp::endpoint(ip::make_address("192.0.2.7"), 4711));
  CHECK(parse_proxy_header(bytes("PROXY TCP6 2001:db8::7 ::1 1 2\r\n")).value().client->address().is_v6());
  CHECK_FALSE(parse_proxy_header(bytes("PROXY UNKNOWN whatever\r\n")).value().client.has_value());
  CHECK(parse_proxy_header(bytes("PROXY UNKNOWN\r\n")).value().size == 15);

  auto block =
      binary_start + std::string("\x21\x11\x00\x0f\xc0\x00\x02\x07\x0a\x00\x00\x01\x12\x67\x00\x50\x04\x00\x00", 19);
  const auto read = parse_proxy_header(bytes(block)).value();
  CHECK(read.size == 31);
  CHECK(*read.client == ip::tcp::endpoint(ip::make_address("192.0.2.7"), 0x1267));
  block[12] = 0x20;  // LOCAL
  CHECK_FALSE(parse_proxy_header(bytes(block)).value().client.has_value());

  SECTION("incomplete at every length") {
    for (const auto& whole : {std::string("PROXY TCP4 192.0.2.7 10.0.0.1 4711 80\r\n"), block})
      for (std::size_t size = 1; size < whole.size(); ++size)
        CHECK(parse_proxy_header(bytes(std::string_view(whole).substr(0, size))).value().size == 0);
  }
  SECTION("broken") {
    const auto version_3 = binary_start + std::string("\x31\x11\x00\x00", 4);
    const auto too_short = binary_start + std::string("\x21\x11\x00\x02\x00\x00", 6);
    const auto too_long = binary_start + std::string("\x21\x11\xff\xff", 4);
    for (const auto& wrong :
         {std::string("GET / HTTP/1.1\r\n"), std::string("PROXY TCP5 1.2.3.4 1.2.3.4 1 1\r\n"),
          std::string("PROXY TCP4 ::1 ::1 1 1\r\n"), std::string("PROXY TCP4 1.2.3.4 1.2.3.4 99999 1\r\n"),
          std::string("PROXY TCP4\r\n"), "PROXY " + std::string(200, 'x'),
          "PROXY UNKNOWN " + std::string(100, 'x') + "\r\n", version_3, too_short, too_long})
      CHECK_FALSE(parse_proxy_header(bytes(wrong)).has_value());
  }
}

TEST_CASE("connections by a proxy count for its clients") {
  Admission admission(10, 2);
  const auto one = ip::make_address("192.0.2.1");
  auto first = admission.admit(std::nullopt);
  auto second = admission.admit(std::nullopt);
  auto third = admission.admit(std::nullopt);
  CHECK(first->pass_to(one));
  CHECK(second->pass_to(one));
  CHECK_FALSE(third->pass_to(one));
  CHECK_FALSE(admission.admit(one).has_value());
  second.reset();
  CHECK(third->pass_to(one));
  CHECK(admission.open() == 2);
}
