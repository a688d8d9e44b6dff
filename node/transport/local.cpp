#include "node/transport/local.hpp"

#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <vector>

#include "core/discovery/announcement.hpp"
#include "node/platform/folders.hpp"
#include "node/transport/accept_all.hpp"
#include "node/transport/socket_stream.hpp"

namespace rr {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using asio::local::stream_protocol;

namespace {

constexpr int socket_attempts = 3;
constexpr std::size_t max_socket_path = 107;  // of sockaddr_un, with its final NUL 108

/// The user at the other end.
std::optional<uid_t> peer_user(stream_protocol::socket& socket) {
  ucred credentials{};
  socklen_t size = sizeof(credentials);
  if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return std::nullopt;
  return credentials.uid;
}

std::optional<uid_t> user_number(const std::string& name) {
  std::vector<char> buffer(16 * 1024);
  passwd entry{};
  passwd* found = nullptr;
  if (::getpwnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || !found) return std::nullopt;
  return entry.pw_uid;
}

}  // namespace

Result<> LocalListener::open(const NodeIdentity& node, std::string nonce, bool is_public) {
  const auto folders = is_public ? make_public_folders() : make_local_folders();
  if (!folders) return folders.error();
  clean_local_base(folders->base, folders->sockets);
  auto files = LocalNodeFiles::take(folders->base, node);
  if (!files) return files.error();
  error_code error;
  for (int i = 0; i < socket_attempts; ++i) {
    const auto path = (folders->sockets / (make_service_state_nonce() + ".sock")).string();
    if (path.size() > max_socket_path)
      return make_error(ErrorCode::system_resource_error,
                        path + " is too long for a socket: " + std::to_string(max_socket_path) + " bytes at most");
    acceptor_->open(stream_protocol(), error);
    if (!error) acceptor_->bind(stream_protocol::endpoint(path), error);
    if (!error) {
      ::chmod(path.c_str(), 0770);
      acceptor_->listen(asio::socket_base::max_listen_connections, error);
    }
    if (!error) {
      info_ = {node, path, user_name(), std::move(nonce)};
      files_.emplace(std::move(*files));
      return files_->publish(info_);
    }
    error_code ignored;
    acceptor_->close(ignored);
  }
  return make_error(ErrorCode::system_resource_error,
                    "socket in " + folders->sockets.string() + ": " + error.message());
}

void LocalListener::start(OnAccept on_accept, OnProblem on_problem, std::chrono::milliseconds send_stall) {
  auto welcome = [on_accept = std::move(on_accept), send_stall](stream_protocol::socket socket) {
    const auto user = peer_user(socket);
    std::string peer = "local user " + (user ? std::to_string(*user) : "unknown");
    on_accept(std::make_unique<SocketStream>(std::move(socket), std::move(peer), send_stall));
  };
  const auto executor = acceptor_->get_executor();
  asio::co_spawn(executor, accept_all(acceptor_, std::move(welcome), std::move(on_problem)), asio::detached);
}

Result<> LocalListener::publish(std::string nonce) {
  info_.nonce = std::move(nonce);
  return files_ ? files_->publish(info_) : Result<>();
}

void LocalListener::close() {
  error_code ignored;
  acceptor_->close(ignored);
  if (files_) {
    std::error_code gone;
    fs::remove(info_.socket, gone);
  }
  files_.reset();
}

awaitable<Result<std::unique_ptr<ByteStream>>> dial_local(ConnectionUrl url, DialOptions options) {
  const auto fail = [&](ErrorCode code, const std::string& why) {
    return make_error(code, "connect to " + format_url(url) + ": " + why);
  };
  const auto bases = local_bases(url);
  if (!bases) co_return bases.error();
  const auto executor = co_await asio::this_coro::executor;
  std::string failures;
  for (const auto& base : *bases) {
    const auto info = find_local_node(base, url);
    if (!info) continue;
    const auto complain = [&](const std::string& why) {
      failures += (failures.empty() ? "" : "; ") + info->socket + ": " + why;
    };
    if (info->socket.size() > max_socket_path) {
      complain("the path is too long for a socket");
      continue;
    }
    stream_protocol::socket socket(executor);
    const auto [error] =
        co_await socket.async_connect(stream_protocol::endpoint(info->socket), asio::as_tuple(asio::use_awaitable));
    if (error) {
      complain(error.message());
      continue;
    }
    const auto there = peer_user(socket);
    const auto expected = url.user.empty() ? std::optional<uid_t>(::geteuid()) : user_number(url.user);
    if (!there || (*there != 0 && there != expected)) {
      complain("it is not that user's");
      continue;
    }
    std::unique_ptr<ByteStream> stream =
        std::make_unique<SocketStream>(std::move(socket), "local:" + info->socket, options.send_stall);
    co_return stream;
  }
  if (failures.empty()) co_return fail(ErrorCode::node_not_found, "no such node of this machine");
  co_return fail(ErrorCode::connection_error, failures);
}

}  // namespace rr
