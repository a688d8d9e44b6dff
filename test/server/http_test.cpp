// Requests to answers, without sockets: router, upgrade rules, static files.
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "node/http/upgrade.hpp"
#include "server/front/front_door.hpp"
#include "server/gateway/gateway.hpp"
#include "server/http/endpoints/documentation.hpp"
#include "server/http/router.hpp"
#include "server/http/sign_in_cookie.hpp"
#include "server/http/static_files.hpp"

using namespace rrgate;
namespace fs = std::filesystem;

namespace {

using Headers = std::vector<std::pair<std::string, std::string>>;

Request request(http::verb method, std::string target, const Headers& headers = {}) {
  Request out;
  out.message.method(method);
  out.message.target(target);
  out.message.version(11);
  for (const auto& [name, value] : headers) out.message.insert(name, value);
  return out;
}

std::string header(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers)
    if (key == name) return value;
  return {};
}

Headers upgrade_headers() {
  return {{"Host", "gw:8080"},
          {"Upgrade", "websocket"},
          {"Connection", "Upgrade"},
          {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="},
          {"Sec-WebSocket-Version", "13"}};
}

unsigned upgrade_status(const Headers& more, http::verb method = http::verb::get) {
  auto headers = upgrade_headers();
  headers.insert(headers.end(), more.begin(), more.end());
  const auto refusal = refuse_upgrade(request(method, "/devices/x", headers));
  return refusal ? refusal->status : 101;
}

/// A folder with a few files, gone with the object.
struct WebRoot {
  fs::path folder = fs::temp_directory_path() / ("rrgate_test_" + std::to_string(::getpid()));
  WebRoot() {
    fs::create_directories(folder / "web" / "assets");
    write("secret.txt", "secret");
    write("web/index.html", "<html>");
    write("web/assets/app-Bx81Qz0k.js", "script");
    write("web/assets/app-Bx81Qz0k.js.br", "brotli");
    write("web/assets/app-Bx81Qz0k.js.gz", "gzip");
    write("web/assets/client.wasm", "wasm");
    write("web/.hidden", "hidden");
    fs::create_symlink(folder / "secret.txt", folder / "web" / "link.txt");
  }
  ~WebRoot() { fs::remove_all(folder); }
  void write(const std::string& name, const std::string& text) {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  }
};

}  // namespace

TEST_CASE("a WebSocket is asked for in both headers, on whichever of their lines") {
  const auto asks = [](const Headers& headers) {
    return asks_for_websocket(request(http::verb::get, "/devices/x", headers));
  };
  CHECK(asks({{"Upgrade", "websocket"}, {"Connection", "keep-alive, Upgrade"}}));
  CHECK(asks({{"Upgrade", "h2c"}, {"Upgrade", "WebSocket"}, {"Connection", "keep-alive"}, {"Connection", "upgrade"}}));
  CHECK_FALSE(asks({{"Upgrade", "websocket"}}));  // for the next hop alone, which has not said that it goes on
  CHECK_FALSE(asks({{"Upgrade", "websocket"}, {"Connection", "keep-alive"}}));
  CHECK_FALSE(asks({{"Connection", "Upgrade"}}));
}

TEST_CASE("the router finds the first fitting route") {
  Router router;
  const auto says = [](std::string text) {
    return [text](const Request&, std::string_view rest) {
      return text_response(200, "text/plain", text + std::string(rest));
    };
  };
  router.add(http::verb::get, "/a", says("a:"));
  router.add(http::verb::post, "/a", says("posted:"));
  router.add(http::verb::get, "/b/*", says("b:"));
  const auto body = [&](http::verb method, std::string target) { return *router.answer(request(method, target)).body; };
  CHECK(body(http::verb::get, "/a") == "a:");
  CHECK(body(http::verb::get, "/a?x=/b/") == "a:");
  CHECK(body(http::verb::head, "/a") == "a:");
  CHECK(body(http::verb::post, "/a") == "posted:");
  CHECK(body(http::verb::get, "/b/c/d") == "b:c/d");

  const auto missing = router.answer(request(http::verb::get, "/c"));
  CHECK(missing.status == 404);
  CHECK(header(missing, "Content-Type") == "application/problem+json");
  const auto refused = router.answer(request(http::verb::delete_, "/a"));
  CHECK(refused.status == 405);
  CHECK(header(refused, "Allow") == "GET, HEAD, POST");
}

TEST_CASE("an upgrade is accepted from native clients and pages") {
  CHECK(upgrade_status({}) == 101);
  CHECK(upgrade_status({{"Sec-WebSocket-Protocol", "robotraconteur.robotraconteur.com"}}) == 101);
  CHECK(upgrade_status({{"Sec-WebSocket-Protocol", "chat, RobotRaconteur.robotraconteur.com"}}) == 101);
  CHECK(upgrade_status({{"Sec-WebSocket-Protocol", "chat"},
                        {"Sec-WebSocket-Protocol", "robotraconteur.robotraconteur.com"}}) == 101);
}

TEST_CASE("an upgrade that isn't right is refused with its status") {
  CHECK(upgrade_status({{"Sec-WebSocket-Protocol", "chat"}}) == 426);
  CHECK(upgrade_status({{"Sec-WebSocket-Protocol", ""}}) == 426);
  CHECK(upgrade_status({}, http::verb::post) == 405);
  const auto without = [](const std::string& name) {
    auto headers = upgrade_headers();
    std::erase_if(headers, [&](const auto& entry) { return entry.first == name; });
    return refuse_upgrade(request(http::verb::get, "/", headers))->status;
  };
  CHECK(without("Sec-WebSocket-Key") == 426);
  CHECK(without("Sec-WebSocket-Version") == 426);
  auto old = request(http::verb::get, "/", upgrade_headers());
  old.message.version(10);
  CHECK(refuse_upgrade(old)->status == 426);
}

TEST_CASE("the 101 response is the one that native clients take") {
  CHECK(format_upgrade_response(request(http::verb::get, "/", upgrade_headers())) ==
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n"
        "Sec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\nSec-WebSocket-Version: 13\r\n\r\n");
}

TEST_CASE("close frames are for clients that are not native peers") {
  auto headers = upgrade_headers();
  CHECK_FALSE(takes_close_frames(request(http::verb::get, "/", headers)));
  CHECK(takes_close_frames(request(http::verb::get, "/", {{"Origin", "http://gw"}})));
  CHECK(takes_close_frames(request(http::verb::get, "/", {{"Sec-WebSocket-Extensions", "permessage-deflate"}})));
}

TEST_CASE("static files carry type, tag and cache rules") {
  const WebRoot root;
  StaticFiles files(root.folder / "web");
  const auto get = [&](std::string path, const Headers& headers = {}) {
    return files.answer(request(http::verb::get, "/" + path, headers), path);
  };
  const auto index = get("");
  CHECK(index.status == 200);
  CHECK(*index.body == "<html>");
  CHECK(header(index, "Content-Type") == "text/html; charset=utf-8");
  CHECK(header(index, "Cache-Control") == "no-cache");
  CHECK_THAT(
      header(index, "Content-Security-Policy"),
      Catch::StartsWith("default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self' ws: wss:"));
  CHECK(header(get("assets/client.wasm"), "Content-Type") == "application/wasm");

  const auto etag = header(index, "ETag");
  for (const auto& known : {etag, "W/" + etag, "\"other\", W/" + etag, std::string("*")}) {
    INFO(known);
    const auto again = get("", {{"If-None-Match", known}});
    CHECK(again.status == 304);
    CHECK_FALSE(again.body);
  }
  CHECK(get("", {{"If-None-Match", "\"other\", W/\"another\""}}).status == 200);

  const auto script = get("assets/app-Bx81Qz0k.js");
  CHECK(*script.body == "script");
  CHECK(header(script, "Cache-Control") == "public, max-age=31536000, immutable");
  CHECK(header(script, "Content-Encoding").empty());
  const auto brotli = get("assets/app-Bx81Qz0k.js", {{"Accept-Encoding", "gzip, deflate, br"}});
  CHECK(*brotli.body == "brotli");
  CHECK(header(brotli, "Content-Encoding") == "br");
  CHECK(header(brotli, "Content-Type") == "text/javascript; charset=utf-8");
  CHECK(header(brotli, "ETag") != header(script, "ETag"));
  CHECK(*get("assets/app-Bx81Qz0k.js", {{"Accept-Encoding", "br;q=0, gzip;q=0.5"}}).body == "gzip");
  CHECK(*get("assets/app-Bx81Qz0k.js", {{"Accept-Encoding", "deflate"}, {"Accept-Encoding", "BR"}}).body == "brotli");
}

TEST_CASE("a folder is the page in it") {
  WebRoot root;
  root.write("web/guide/index.html", "<html>guide");
  StaticFiles files(root.folder / "web");
  CHECK(*files.answer(request(http::verb::get, "/"), "guide/").body == "<html>guide");
  CHECK(files.answer(request(http::verb::get, "/"), "guide").status == 404);
}

TEST_CASE("the documentation comes with the dashboard, from the program's tree or the operator's") {
  WebRoot root;
  const auto bin = root.folder / "bin";
  root.write("share/rrgate/docs/index.html", "<html>");
  fs::create_directories(bin);
  CHECK(fs::equivalent(documentation_folder(root.folder / "web", bin), root.folder / "share/rrgate/docs"));
  CHECK(documentation_folder("", bin).empty());
  CHECK(documentation_folder(root.folder / "web", root.folder / "elsewhere/bin").empty());
  root.write("web/docs/index.html", "<html>mine");
  CHECK(documentation_folder(root.folder / "web", bin) == root.folder / "web/docs");
}

TEST_CASE("the documentation is below a path as at the root of a host") {
  boost::asio::io_context io;
  WebRoot root;
  root.write("web/docs/index.html", "<html>guide");
  const std::string links =
      R"(<a href="/docs/x"> <code>/docs/</code> https://a.b/docs/ "{\"base\":\"/docs/\"}" url(/docs/y))";
  for (const auto* name : {"page.html", "page.js", "page.js.gz", "page.css", "page.txt"})
    root.write(std::string("web/docs/") + name, links);
  Config config;
  config.web_root = (root.folder / "web").string();
  Gateway gateway(io, std::move(config));
  const auto get = [&](const std::string& path, const std::string& prefix = "") {
    auto asked = request(http::verb::get, path);
    asked.arrival.prefix = prefix;
    asked.message.set(http::field::accept_encoding, "gzip");
    return gateway.router().answer(asked);
  };
  CHECK(*get("/docs/").body == "<html>guide");
  CHECK(header(get("/docs/"), "Content-Security-Policy") == header(get("/"), "Content-Security-Policy"));
  CHECK(get("/docs").status == 308);
  CHECK(header(get("/docs"), "Location") == "docs/");
  CHECK(*get("/docs/", "/robots").body == "<html>guide");
  const std::string below =
      R"(<a href="/a/b/docs/x"> <code>/docs/</code> https://a.b/docs/ "{\"base\":\"/a/b/docs/\"}" url(/a/b/docs/y))";
  for (const auto* name : {"page.html", "page.js", "page.css"}) {
    CHECK(*get(std::string("/docs/") + name, "/a/b").body == below);
    CHECK(*get(std::string("/docs/") + name).body == links);
  }
  CHECK(*get("/docs/page.txt", "/a/b").body == links);
  CHECK(header(get("/docs/page.js", "/a/b"), "Content-Encoding").empty());
  CHECK(get("/docs/nothing.html", "/a/b").status == 404);
  auto known = request(http::verb::get, "/docs/page.html");
  known.arrival.prefix = "/a/b";
  known.message.set(http::field::if_none_match, header(get("/docs/page.html"), "ETag"));
  CHECK(gateway.router().answer(known).status == 304);
  known.message.set(http::field::if_none_match, "W/" + header(get("/docs/page.html"), "ETag"));
  CHECK(gateway.router().answer(known).status == 304);
}

TEST_CASE("a file that changes is read again") {
  WebRoot root;
  StaticFiles files(root.folder / "web");
  const auto body = [&] { return *files.answer(request(http::verb::get, "/"), "").body; };
  CHECK(body() == "<html>");
  root.write("web/index.html", "<html>new");
  fs::last_write_time(root.folder / "web" / "index.html", fs::file_time_type::clock::now() + std::chrono::seconds(5));
  CHECK(body() == "<html>new");
}

TEST_CASE("nothing outside the folder is served") {
  const WebRoot root;
  StaticFiles files(root.folder / "web");
  for (const auto path : {"../secret.txt", "%2e%2e/secret.txt", "assets/../../secret.txt", "..%2fsecret.txt",
                          "link.txt", ".hidden", "assets", "assets/", "/etc/passwd", "//etc/passwd", "%00",
                          "index.html%00.js", "%", "..\\secret.txt", "nothing.html"}) {
    INFO(path);
    CHECK(files.answer(request(http::verb::get, "/"), path).status == 404);
  }
  StaticFiles nowhere("");
  CHECK(nowhere.answer(request(http::verb::get, "/"), "").status == 404);
}

TEST_CASE("a name has a content hash or not") {
  for (const auto name : {"index-Bx81Qz0k.js", "client-D4e_f-12.wasm", "style-12345678.css", "a-Bx81Qz0k.js.map"})
    CHECK(has_content_hash(name));
  for (const auto name : {"index.html", "index-abcdefgh.js", "long-component.js", "Bx81Qz0k.js", "-.js", "a-b.js"}) {
    INFO(name);
    CHECK_FALSE(has_content_hash(name));
  }
}

TEST_CASE("the first bytes tell the protocol, as early as they can") {
  const auto detect = [](std::string_view text) { return detect_protocol(rr::as_bytes(text)); };
  for (const auto text : {"", "R", "RR", "RRA", "G", "GET", "PU"}) {
    INFO(text);
    CHECK(detect(text) == Protocol::undecided);
  }
  CHECK(detect("RRAC") == Protocol::robot_raconteur);
  CHECK(detect("RRACx") == Protocol::robot_raconteur);
  for (const auto text : {"GET /", "HEAD / ", "POST", "PUT / HTTP", "OPTIONS", "RRAB"})
    CHECK(detect(text) == Protocol::http);
  CHECK(detect("\x16") == Protocol::tls);
  CHECK(detect("\x16\x03\x01\x02") == Protocol::tls);
  for (const auto text : {"get ", "x", "GE\r", "G T ", "\x80\x01", "RRx"}) {
    INFO(text);
    CHECK(detect(text) == Protocol::unknown);
  }
}

TEST_CASE("a sign-in's cookie: whose it is stands in its name") {
  const auto cookie_for = [](bool is_encrypted, std::string host, std::string prefix = {}) {
    return format_sign_in_cookie({{}, {}, is_encrypted, std::move(host), std::move(prefix)}, "abc");
  };
  CHECK(cookie_for(true, "lab.example") == "__Host-rrgate=abc; Path=/; HttpOnly; SameSite=Strict; Secure");
  CHECK(cookie_for(true, "lab.example:8443") == "__Host-rrgate-8443=abc; Path=/; HttpOnly; SameSite=Strict; Secure");
  CHECK(cookie_for(true, "[fd00::1]", "/robots") ==
        "__Secure-rrgate=abc; Path=/robots/; HttpOnly; SameSite=Strict; Secure");
  CHECK(cookie_for(false, "[::1]:8080") == "rrgate-8080=abc; Path=/; HttpOnly; SameSite=Strict");
  CHECK(cookie_for(false, "localhost:x;y") == "rrgate=abc; Path=/; HttpOnly; SameSite=Strict");
  CHECK_THAT(format_sign_in_cookie({}, {}), Catch::StartsWith("rrgate=; Path=/; ") && Catch::EndsWith("; Max-Age=0"));
}

TEST_CASE("a sign-in's cookie is found among others, by its whole name") {
  const auto found = [](std::vector<std::string> lines, bool is_encrypted = false) {
    HttpRequest request;
    for (const auto& line : lines) request.message.insert(http::field::cookie, line);
    request.arrival.is_encrypted = is_encrypted;
    return std::string(sign_in_cookie(request));
  };
  CHECK(found({}).empty());
  CHECK(found({"a=b; rrgate=c.d; e=f"}) == "c.d");
  CHECK(found({"a=b", "e=f;rrgate=c.d "}) == "c.d");
  CHECK(found({"xrrgate=1; rrgate-8080=2; rrgate"}).empty());
  CHECK(found({"rrgate=1; __Host-rrgate=2"}, true) == "2");
  CHECK(found({"rrgate=1"}, true).empty());
}
