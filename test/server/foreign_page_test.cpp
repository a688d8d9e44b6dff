// Requests that somebody else's page makes a browser send are refused, and nobody else's.
#include "node/http/foreign_page.hpp"

#include <catch2/catch.hpp>

#include "node/http/origin.hpp"

using namespace rrgate;

namespace {

using Headers = std::vector<std::pair<std::string, std::string>>;

const std::vector<std::string> lab_pages = {"https://lab.example"};
const std::vector<std::string> own_names = {"mybox.local"};
const PageRules rules{lab_pages, own_names};

/// The status that a gateway refuses the request with; 0: it goes on.
unsigned status_of(const Headers& headers, std::string target = "/api/v1/devices", http::verb method = http::verb::get,
                   std::string forwarded_host = {}) {
  HttpRequest request;
  request.message.method(method);
  request.message.target(target);
  request.message.version(11);
  for (const auto& [name, value] : headers) request.message.insert(name, value);
  request.arrival.host = forwarded_host.empty() ? std::string(request.header(http::field::host)) : forwarded_host;
  auto refusal = refuse_unknown_host(request, rules);
  if (!refusal) refusal = refuse_foreign_page(request, rules);
  return refusal ? refusal->status : 0;
}

/// Of a WebSocket's upgrade.
unsigned upgrade_status(Headers headers) {
  headers.insert(headers.end(), {{"Upgrade", "websocket"}, {"Connection", "Upgrade"}});
  return status_of(headers, "/devices/create");
}

}  // namespace

TEST_CASE("a page that was loaded by a stranger's name gets nothing, though to its browser it is the server's own") {
  const Headers rebound = {{"Host", "evil.example:8080"}, {"Origin", "http://evil.example:8080"}};
  for (const auto path : {"/", "/index.html", "/healthz", "/metrics", "/api/v1/devices"}) {
    CHECK(status_of({{"Host", "evil.example:8080"}}, path) == 421);
    CHECK(status_of(rebound, path) == 421);
    CHECK(status_of(rebound, path, http::verb::post) == 421);
  }
  CHECK(upgrade_status(rebound) == 421);
  // Such a page may say what only a proxy should.
  CHECK(status_of(rebound, "/api/v1/devices", http::verb::get, "localhost") == 421);
}

TEST_CASE("a host that a proxy was asked for by a stranger's name is refused too") {
  CHECK(status_of({{"Host", "127.0.0.1:8080"}}, "/", http::verb::get, "evil.example") == 421);
  CHECK(status_of({{"Host", "127.0.0.1:8080"}}, "/", http::verb::get, "mybox.local") == 0);
}

TEST_CASE("requests by an address, by localhost or by a listed name go on") {
  for (const auto host : {"127.0.0.1:8080", "[::1]:8080", "192.168.1.5:8080", "localhost:8080", "mybox.local:8080"}) {
    CHECK(status_of({{"Host", host}}) == 0);
    CHECK(upgrade_status({{"Host", host}, {"Origin", "http://" + std::string(host)}}) == 0);
    CHECK(status_of({{"Host", host}, {"Origin", "http://" + std::string(host)}}, "/api/v1/tickets", http::verb::post) ==
          0);
  }
  CHECK(status_of({}) == 0);  // HTTP/1.0; no browser
}

TEST_CASE("WebSockets of programs, which tell no Origin, go on by any name") {
  CHECK(upgrade_status({{"Host", "whatever.example"}}) == 0);
}

TEST_CASE("pages of allowed origins go on by any name") {
  CHECK(upgrade_status({{"Host", "whatever.example"}, {"Origin", "https://lab.example"}}) == 0);
  CHECK(status_of({{"Host", "localhost"}, {"Origin", "https://lab.example"}, {"Sec-Fetch-Site", "cross-site"}}) == 0);
}

TEST_CASE("pages of other origins are refused, whatever they ask for") {
  for (const auto origin : {"http://evil.example", "http://localhost:3000", "https://localhost", "null", ""}) {
    INFO(origin);
    const Headers foreign = {{"Host", "localhost:8080"}, {"Origin", origin}};
    CHECK(upgrade_status(foreign) == 403);
    for (const auto method : {http::verb::get, http::verb::post, http::verb::put, http::verb::options})
      CHECK(status_of(foreign, "/api/v1/devices/create/Create/Drive", method) == 403);
  }
  const Headers twice = {
      {"Host", "localhost:8080"}, {"Origin", "http://localhost:8080"}, {"Origin", "http://evil.example"}};
  CHECK(upgrade_status(twice) == 403);
}

TEST_CASE("what another site's page embeds is refused; a link to the page may be followed") {
  const auto status = [](const char* site, const char* mode, const char* path, http::verb method = http::verb::get) {
    return status_of({{"Host", "localhost:8080"}, {"Sec-Fetch-Site", site}, {"Sec-Fetch-Mode", mode}}, path, method);
  };
  const auto image = "/api/v1/devices/cam/Webcam/frames";
  CHECK(status("cross-site", "no-cors", image) == 403);
  CHECK(status("cross-site", "navigate", image) == 403);
  CHECK(status("cross-site", "no-cors", "/assets/app.js") == 403);
  CHECK(status("cross-site", "navigate", "/") == 0);
  CHECK(status("cross-site", "navigate", "/", http::verb::post) == 403);
  CHECK(status("same-site", "no-cors", image) == 0);  // another port of this host
  CHECK(status("same-site", "no-cors", image, http::verb::post) == 403);
  for (const auto site : {"same-origin", "none"}) {
    CHECK(status(site, "cors", image) == 0);
    CHECK(status(site, "navigate", image) == 0);
  }
}

TEST_CASE("a cookie says who asks where the server's own page has sent it, and nowhere else") {
  const auto counts = [](Headers headers, http::verb method = http::verb::get, bool is_encrypted = true) {
    HttpRequest request;
    request.message.method(method);
    headers.emplace_back("Host", "mybox.local");
    for (const auto& [name, value] : headers) request.message.insert(name, value);
    request.arrival = {{}, {}, is_encrypted, "mybox.local", {}};
    return is_from_own_page(request);
  };
  const Headers socket = {{"Upgrade", "websocket"}, {"Connection", "Upgrade"}};
  const auto with = [](Headers headers, Headers more) {
    headers.insert(headers.end(), more.begin(), more.end());
    return headers;
  };
  const Headers own = {{"Origin", "https://mybox.local"}};
  CHECK(counts({}));  // in clear browsers tell less
  CHECK(counts({{"Sec-Fetch-Site", "same-origin"}}));
  CHECK(counts({{"Sec-Fetch-Site", "none"}}));
  for (const auto method : {http::verb::get, http::verb::put, http::verb::post, http::verb::delete_}) {
    CHECK(counts(own, method));
    CHECK_FALSE(counts({{"Origin", "https://lab.example"}}, method));
    CHECK_FALSE(counts({{"Origin", "https://mybox.local:8443"}}, method));
    CHECK_FALSE(counts({{"Origin", "http://mybox.local"}}, method));
    CHECK_FALSE(counts({{"Origin", "null"}}, method));
    CHECK_FALSE(counts(with(own, own), method));
    CHECK_FALSE(counts({{"Sec-Fetch-Site", "same-site"}}, method));
    CHECK_FALSE(counts({{"Sec-Fetch-Site", "cross-site"}}, method));
    CHECK_FALSE(counts(with(own, {{"Sec-Fetch-Site", "cross-site"}}), method));
  }
  CHECK_FALSE(counts({}, http::verb::post));
  CHECK_FALSE(counts({{"Sec-Fetch-Site", "same-origin"}}, http::verb::delete_));
  CHECK(counts(with(own, socket)));
  CHECK_FALSE(counts(socket));
  CHECK_FALSE(counts(with({{"Origin", "https://lab.example"}}, socket)));
}
