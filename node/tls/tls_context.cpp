#include "node/tls/tls_context.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/session/start_tls.hpp"
#include "node/tls/client_certificates.hpp"
#include "node/tls/node_certificate_check.hpp"
#include "node/tls/openssl.hpp"
#include "node/tls/revocations.hpp"

namespace rr {

namespace {

using openssl::last_error;

Error unusable(std::string what) {
  return make_error(ErrorCode::invalid_configuration, std::move(what));
}

openssl::Context make_context() {
  openssl::Context context(SSL_CTX_new(TLS_method()));
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  SSL_CTX_set_options(context.get(), SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_cipher_list(context.get(), "ECDHE+AESGCM:ECDHE+CHACHA20");  // TLS 1.2; those of 1.3 are all good
  SSL_CTX_set_mode(context.get(),
                   SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER | SSL_MODE_RELEASE_BUFFERS);
  // Nothing is kept for a second connection: what a certificate proves is proved each time.
  SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);
  return context;
}

// --- nodes ---

int check_node(X509_STORE_CTX* store, void*) {
  auto* ssl = static_cast<SSL*>(X509_STORE_CTX_get_ex_data(store, SSL_get_ex_data_X509_STORE_CTX_idx()));
  auto* check = static_cast<PeerCheck*>(SSL_get_app_data(ssl));
  auto found = check_node_chain(store);
  if (found && !check->expected.is_any() && *found != check->expected)
    found = make_error(ErrorCode::authentication_error, "the certificate is of node " + format_node_id(*found) +
                                                            ", expected node " + format_node_id(check->expected));
  if (found) {
    check->found = *found;
    return 1;
  }
  check->problem = found.error().message;
  if (X509_STORE_CTX_get_error(store) == X509_V_OK)
    X509_STORE_CTX_set_error(store, X509_V_ERR_APPLICATION_VERIFICATION);
  return 0;
}

bool is_published_root(X509* certificate) {
  constexpr std::array<std::uint8_t, 32> roots[] = {
      // Robot Raconteur Node Root CA (2015-2045)
      {0xca, 0x63, 0x04, 0xef, 0x91, 0x29, 0x9f, 0xf7, 0x6a, 0x21, 0xcc, 0xc5, 0xb5, 0x7f, 0x1b, 0xef,
       0xcd, 0xcb, 0x4e, 0xd8, 0xb3, 0x89, 0xae, 0x55, 0x84, 0x30, 0x70, 0xdc, 0x0f, 0x39, 0xee, 0xfe},
      // Robot Raconteur Node Root CA 2 (2020-2060)
      {0x4b, 0xdc, 0x4e, 0xc4, 0xb5, 0x20, 0xae, 0xea, 0x3d, 0x46, 0x8b, 0x38, 0x6b, 0xa8, 0xf7, 0x0b,
       0xf9, 0xd1, 0xdc, 0x3c, 0xdc, 0xec, 0x12, 0x97, 0xbd, 0xa2, 0x69, 0x12, 0x97, 0xc9, 0x04, 0x64},
  };
  std::array<std::uint8_t, 32> digest{};
  return X509_digest(certificate, EVP_sha256(), digest.data(), nullptr) == 1 &&
         std::find(std::begin(roots), std::end(roots), digest) != std::end(roots);
}

Result<> add_published_roots(X509_STORE* store, const std::string& file) {
  const openssl::Bio in(BIO_new_file(file.c_str(), "r"));
  if (!in) return unusable("CA file " + quote(file, 200) + ": " + last_error());
  int added = 0;
  while (const openssl::Certificate certificate{PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr)})
    if (is_published_root(certificate.get())) added += X509_STORE_add_cert(store, certificate.get());
  ERR_clear_error();
  if (added == 0)
    return unusable("CA file " + quote(file, 200) +
                    ": none of the published Robot Raconteur roots is in it; a CA of your own is named by "
                    "ROBOTRACONTEUR_SSL_CERT_FILE");
  return {};
}

Result<> set_trust(SSL_CTX* context, const TlsTrust& trust) {
  X509_STORE* const store = SSL_CTX_get_cert_store(context);
  for (const auto& file : trust.files)
    if (X509_STORE_load_file(store, file.c_str()) != 1)
      return unusable("CA file " + quote(file, 200) + ": " + last_error() + "; expected certificates in PEM");
  for (const auto& directory : trust.directories)
    if (X509_STORE_load_path(store, directory.c_str()) != 1)
      return unusable("CA folder " + quote(directory, 200) + ": " + last_error());
  for (const auto& file : trust.published_roots)
    if (auto added = add_published_roots(store, file); !added) return added.error();
  return {};
}

Result<> load_node_certificate(SSL_CTX* context, const std::string& file, const NodeId& id) {
  const auto fail = [&file](const std::string& why) {
    return unusable("node certificate " + quote(file, 200) + ": " + why);
  };
  const openssl::Bio in(BIO_new_file(file.c_str(), "rb"));
  if (!in) return fail(last_error());
  const openssl::Pkcs12 bundle(d2i_PKCS12_bio(in.get(), nullptr));
  if (!bundle) return fail("not a PKCS#12 file: " + last_error());
  EVP_PKEY* key_pointer = nullptr;
  X509* certificate_pointer = nullptr;
  STACK_OF(X509)* chain_pointer = nullptr;
  const bool is_parsed = PKCS12_parse(bundle.get(), "", &key_pointer, &certificate_pointer, &chain_pointer) == 1;
  const openssl::Key key(key_pointer);
  const openssl::Certificate certificate(certificate_pointer);
  const openssl::Chain chain(chain_pointer);
  if (!is_parsed) return fail(last_error() + "; expected an empty password and a cipher of this century");
  if (!key || !certificate) return fail("expected a key and the certificate of it");

  const X509_NAME* subject = X509_get_subject_name(certificate.get());
  char name[256] = {};
  X509_NAME_get_text_by_NID(const_cast<X509_NAME*>(subject), NID_commonName, name, sizeof(name));
  const auto found = parse_certificate_name(name);
  if (!found) return fail(found.error().message);
  if (*found != id) return fail("it is of node " + format_node_id(*found) + ", expected " + format_node_id(id));
  if (X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0) return fail("it has expired");

  if (SSL_CTX_use_certificate(context, certificate.get()) != 1 || SSL_CTX_use_PrivateKey(context, key.get()) != 1)
    return fail(last_error());
  for (int i = 0; i < sk_X509_num(chain.get()); ++i) {
    X509* const ca = sk_X509_value(chain.get(), i);
    if (X509_check_issued(ca, ca) == X509_V_OK) continue;  // a root: the peer has it, or won't believe this one
    if (SSL_CTX_add1_chain_cert(context, ca) != 1) return fail(last_error());
  }
  return {};
}

// --- HTTPS ---

/// Browsers offer HTTP/2 as well, which is not spoken here.
int choose_protocol(SSL*, const unsigned char** out, unsigned char* out_size, const unsigned char* offered,
                    unsigned offered_size, void*) {
  static constexpr unsigned char spoken[] = "\x08http/1.1";
  unsigned char* chosen = nullptr;
  if (SSL_select_next_proto(&chosen, out_size, spoken, sizeof(spoken) - 1, offered, offered_size) !=
      OPENSSL_NPN_NEGOTIATED)
    return SSL_TLSEXT_ERR_ALERT_FATAL;
  *out = chosen;
  return SSL_TLSEXT_ERR_OK;
}

bool is_for_host(SSL_CTX* context, const char* name) {
  return X509_check_host(SSL_CTX_get0_certificate(context), name, 0, 0, nullptr) == 1;
}

int choose_certificate(SSL* ssl, int*, void* argument) {
  const auto& context = *static_cast<const TlsContext*>(argument);
  const char* const name = SSL_get_servername(ssl, TLSEXT_NAMETYPE_host_name);
  if (!name) return SSL_TLSEXT_ERR_OK;
  for (SSL_CTX* candidate : context.all())
    if (is_for_host(candidate, name)) {
      SSL_set_SSL_CTX(ssl, candidate);
      break;
    }
  return SSL_TLSEXT_ERR_OK;
}

Result<> load_web_certificate(SSL_CTX* context, const WebCertificate& files) {
  if (SSL_CTX_use_certificate_chain_file(context, files.certificate_file.c_str()) != 1)
    return unusable("certificate " + quote(files.certificate_file, 200) + ": " + last_error() +
                    "; expected PEM, the server's own certificate first");
  if (SSL_CTX_use_PrivateKey_file(context, files.key_file.c_str(), SSL_FILETYPE_PEM) != 1)
    return unusable("key " + quote(files.key_file, 200) + ": " + last_error() + "; expected the PEM key of " +
                    quote(files.certificate_file, 200) + ", without a password");
  if (X509_cmp_current_time(X509_get0_notAfter(SSL_CTX_get0_certificate(context))) < 0)
    return unusable("certificate " + quote(files.certificate_file, 200) + ": it has expired");
  return {};
}

Result<> add_revocation_list(X509_STORE* store, const std::string& file) {
  auto added = read_revocation_lists(file, [store](X509_CRL* list) { X509_STORE_add_crl(store, list); });
  if (added) X509_STORE_set_flags(store, X509_V_FLAG_CRL_CHECK | X509_V_FLAG_CRL_CHECK_ALL);
  return added;
}

/// Says whose certificates clients may show.
Result<> ask_clients(SSL_CTX* context, const ClientTrust& clients) {
  if (clients.ca.empty()) return {};
  TlsTrust trust;
  trust.files = clients.ca;
  if (auto done = set_trust(context, trust); !done) return done;
  for (const auto& file : clients.crl)
    if (auto done = add_revocation_list(SSL_CTX_get_cert_store(context), file); !done) return done;
  // Of several certificates a browser offers those of these CAs.
  STACK_OF(X509_NAME)* const names = sk_X509_NAME_new_null();
  for (const auto& file : clients.ca) SSL_add_file_cert_subjects_to_stack(names, file.c_str());
  SSL_CTX_set_client_CA_list(context, names);  // takes them over
  SSL_CTX_set_purpose(context, X509_PURPOSE_SSL_CLIENT);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);  // who shows none may come all the same
  // Shown each time: nothing is resumed.
  SSL_CTX_set_options(context, SSL_OP_NO_TICKET);
  SSL_CTX_set_num_tickets(context, 0);
  return {};
}

/// A key with a password would ask for it on the terminal.
int no_password(char*, int, int, void*) {
  return -1;
}

}  // namespace

TlsContext::TlsContext(std::vector<ssl_ctx_st*> native, bool has_certificate, bool checks_nodes)
    : native_(std::move(native)), has_certificate_(has_certificate), checks_nodes_(checks_nodes) {}

bool TlsContext::has_name(const std::string& host) const {
  return std::any_of(native_.begin(), native_.end(),
                     [&](SSL_CTX* context) { return is_for_host(context, host.c_str()); });
}

TlsContext::~TlsContext() {
  for (SSL_CTX* context : native_) SSL_CTX_free(context);
}

Result<TlsContextPtr> make_node_tls(const NodeTlsOptions& options) {
  ERR_clear_error();
  auto context = make_context();
  SSL_CTX_set_options(context.get(), SSL_OP_NO_TICKET);
  SSL_CTX_set_num_tickets(context.get(), 0);
  SSL_CTX_set_cert_verify_callback(context.get(), check_node, nullptr);
  if (auto done = set_trust(context.get(), options.trust); !done) return done.error();
  const bool has_certificate = !options.certificate_file.empty();
  if (has_certificate)
    if (auto done = load_node_certificate(context.get(), options.certificate_file, options.id); !done)
      return done.error();
  return std::make_shared<const TlsContext>(std::vector<SSL_CTX*>{context.release()}, has_certificate, true);
}

Result<TlsContextPtr> make_web_client_tls(const TlsTrust& trust) {
  ERR_clear_error();
  auto context = make_context();
  if (trust == TlsTrust{}) {
    if (SSL_CTX_set_default_verify_paths(context.get()) != 1) return unusable("the system's CAs: " + last_error());
  } else if (auto done = set_trust(context.get(), trust); !done) {
    return done.error();
  }
  return std::make_shared<const TlsContext>(std::vector<SSL_CTX*>{context.release()}, false, false);
}

Result<TlsContextPtr> make_web_tls(std::span<const WebCertificate> certificates) {
  return make_web_tls(certificates, ClientTrust());
}

Result<TlsContextPtr> make_web_tls(std::span<const WebCertificate> certificates, const ClientTrust& clients) {
  ERR_clear_error();
  if (certificates.empty()) return unusable("TLS without a certificate");
  std::vector<openssl::Context> contexts;
  for (const auto& files : certificates) {
    auto context = make_context();
    SSL_CTX_set_default_passwd_cb(context.get(), no_password);
    if (auto done = load_web_certificate(context.get(), files); !done) return done.error();
    SSL_CTX_set_alpn_select_cb(context.get(), choose_protocol, nullptr);
    if (auto done = ask_clients(context.get(), clients); !done) return done.error();
    contexts.push_back(std::move(context));
  }
  std::vector<SSL_CTX*> native;
  for (auto& context : contexts) native.push_back(context.release());
  auto made = std::make_shared<const TlsContext>(std::move(native), true, false);
  SSL_CTX_set_tlsext_servername_callback(made->native(), choose_certificate);
  SSL_CTX_set_tlsext_servername_arg(made->native(), const_cast<TlsContext*>(made.get()));
  return made;
}

}  // namespace rr
