// TLS over any byte stream. Layer: node/transport. Source: transports spec section 5.
//
// OpenSSL reads and writes memory; this class moves the bytes. So TLS runs over TCP, WebSockets and whatever else is a
// ByteStream, and begins in the middle of one where STARTTLS says so.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>

#include "node/tls/tls_context.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"

struct ssl_st;

namespace rr {

enum class TlsRole : std::uint8_t { client, server };

struct TlsPeerOptions {
  NodeId expected = {};          ///< nodes: whose certificate it must be; any: whosever it is
  bool asks_certificate = true;  ///< servers of nodes: ask the client for its certificate; it may have none
  std::string host = {};         ///< clients of HTTPS: the name or address whose certificate it must be
};

class TlsStream final : public ByteStream {
 public:
  /// `inner` stands where the handshake begins. Nothing happens before handshake().
  TlsStream(std::unique_ptr<ByteStream> inner, TlsContextPtr context, TlsRole role, const TlsPeerOptions& peer);
  ~TlsStream() override;

  /// Once, before everything else.
  /// Errors   authentication_error: the peer's certificate is refused, and by which check; connection_error: the peer
  ///          refused ours, ended, spoke no TLS or took longer than `timeout`. The stream is of no use then.
  awaitable<Result<>> handshake(std::chrono::milliseconds timeout);

  /// A stream that breaks off without TLS's own end is the error eof: somebody else may have cut it.
  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override;
  awaitable<error_code> write(std::span<const ByteSpan> slices) override;
  /// Does nothing: end() follows.
  void finish_sending() override {}
  void cancel() override;
  awaitable<void> end(const EndReason& reason) override;
  void close() override { inner_->close(); }
  std::string peer() const override { return inner_->peer(); }
  std::string peer_reason() const override { return inner_->peer_reason(); }
  NodeId verified_peer() const override { return check_.found; }
  boost::asio::any_io_executor executor() override { return inner_->executor(); }

  /// Whose certificate the client of a server of HTTPS has shown: its common name, else its first alternative name;
  /// empty where it has shown none.
  std::string client_name() const;
  /// When that certificate expires; the largest time where it has shown none.
  std::chrono::system_clock::time_point client_certificate_end() const;
  /// What tells that certificate and those of the CAs between it and the one that is trusted, see chain_marks().
  std::string client_certificate_marks() const;
  /// "TLSv1.3", for logs.
  std::string version() const;

 private:
  struct Free {
    void operator()(ssl_st* ssl) const;
  };

  awaitable<error_code> feed();
  awaitable<error_code> flush();
  std::size_t unsent() const;
  bool set_host(const std::string& host);
  error_code failure(int result);
  Error handshake_error(const error_code& error) const;

  std::unique_ptr<ByteStream> inner_;
  TlsContextPtr context_;
  PeerCheck check_;
  std::unique_ptr<ssl_st, Free> ssl_;
  Deadline limit_;
  Bytes received_;           ///< reused: what the peer sent last
  Bytes staged_;             ///< reused: small slices on their way into one record
  Bytes sending_;            ///< what is being written
  std::size_t cancels_ = 0;  ///< a read of several steps looks at it between them
  bool is_open_ = false;
  bool is_writing_ = false;
  error_code broken_;                  ///< a write ended in the middle of a record: nothing more can be sent
  boost::asio::steady_timer written_;  ///< cancelled when a write ends
};

}  // namespace rr
