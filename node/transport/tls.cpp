#include "node/transport/tls.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/session/url.hpp"
#include "node/tls/openssl.hpp"
#include "node/tls/revocations.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

constexpr std::size_t record_size = 16 * 1024;  // of plain text, at most, says TLS
constexpr std::size_t handshake_chunk = 2048;   // before it is clear who comes
constexpr std::size_t unsent_limit = 64 * 1024;

/// How long the alert of a refusal, or the end, may take to leave.
constexpr std::chrono::milliseconds last_words_time{1000};

/// OpenSSL's reasons as error codes.
class TlsCategory final : public boost::system::error_category {
 public:
  const char* name() const noexcept override { return "tls"; }
  std::string message(int value) const override {
    const char* const reason =
        ERR_reason_error_string(ERR_PACK(ERR_LIB_SSL, 0, static_cast<unsigned long>(value) & ERR_REASON_MASK));
    return reason ? "TLS: " + std::string(reason) : "TLS: error " + std::to_string(value);
  }
};
const TlsCategory tls_category;

bool is_alert_of_peer(const error_code& error) {
  return error.category() == tls_category && error.value() >= SSL_AD_REASON_OFFSET;
}

std::string text_of(const ASN1_STRING* string) {
  unsigned char* text = nullptr;
  const int size = ASN1_STRING_to_UTF8(&text, string);
  const openssl::Text owner(text);
  std::string out = size > 0 ? std::string(reinterpret_cast<const char*>(text), static_cast<std::size_t>(size)) : "";
  // A name with a zero inside is one to people and another to programs.
  return out.find('\0') == std::string::npos ? out : std::string();
}

/// The common name, else the first alternative name that is a text.
std::string certified_name(X509* certificate) {
  const X509_NAME* subject = X509_get_subject_name(certificate);
  const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  if (at >= 0) return text_of(X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at)));
  using Names = std::unique_ptr<GENERAL_NAMES, openssl::Free<GENERAL_NAMES_free>>;
  const Names names(static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const auto* name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type == GEN_EMAIL || name->type == GEN_DNS || name->type == GEN_URI) return text_of(name->d.ia5);
  }
  return {};
}

}  // namespace

void TlsStream::Free::operator()(ssl_st* ssl) const {
  SSL_free(ssl);
}

TlsStream::TlsStream(std::unique_ptr<ByteStream> inner, TlsContextPtr context, TlsRole role, const TlsPeerOptions& peer)
    : inner_(std::move(inner)),
      context_(std::move(context)),
      check_{peer.expected},
      ssl_(SSL_new(context_->native())),
      limit_(inner_->executor(), [this] { inner_->close(); }),
      written_(inner_->executor(), asio::steady_timer::time_point::max()) {
  if (!ssl_) throw std::bad_alloc();
  SSL_set_app_data(ssl_.get(), &check_);
  SSL_set_bio(ssl_.get(), BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
  BIO_set_mem_eof_return(SSL_get_rbio(ssl_.get()), -1);  // empty means: come back with more
  if (role == TlsRole::client) {
    SSL_set_connect_state(ssl_.get());
    SSL_set_verify(ssl_.get(), SSL_VERIFY_PEER, nullptr);
    if (!context_->checks_nodes() && !set_host(peer.host)) throw std::bad_alloc();
  } else {
    SSL_set_accept_state(ssl_.get());
    // Contexts of HTTPS say it themselves.
    const bool asks = context_->checks_nodes() ? peer.asks_certificate
                                               : SSL_CTX_get_verify_mode(context_->native()) != SSL_VERIFY_NONE;
    SSL_set_verify(ssl_.get(), asks ? SSL_VERIFY_PEER : SSL_VERIFY_NONE, nullptr);
  }
}

TlsStream::~TlsStream() = default;

/// Asks for the certificate of this host, and takes no other's. The zone is no part of its name.
bool TlsStream::set_host(const std::string& zoned_host) {
  const std::string host(without_zone(zoned_host));
  X509_VERIFY_PARAM* const parameters = SSL_get0_param(ssl_.get());
  if (X509_VERIFY_PARAM_set1_ip_asc(parameters, host.c_str()) == 1) return true;
  ERR_clear_error();
  X509_VERIFY_PARAM_set_hostflags(parameters, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  return SSL_set1_host(ssl_.get(), host.c_str()) == 1 && SSL_set_tlsext_host_name(ssl_.get(), host.c_str()) == 1;
}

std::string TlsStream::client_name() const {
  if (context_->checks_nodes()) return {};
  const openssl::Certificate certificate(SSL_get1_peer_certificate(ssl_.get()));
  return certificate ? certified_name(certificate.get()) : std::string();
}

std::chrono::system_clock::time_point TlsStream::client_certificate_end() const {
  using Clock = std::chrono::system_clock;
  const openssl::Certificate certificate(SSL_get1_peer_certificate(ssl_.get()));
  std::tm end{};
  if (!certificate || ASN1_TIME_to_tm(X509_get0_notAfter(certificate.get()), &end) != 1)
    return Clock::time_point::max();
  // Certificates may end in the year 9999; the clock, which counts nanoseconds, does so in 2262.
  const std::chrono::seconds seconds(::timegm(&end));
  const auto last = std::chrono::floor<std::chrono::seconds>(Clock::time_point::max().time_since_epoch());
  return seconds < last ? Clock::time_point(seconds) : Clock::time_point::max();
}

std::string TlsStream::client_certificate_marks() const {
  return chain_marks(ssl_.get());
}

std::string TlsStream::version() const {
  return SSL_get_version(ssl_.get());
}

std::size_t TlsStream::unsent() const {
  return BIO_pending(SSL_get_wbio(ssl_.get()));
}

/// What a call of OpenSSL failed with. No error: it wants more of the peer's bytes.
error_code TlsStream::failure(int result) {
  const int kind = SSL_get_error(ssl_.get(), result);
  if (kind == SSL_ERROR_WANT_READ) return {};
  const unsigned long code = ERR_peek_error();
  ERR_clear_error();
  if (code != 0) return {ERR_GET_REASON(code), tls_category};
  return asio::error::connection_aborted;
}

/// Waits for bytes of the peer and hands them to OpenSSL.
awaitable<error_code> TlsStream::feed() {
  received_.resize(is_open_ ? record_size : handshake_chunk);
  const auto read = co_await inner_->read_some(received_);
  if (read.error) co_return read.error;
  if (read.is_end()) co_return asio::error::eof;
  BIO_write(SSL_get_rbio(ssl_.get()), received_.data(), static_cast<int>(read.bytes));
  co_return error_code();
}

/// Sends what OpenSSL has written. Both the reader and the writer may get here.
awaitable<error_code> TlsStream::flush() {
  while (is_writing_) co_await written_.async_wait(asio::as_tuple(asio::use_awaitable));
  while (!broken_ && unsent() > 0) {
    sending_.resize(unsent());
    BIO_read(SSL_get_wbio(ssl_.get()), sending_.data(), static_cast<int>(sending_.size()));
    const ByteSpan slice(sending_);
    const std::span<const ByteSpan> slices(&slice, 1);
    is_writing_ = true;
    broken_ = co_await inner_->write(slices);
    is_writing_ = false;
    written_.cancel();
  }
  co_return broken_;
}

awaitable<Result<>> TlsStream::handshake(std::chrono::milliseconds timeout) {
  limit_.arm(timeout);
  error_code error;
  for (;;) {
    ERR_clear_error();
    const int result = SSL_do_handshake(ssl_.get());
    if (result == 1) {
      error = co_await flush();
      break;
    }
    error = failure(result);
    if (error) {  // the alert that tells the peer why
      if (limit_.is_armed()) limit_.arm(last_words_time);
      co_await flush();
      break;
    }
    if (error = co_await flush(); error) break;
    if (error = co_await feed(); error) break;
  }
  const bool is_late = !limit_.is_armed();
  limit_.disarm();
  if (!error) {
    is_open_ = true;
    co_return Result<>();
  }
  if (is_late)
    co_return make_error(ErrorCode::connection_error,
                         "TLS with " + peer() + ": not done within " + std::to_string(timeout.count()) + " ms");
  co_return handshake_error(error);
}

Error TlsStream::handshake_error(const error_code& error) const {
  const auto with = "TLS with " + peer() + ": ";
  if (!check_.problem.empty())
    return make_error(ErrorCode::authentication_error, with + "the peer is refused: " + check_.problem);
  if (const long verified = SSL_get_verify_result(ssl_.get()); verified != X509_V_OK)
    return make_error(ErrorCode::authentication_error,
                      with + "the peer is refused: " + X509_verify_cert_error_string(verified));
  if (is_alert_of_peer(error))
    return make_error(ErrorCode::connection_error, with + "the peer refused (" + error.message() + ")");
  if (error == asio::error::eof) return make_error(ErrorCode::connection_error, with + "the peer ended the connection");
  return make_error(ErrorCode::connection_error, with + error.message());
}

awaitable<ReadResult> TlsStream::read_some(std::span<std::uint8_t> into) {
  if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
  for (const auto cancels = cancels_; cancels == cancels_;) {
    ERR_clear_error();
    const auto room = static_cast<int>(std::min<std::size_t>(into.size(), 1 << 30));
    const int result = SSL_read(ssl_.get(), into.data(), room);
    // Answers of TLS itself, e.g. to new keys. A writer that is at it takes them along.
    const bool has_reply = unsent() > 0 && (!is_writing_ || unsent() > unsent_limit);
    if (result > 0) {
      if (has_reply)
        if (const auto error = co_await flush(); error) co_return ReadResult{error, 0};
      co_return ReadResult{{}, static_cast<std::size_t>(result)};
    }
    if (SSL_get_error(ssl_.get(), result) == SSL_ERROR_ZERO_RETURN) co_return ReadResult{};
    const auto error = failure(result);
    if (has_reply) co_await flush();
    if (error) {
      is_open_ = false;
      co_return ReadResult{error, 0};
    }
    if (const auto lost = co_await feed(); lost) co_return ReadResult{lost, 0};
  }
  co_return ReadResult{asio::error::operation_aborted, 0};
}

void TlsStream::cancel() {
  ++cancels_;
  inner_->cancel();
}

awaitable<error_code> TlsStream::write(std::span<const ByteSpan> slices) {
  for (std::size_t i = 0; i < slices.size();) {
    // Slices that fit share a record; larger ones are read where they lie.
    ByteSpan plain = slices[i++];
    if (plain.size() < record_size && i < slices.size()) {
      staged_.assign(plain.begin(), plain.end());
      while (i < slices.size() && staged_.size() + slices[i].size() <= record_size) {
        staged_.insert(staged_.end(), slices[i].begin(), slices[i].end());
        ++i;
      }
      plain = staged_;
    }
    while (!plain.empty()) {
      ERR_clear_error();
      const int result = SSL_write(ssl_.get(), plain.data(), static_cast<int>(std::min(plain.size(), record_size)));
      if (result <= 0) {
        const auto error = failure(result);
        co_return error ? error : error_code(asio::error::connection_aborted);
      }
      plain = plain.subspan(static_cast<std::size_t>(result));
      if (unsent() >= unsent_limit)
        if (const auto error = co_await flush(); error) co_return error;
    }
  }
  co_return co_await flush();
}

awaitable<void> TlsStream::end(const EndReason& reason) {
  if (is_open_ && !broken_) {
    ERR_clear_error();
    SSL_shutdown(ssl_.get());
    limit_.arm(last_words_time);
    co_await flush();
    limit_.disarm();
  }
  co_await inner_->end(reason);
}

}  // namespace rr
