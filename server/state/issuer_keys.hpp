// The keys that an issuer of JSON Web Tokens publishes, fetched by HTTPS. Layer: server/state.
// Source: OpenID Connect Discovery 1.0, section 4; RFC 7517.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <string>

#include "node/tls/tls_context.hpp"
#include "node/transport/byte_stream.hpp"
#include "server/access/access.hpp"

namespace rrgate {

/// Fetches them at the start, each hour, and when a token names one that is not here; gives them to Access. What can't
/// be fetched stays as it was, and is tried again. For the gateway's thread, which waits for none of it.
class IssuerKeys {
 public:
  IssuerKeys(boost::asio::any_io_executor executor, Access& access);
  IssuerKeys(const IssuerKeys&) = delete;
  IssuerKeys& operator=(const IssuerKeys&) = delete;

  /// Begins where the configuration says so; again after it has changed.
  void start();
  void stop();
  /// Waits until the keys are those of now, where they were not fetched for this reason just before.
  rr::awaitable<void> look_anew();

 private:
  rr::awaitable<void> run();
  rr::awaitable<rr::Result<>> fetch();
  rr::awaitable<rr::Result<std::string>> get(std::string url, rr::TlsContextPtr tls);

  boost::asio::any_io_executor executor_;
  Access& access_;
  boost::asio::steady_timer next_;     ///< runs until the next fetch
  boost::asio::steady_timer fetched_;  ///< cancelled when a fetch is over
  std::chrono::steady_clock::time_point asked_{};
  rr::ByteStream* stream_ = nullptr;  ///< to the issuer, while there is one
  bool is_running_ = false;
  bool is_fetching_ = false;
  bool is_stopping_ = false;
};

}  // namespace rrgate
