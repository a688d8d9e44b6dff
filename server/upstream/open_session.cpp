#include "server/upstream/open_session.hpp"

#include <boost/asio/use_awaitable.hpp>

#include "node/client/async_object.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

using ConnectionPtr = std::shared_ptr<rr::ClientConnection>;

auto begin_session(std::unique_ptr<rr::ByteStream> stream, rr::ClientOptions options) {
  const auto executor = stream->executor();
  constexpr asio::use_awaitable_t<> token;
  return asio::async_initiate<const asio::use_awaitable_t<>, void(std::exception_ptr, ConnectionPtr)>(
      [executor, stream = std::move(stream), options = std::move(options)](auto handler) mutable {
        const rr::detail::CompleteOnce<ConnectionPtr, decltype(handler)> complete(std::move(handler), executor);
        rr::ClientConnection::open(std::move(stream), std::move(options), complete);
      },
      token);
}

}  // namespace

rr::awaitable<rr::Result<ConnectionPtr>> open_session(std::unique_ptr<rr::ByteStream> stream,
                                                      const std::string& service, const rr::NodeIdentity& target,
                                                      const std::string& username, const rr::MapString& credentials,
                                                      bool is_stepwise) {
  rr::ClientOptions options;
  options.service = service;
  options.connection.self.name = "rrgate";
  options.connection.target = target;
  if (is_stepwise) options.connection.features.combined_v2 = options.connection.features.combined_v4 = false;
  if (!username.empty()) {
    options.username = username;
    options.credentials = rr::Value(credentials);
  }
  try {
    co_return co_await begin_session(std::move(stream), std::move(options));
  } catch (const rr::Exception& exception) {
    co_return exception.error();
  }
}

}  // namespace rrgate
