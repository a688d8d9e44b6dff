#include "node/http/origin.hpp"

#include <catch2/catch.hpp>

using namespace rrgate;

TEST_CASE("pages of the gateway itself may connect") {
  CHECK(is_origin_allowed("http://127.0.0.1:8080", "127.0.0.1:8080", {}));
  CHECK(is_origin_allowed("http://[::1]:8080", "[::1]:8080", {}));
  CHECK(is_origin_allowed("https://gw.example", "gw.example", {}));
  CHECK(is_origin_allowed("https://GW.example", "gw.example:443", {}));
  CHECK(is_origin_allowed("http://gw.example:80", "gw.example", {}));
}

TEST_CASE("other pages may not") {
  const std::string host = "127.0.0.1:8080";
  for (const auto origin :
       {"null", "", "http://127.0.0.1", "http://127.0.0.1:8081", "http://localhost:8080", "http://evil.example",
        "http://127.0.0.1:8080.evil.example", "http://evil.example/127.0.0.1:8080", "http://127.0.0.1:8080, http://a",
        "http://127.0.0.1:8080 http://a", "http://a@127.0.0.1:8080", "http://127.0.0.1:8080/", "file://", "file:///x",
        "://127.0.0.1:8080", "http://", "http://*", "chrome-extension://127.0.0.1:8080"}) {
    INFO(origin);
    CHECK_FALSE(is_origin_allowed(origin, host, {}));
  }
  CHECK_FALSE(is_origin_allowed("http://", "", {}));
  CHECK_FALSE(is_origin_allowed("null", "null", {"https://a.example"}));
  CHECK_FALSE(is_origin_allowed("https://gw.example", "gw.example:80", {}));
}

TEST_CASE("configured origins may, and only those") {
  const std::vector<std::string> allowed = {"https://lab.example.org", "http://*.bench.example:8000"};
  CHECK(is_origin_allowed("https://lab.example.org", "gw", allowed));
  CHECK(is_origin_allowed("https://lab.example.org:443", "gw", allowed));
  CHECK(is_origin_allowed("https://LAB.example.org", "gw", allowed));
  CHECK(is_origin_allowed("http://a.bench.example:8000", "gw", allowed));
  CHECK(is_origin_allowed("http://a.b.bench.example:8000", "gw", allowed));
  for (const auto origin : {"http://lab.example.org", "https://lab.example.org:8443", "https://xlab.example.org",
                            "https://lab.example.org.evil.example", "http://bench.example:8000",
                            "http://evilbench.example:8000", "http://a.bench.example", "http://*.bench.example:8000"}) {
    INFO(origin);
    CHECK_FALSE(is_origin_allowed(origin, "gw", allowed));
  }
}

TEST_CASE("patterns are checked when they are configured") {
  for (const auto good : {"http://a", "https://a.example:8443", "http://*.a.example", "https://[::1]:80", "app://x"})
    CHECK(is_origin_pattern(good));
  for (const auto bad : {"", "null", "a.example", "http://", "http://a/", "http://a/b", "*", "http://*", "http://a.*",
                         "http://*a.example", "http://a:b", "http://a:", "http://a b"}) {
    INFO(bad);
    CHECK_FALSE(is_origin_pattern(bad));
  }
}
