#include "node/http/origin.hpp"

#include <catch2/catch.hpp>
#include <vector>

using namespace rrgate;

TEST_CASE("a page is of the origin that it was loaded from") {
  CHECK(is_same_origin("http://127.0.0.1:8080", "127.0.0.1:8080", false));
  CHECK(is_same_origin("http://[::1]:8080", "[::1]:8080", false));
  CHECK(is_same_origin("https://gw.example", "gw.example", false));
  CHECK(is_same_origin("https://GW.example", "gw.example:443", false));
  CHECK(is_same_origin("http://gw.example:80", "gw.example", false));
}

TEST_CASE("a page that came in clear is none of HTTPS") {
  CHECK(is_same_origin("https://gw.example", "gw.example", true));
  CHECK_FALSE(is_same_origin("http://gw.example", "gw.example", true));
  CHECK_FALSE(is_same_origin("http://gw.example:8443", "gw.example:8443", true));
}

TEST_CASE("other pages are of other origins") {
  const std::string host = "127.0.0.1:8080";
  for (const auto origin :
       {"null", "", "http://127.0.0.1", "http://127.0.0.1:8081", "http://localhost:8080", "http://evil.example",
        "http://127.0.0.1:8080.evil.example", "http://evil.example/127.0.0.1:8080", "http://127.0.0.1:8080, http://a",
        "http://127.0.0.1:8080 http://a", "http://a@127.0.0.1:8080", "http://127.0.0.1:8080/", "file://", "file:///x",
        "://127.0.0.1:8080", "http://", "http://*", "chrome-extension://127.0.0.1:8080"}) {
    INFO(origin);
    CHECK_FALSE(is_same_origin(origin, host, false));
    CHECK_FALSE(is_origin_listed(origin, {}));
  }
  CHECK_FALSE(is_same_origin("http://", "", false));
  CHECK_FALSE(is_same_origin("null", "null", false));
  CHECK_FALSE(is_same_origin("https://gw.example", "gw.example:80", false));
}

TEST_CASE("origins fit their patterns, and no others do") {
  const std::vector<std::string> allowed = {"https://lab.example.org", "http://*.bench.example:8000"};
  CHECK(is_origin_listed("https://lab.example.org", allowed));
  CHECK(is_origin_listed("https://lab.example.org:443", allowed));
  CHECK(is_origin_listed("https://LAB.example.org", allowed));
  CHECK(is_origin_listed("http://a.bench.example:8000", allowed));
  CHECK(is_origin_listed("http://a.b.bench.example:8000", allowed));
  for (const auto origin :
       {"null", "http://lab.example.org", "https://lab.example.org:8443", "https://xlab.example.org",
        "https://lab.example.org.evil.example", "http://bench.example:8000", "http://evilbench.example:8000",
        "http://a.bench.example", "http://*.bench.example:8000"}) {
    INFO(origin);
    CHECK_FALSE(is_origin_listed(origin, allowed));
  }
}

TEST_CASE("IP addresses, localhost and listed names are hosts of one's own, and no others are") {
  const std::vector<std::string> allowed = {"mybox.local", "*.Lab.example"};
  for (const auto host : {"127.0.0.1", "127.0.0.1:8080", "192.0.2.7:1", "[::1]", "[2001:db8::7]:8080", "localhost",
                          "LOCALHOST:8080", "mybox.local:8080", "MyBox.local", "a.lab.example", "a.b.lab.example:80"}) {
    INFO(host);
    CHECK(is_host_listed(host, allowed));
  }
  for (const auto host : {"evil.example",
                          "evil.example:8080",
                          "",
                          ":8080",
                          "localhost.evil.example",
                          "xlocalhost",
                          "127.0.0.1.evil.example",
                          "1.2.3",
                          "0x7f000001",
                          "[evil.example]",
                          "[::1",
                          "mybox.local.evil",
                          "evil-mybox.local",
                          "lab.example",
                          "xlab.example",
                          "*.lab.example",
                          "a@localhost",
                          "localhost:80:80",
                          "localhost/",
                          "127.0.0.1, localhost"}) {
    INFO(host);
    CHECK_FALSE(is_host_listed(host, allowed));
  }
  CHECK(host_name_of("MyBox.local:8080") == "mybox.local");
  CHECK(host_name_of("a b").empty());
}

TEST_CASE("patterns of origins are checked when they are configured") {
  for (const auto good : {"http://a", "https://a.example:8443", "http://*.a.example", "https://[::1]:80", "app://x"})
    CHECK(is_origin_pattern(good));
  for (const auto bad : {"", "null", "a.example", "http://", "http://a/", "http://a/b", "*", "http://*", "http://a.*",
                         "http://*a.example", "http://a:b", "http://a:", "http://a b"}) {
    INFO(bad);
    CHECK_FALSE(is_origin_pattern(bad));
  }
}

TEST_CASE("patterns of hosts are checked when they are configured") {
  for (const auto good : {"mybox", "mybox.local", "*.lab.example", "192.0.2.1", "[::1]"}) CHECK(is_host_pattern(good));
  for (const auto bad : {"", "http://mybox.local", "mybox.local:8080", "mybox.local:", "*", "*mybox.local", "my*.local",
                         "mybox.local/", "a b"}) {
    INFO(bad);
    CHECK_FALSE(is_host_pattern(bad));
  }
}
