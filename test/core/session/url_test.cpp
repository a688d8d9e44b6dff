#include "core/session/url.hpp"

#include <catch2/catch.hpp>

using namespace rr;

namespace {

ConnectionUrl parsed(std::string_view text, ServiceInUrl rule = ServiceInUrl::required) {
  auto url = parse_url(text, rule);
  INFO(text << ": " << (url ? std::string() : url.error().message));
  REQUIRE(url.has_value());
  return *url;
}

void refused(std::string_view text, std::string_view why, ErrorCode code = ErrorCode::connection_error) {
  auto url = parse_url(text);
  INFO(text);
  REQUIRE_FALSE(url.has_value());
  CHECK(url.error().code == code);
  CHECK_THAT(url.error().message, Catch::Contains(std::string(why)));
}

constexpr std::string_view id_text = "82301bf1-e1ef-4e89-8d8f-0848291587ac";

}  // namespace

TEST_CASE("the examples of the specification parse") {
  auto url = parsed("rr+tcp://192.168.1.5:52222?service=arm");
  CHECK(url.scheme == "rr+tcp");
  CHECK(url.host == "192.168.1.5");
  CHECK(url.port == 52222);
  CHECK(url.path.empty());
  CHECK(url.service == "arm");
  CHECK_FALSE(url.node_id.has_value());

  url = parsed("rr+tcp://[fe80::48ac:c24d:4a5b]:52222/?nodeid=" + std::string(id_text) + "&service=arm");
  CHECK(url.host == "fe80::48ac:c24d:4a5b");
  REQUIRE(url.node_id.has_value());
  CHECK(format_node_id(*url.node_id, NodeIdFormat::dashes) == id_text);

  url = parsed("rr+ws://localhost/?nodename=my.robot&service=arm");
  CHECK(url.port == 80);
  CHECK(url.node_name == "my.robot");

  url = parsed("rr+wss://gw.example.org/robots/a?token=abc&service=arm");
  CHECK(url.port == 443);
  CHECK(url.path == "/robots/a");
  CHECK(url.query == "token=abc&service=arm");

  url = parsed("rr+local:///?nodename=my.robot&service=arm");
  CHECK(url.host.empty());
  url = parsed("rr+local://alice@localhost/?nodeid=" + std::string(id_text) + "&service=arm");
  CHECK(url.user == "alice");
  parsed("rr+intra:///?nodename=my.robot&service=arm");
  parsed("rr+usb:///?nodeid=" + std::string(id_text) + "&service=RobotRaconteurServiceIndex");
}

TEST_CASE("the first occurrence of a name wins and values are decoded") {
  const auto url = parsed("rr+tcp://h?service=a%2Bb&service=c&other=");
  CHECK(url.service == "a+b");
  CHECK(url.port == 48653);
  const auto twice =
      parsed("rr+tcp://h?service=a&nodeid=" + std::string(id_text) + "&nodeid=none&nodename=b&nodename=1");
  CHECK(twice.node_id == parse_node_id(id_text).value());
  CHECK(twice.node_name == "b");
}

TEST_CASE("an IPv6 zone is accepted raw and in URI form and kept raw") {
  CHECK(parsed("rr+tcp://[fe80::1%eth0]:1?service=a").host == "fe80::1%eth0");
  CHECK(parsed("rr+tcp://[fe80::1%25eth0]:1?service=a").host == "fe80::1%eth0");
  CHECK(parsed("rr+tcp://[fe80::1%4]:1?service=a").host == "fe80::1%4");
}

TEST_CASE("a host without its zone is the address alone, and any other host as it is") {
  CHECK(without_zone("fe80::1%eth0") == "fe80::1");
  CHECK(without_zone("fe80::1%") == "fe80::1");
  CHECK(without_zone("fe80::1") == "fe80::1");
  CHECK(without_zone("robot.local") == "robot.local");
  CHECK(without_zone("") == "");
}

TEST_CASE("the legacy form is understood") {
  auto url = parsed("tcp://10.0.0.1:2355/my.robot/Create/");
  CHECK(url.scheme == "rr+tcp");
  CHECK(url.node_name == "my.robot");
  CHECK(url.service == "Create");
  url = parsed("tcp://10.0.0.1:2355/{" + std::string(id_text) + "}/Create");
  REQUIRE(url.node_id.has_value());
  CHECK(parsed(format_url(url)) == url);
  refused("tcp://10.0.0.1/my.robot/Create", "port");
  refused("tcp://10.0.0.1:2355/?service=Create", "without a query");
  refused("tcp://10.0.0.1:2355/[00]/Create", "NodeID", ErrorCode::invalid_argument);
}

TEST_CASE("bad URLs say what was found and what was expected") {
  refused("", "scheme://");
  refused("rr+tpc://h?service=a", "scheme 'rr+tpc' unknown; known: rr+tcp, rrs+tcp");
  refused("RR+TCP://h?service=a", "unknown");
  refused("rr+tcp://h:0?service=a", "1 to 65535");
  refused("rr+tcp://h:118816?service=a", "1 to 65535");
  refused("rr+tcp://h:?service=a", "1 to 65535");
  refused("rr+tcp://h:12x?service=a", "1 to 65535");
  refused("rr+tcp:///?service=a", "no host");
  refused("rr+tcp://h/path?service=a", "takes no path");
  refused("rr+tcp://[::1?service=a", "closing");
  refused("rr+tcp://[::1]x?service=a", "after the host");
  refused("rr+tcp://h", "no service");
  refused("rr+tcp://h?service=a&", "name=value");
  refused("rr+tcp://h?service=a&b", "name=value");
  refused("rr+tcp://h?service=a=b", "name=value");
  refused("rr+tcp://h?service=a b", "white space");
  refused("rr+local://h/?nodename=a&service=b", "names a node");
  refused("rr+local:////?nodename=a&service=b", "no path");
  refused("rr+local:///?service=b", "needs nodeid or nodename");
  refused("rr+local://localhost:1/?nodename=a&service=b", "no port");
  refused("rr+intra://localhost/?nodename=a&service=b", "names a node");
  refused("rr+intra://alice@localhost/?nodename=a&service=b", "names a node");
  refused("rr+tcp://[fe80::1%]:1?service=a", "IPv6 zone ''");
  refused("rr+local://1a@localhost/?nodename=a&service=b", "user");
  refused("rr+tcp://h?nodeid=&service=a", "NodeID", ErrorCode::invalid_argument);
  refused("rr+tcp://h?nodeid=0&service=a", "NodeID", ErrorCode::invalid_argument);
  refused("rr+tcp://h?nodename=&service=a", "nodename", ErrorCode::invalid_argument);
  refused("rr+tcp://h?nodename=1a&service=a", "nodename", ErrorCode::invalid_argument);
  refused("rr+tcp://h?service=%4", "escape", ErrorCode::invalid_argument);
}

TEST_CASE("a service is not needed where the caller says so") {
  CHECK(parsed("rr+tcp://h:1", ServiceInUrl::optional).service.empty());
  CHECK(parsed("rr+tcp://h:1/?nodename=a", ServiceInUrl::optional).node_name == "a");
}

TEST_CASE("format_url gives a text that parses to the same URL") {
  for (const std::string text :
       {"rr+tcp://h:1/?service=a", "rr+ws://[::1]:8080/devices/x?service=a", "rr+tcp://h/?service=a%20b",
        "rr+local://alice@localhost/?nodename=a&service=b", "rr+local:///?nodename=a&service=b"}) {
    CHECK(format_url(parsed(text)) == text);
    CHECK(parsed(format_url(parsed(text))) == parsed(text));
  }
}

TEST_CASE("listen addresses") {
  CHECK(parse_host_port("127.0.0.1:8080").value() == HostPort{"127.0.0.1", 8080});
  CHECK(parse_host_port("[::1]:0").value() == HostPort{"::1", 0});
  for (const auto bad : {"", "8080", ":8080", "h:", "h:65536", "::1:80", "[::1]", "h:-1", "h:1x"}) {
    INFO(bad);
    CHECK_FALSE(parse_host_port(bad).has_value());
  }
}

TEST_CASE("query values of an HTTP request are read leniently") {
  CHECK(query_value("a=1&nodeid=%7b0%7d&x", "nodeid") == "{0}");
  CHECK(query_value("x&a=%zz", "a") == "%zz");
  CHECK_FALSE(query_value("ab=1", "a"));
  CHECK(query_value("a=", "a") == "");
}

TEST_CASE("percent escapes survive a round trip") {
  std::string all;
  for (int i = 0; i < 256; ++i) all += static_cast<char>(i);
  CHECK(percent_decode(percent_encode(all)).value() == all);
  CHECK(percent_encode("a b/c") == "a%20b%2Fc");
}
