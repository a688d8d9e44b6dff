// rrgate mcp: the Model Context Protocol on standard input and output. Layer: server/cli. See docs/mcp.md.
//
// A gateway's devices by its /mcp, or one device by a gateway within this process, which listens nowhere.
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <future>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "node/transport/tcp.hpp"
#include "node/transport/tls.hpp"
#include "server/cli/mcp_bridge.hpp"
#include "server/cli/remote_service.hpp"
#include "server/gateway/gateway.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// More than the gateway takes of a message: what is longer is no message of anybody who means well.
constexpr std::size_t longest_line = 1024 * 1024;

struct McpOptions : RemoteOptions {
  std::optional<std::string> name;
};

using Connected = rr::Result<std::unique_ptr<rr::ByteStream>>;

rr::awaitable<Connected> connect_to_gateway(rr::ConnectionUrl url, rr::TlsContextPtr tls,
                                            std::chrono::milliseconds timeout) {
  auto host = url.host;
  auto socket = co_await rr::connect_tcp(std::move(host), url.port, timeout);
  if (!socket) co_return socket.error();
  auto tcp = rr::make_tcp_stream(std::move(*socket), timeout);
  if (!tls) co_return tcp;
  rr::TlsPeerOptions peer;
  peer.host = url.host;
  auto stream = std::make_unique<rr::TlsStream>(std::move(tcp), std::move(tls), rr::TlsRole::client, peer);
  if (const auto shaken = co_await stream->handshake(timeout); !shaken) co_return shaken.error();
  co_return stream;
}

/// Throws   NotUnderstood, rr::Exception.
McpServer server_at(const McpOptions& options) {
  const auto address = remote_address(options);
  auto base = gateway_base(options.url);
  if (base.ends_with("/mcp")) base = base.substr(0, base.size() - 4);
  auto url = rr::parse_url(gateway_url(base), rr::ServiceInUrl::optional);
  if (!url) throw NotUnderstood(url.error().message);
  rr::TlsContextPtr tls;
  if (base.starts_with("https://")) {
    auto made = rr::make_web_client_tls({});
    if (!made) throw rr::ClientException(made.error());
    tls = std::move(*made);
  }
  const auto host = base.find("://") + 3;
  const auto path = std::min(base.find('/', host), base.size());
  McpServer out;
  out.connect = [url = *url, tls, timeout = address.timeout] { return connect_to_gateway(url, tls, timeout); };
  out.authority = base.substr(host, path - host);
  out.path = base.substr(path) + "/mcp";
  out.headers = address.options.dial.headers;
  return out;
}

/// Throws   NotUnderstood.
Config config_for(const McpOptions& options) {
  const auto address = remote_address(options);
  const auto url = rr::parse_url(options.url);
  if (!url) throw NotUnderstood(url.error().message);
  auto text = nlohmann::json::object();
  text["devices"] = {{{"name", options.name.value_or(url->service)}, {"url", options.url}, {"mode", "shared"}}};
  text["mcp"] = nlohmann::json::object();
  text["listen"] = {"127.0.0.1:0"};  // none, below
  text["log"] = {{"level", "warning"}};
  auto read = parse_config(text.dump());
  if (!read.findings.empty()) throw NotUnderstood(format_finding("configuration", read.findings.front()));
  auto& login = read.config.devices.front().login;
  login.username = options.user;
  if (const auto* given = address.options.credentials.get_if<rr::MapString>()) login.credentials = *given;
  read.config.timeouts.connect = address.timeout;
  read.config.listen.clear();
  return std::move(read.config);
}

/// What an agent asks first waits until it is known whether the device is there.
rr::awaitable<void> wait_for_look(Gateway& gateway, std::chrono::milliseconds longest) {
  asio::steady_timer again(co_await asio::this_coro::executor);
  const auto deadline = std::chrono::steady_clock::now() + longest;
  while (gateway.devices().all().front()->state() == DeviceState::connecting &&
         std::chrono::steady_clock::now() < deadline) {
    again.expires_after(std::chrono::milliseconds(20));
    co_await again.async_wait(asio::use_awaitable);
  }
}

/// Hands each line of standard input to the loop's thread, and waits until it is taken: the client waits too then.
void read_lines(asio::io_context& io, McpBridge& bridge) {
  const auto on_loop = [&io](const std::function<void()>& work) {
    std::promise<void> done;
    asio::post(io, [&] {
      work();
      done.set_value();
    });
    done.get_future().wait();
  };
  std::string unread;
  std::array<char, 64 * 1024> chunk;
  for (;;) {
    const auto size = ::read(STDIN_FILENO, chunk.data(), chunk.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    unread.append(chunk.data(), static_cast<std::size_t>(size));
    std::size_t begin = 0;
    for (auto end = unread.find('\n'); end != std::string::npos; end = unread.find('\n', begin)) {
      on_loop([&] { bridge.take(std::string_view(unread).substr(begin, end - begin)); });
      begin = end + 1;
    }
    unread.erase(0, begin);
    if (unread.size() > longest_line) {
      std::cerr << "rrgate mcp: a line of more than " << longest_line << " bytes\n";
      break;
    }
  }
  if (!unread.empty()) on_loop([&] { bridge.take(unread); });
  on_loop([&] { bridge.end(); });
}

/// `stop`  ends what else goes on, so that the loop comes to its end.
void serve_lines(asio::io_context& io, McpServer server, std::function<void()> stop) {
  const auto tell = [](std::string_view line) { std::cout << line << std::endl; };
  auto until_end = asio::make_work_guard(io);
  McpBridge bridge(io.get_executor(), std::move(server), tell, [&] {
    until_end.reset();
    if (stop) stop();
  });
  std::jthread reading([&] { read_lines(io, bridge); });
  io.run();
}

int run_mcp(const McpOptions& options) {
  return run_remote("mcp", options.url, [&] {
    asio::io_context io(1);
    if (!gateway_url(options.url).empty()) return serve_lines(io, server_at(options), nullptr);
    auto config = config_for(options);
    configure_log(config.log.level, config.log.format);
    Gateway gateway(io, std::move(config));
    if (const auto started = gateway.start(); !started) throw rr::ClientException(started.error());
    McpServer server;
    server.connect = [&gateway, longest = gateway.config().timeouts.connect]() -> rr::awaitable<Connected> {
      co_await wait_for_look(gateway, longest);
      co_return gateway.connect_inside();
    };
    server.authority = "localhost";
    serve_lines(io, std::move(server), [&gateway] {
      gateway.stop([] {});
      gateway.stop([] {});  // at once: nobody else has a session
    });
  });
}

}  // namespace

void add_mcp(Commands& commands) {
  const auto [app, options] = commands.add(
      "mcp", "Give a language model devices by standard input and output (Model Context Protocol)", run_mcp);
  options.url = "http://127.0.0.1:8080";
  takes_websocket_url(
      app.add_option(
          "URL", options.url,
          "A gateway's http(s)://HOST:PORT, for all that it lets the login do; or a service, to be read alone"))
      ->option_text("[http://127.0.0.1:8080]");
  app.add_option("--name", options.name, "Of the device, without a gateway; the service's without it")
      ->option_text("NAME");
  add_connection_options(app, options);
}

}  // namespace rrgate
