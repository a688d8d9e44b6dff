#include "node/tls/issue_certificates.hpp"

#include <openssl/pem.h>

#include "node/tls/openssl.hpp"

namespace rr {

namespace {

using openssl::last_error;

using Extension = std::unique_ptr<X509_EXTENSION, openssl::Free<X509_EXTENSION_free>>;
using Number = std::unique_ptr<BIGNUM, openssl::Free<BN_free>>;
using Object = std::unique_ptr<ASN1_OBJECT, openssl::Free<ASN1_OBJECT_free>>;
using Octets = std::unique_ptr<ASN1_OCTET_STRING, openssl::Free<ASN1_OCTET_STRING_free>>;

Error failed(const char* what) {
  return make_error(ErrorCode::internal_error, std::string(what) + ": " + last_error());
}

openssl::Bio reader(const std::string& text) {
  return openssl::Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

std::string contents(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

openssl::Certificate read_certificate(const std::string& pem) {
  return openssl::Certificate(PEM_read_bio_X509(reader(pem).get(), nullptr, nullptr, nullptr));
}

openssl::Key read_key(const std::string& pem) {
  return openssl::Key(PEM_read_bio_PrivateKey(reader(pem).get(), nullptr, nullptr, nullptr));
}

bool add_extension(X509* certificate, X509V3_CTX& context, int nid, const char* value) {
  const Extension extension(X509V3_EXT_nconf_nid(nullptr, &context, nid, value));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// Critical, and its value the boolean true.
bool add_level(X509* certificate, const std::string& oid) {
  static constexpr unsigned char yes[] = {0x01, 0x01, 0xff};
  const Object object(OBJ_txt2obj(oid.c_str(), 1));
  const Octets value(ASN1_OCTET_STRING_new());
  if (!object || !value || ASN1_OCTET_STRING_set(value.get(), yes, sizeof(yes)) != 1) return false;
  const Extension extension(X509_EXTENSION_create_by_OBJ(nullptr, object.get(), 1, value.get()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// "DNS:lab.example,IP:192.168.1.5", for X509V3_EXT_nconf_nid.
Result<std::string> format_hosts(const std::vector<std::string>& hosts) {
  std::string out;
  for (const auto& host : hosts) {
    const bool is_plain = !host.empty() && host.find_first_not_of(
                                               "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                               "0123456789.-_:*") == std::string::npos;
    if (!is_plain)
      return make_error(ErrorCode::invalid_argument,
                        "host " + rr::quote(host) + ": expected a name or an IP address, without port");
    const Octets address(a2i_IPADDRESS(host.c_str()));
    if (!address && host.find(':') != std::string::npos)
      return make_error(ErrorCode::invalid_argument, "host " + rr::quote(host) + ": not an IPv6 address");
    ERR_clear_error();
    out += (out.empty() ? "" : ",") + std::string(address ? "IP:" : "DNS:") + host;
  }
  return out;
}

bool set_random_serial(X509* certificate) {
  const Number number(BN_new());
  return number && BN_rand(number.get(), 127, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) == 1 &&
         BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate));
}

}  // namespace

Result<CertificateAndKey> issue_certificate(const CertificateWish& wish, const CertificateAndKey* issuer) {
  ERR_clear_error();
  const openssl::Key key(EVP_EC_gen("P-256"));
  const openssl::Certificate certificate(X509_new());
  if (!key || !certificate) return failed("make a key");
  openssl::Certificate ca;
  openssl::Key ca_key;
  if (issuer) {
    ca = read_certificate(issuer->certificate);
    ca_key = read_key(issuer->key);
    if (!ca || !ca_key || X509_check_private_key(ca.get(), ca_key.get()) != 1)
      return make_error(ErrorCode::invalid_argument,
                        "the CA's certificate and key can't be read or don't belong together: " + last_error());
  }
  X509* const signer = ca ? ca.get() : certificate.get();

  X509_set_version(certificate.get(), X509_VERSION_3);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), wish.begins_after_seconds);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), wish.ends_after_seconds);
  X509_set_pubkey(certificate.get(), key.get());
  X509_NAME* const name = X509_get_subject_name(certificate.get());
  if (!set_random_serial(certificate.get()) ||
      X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8,
                                 reinterpret_cast<const unsigned char*>(wish.common_name.data()),
                                 static_cast<int>(wish.common_name.size()), -1, 0) != 1)
    return make_error(ErrorCode::invalid_argument,
                      "common name " + rr::quote(wish.common_name) + " can't be used: " + last_error());
  X509_set_issuer_name(certificate.get(), X509_get_subject_name(signer));

  X509V3_CTX context;
  X509V3_set_ctx(&context, signer, certificate.get(), nullptr, nullptr, 0);
  const auto hosts = format_hosts(wish.hosts);
  if (!hosts) return hosts.error();
  const auto add = [&](int nid, const char* value) { return add_extension(certificate.get(), context, nid, value); };
  bool is_good = add(NID_basic_constraints, wish.is_ca ? "critical,CA:TRUE" : "critical,CA:FALSE") &&
                 add(NID_key_usage, wish.is_ca ? "critical,keyCertSign,cRLSign" : "critical,digitalSignature") &&
                 add(NID_subject_key_identifier, "hash");
  if (issuer) is_good = is_good && add(NID_authority_key_identifier, "keyid");
  if (!wish.is_ca)
    is_good = is_good && add(NID_ext_key_usage, wish.hosts.empty() ? "serverAuth,clientAuth" : "serverAuth");
  if (!hosts->empty()) is_good = is_good && add(NID_subject_alt_name, hosts->c_str());
  if (!wish.node_level_oid.empty()) is_good = is_good && add_level(certificate.get(), wish.node_level_oid);
  if (!is_good || X509_sign(certificate.get(), ca_key ? ca_key.get() : key.get(), EVP_sha256()) == 0)
    return failed("make a certificate");

  const openssl::Bio certificate_out(BIO_new(BIO_s_mem()));
  const openssl::Bio key_out(BIO_new(BIO_s_mem()));
  if (PEM_write_bio_X509(certificate_out.get(), certificate.get()) != 1 ||
      PEM_write_bio_PKCS8PrivateKey(key_out.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return failed("write a certificate");
  return CertificateAndKey{contents(certificate_out.get()), contents(key_out.get())};
}

Result<Bytes> make_node_bundle(const CertificateAndKey& node, const std::string& chain) {
  ERR_clear_error();
  const auto certificate = read_certificate(node.certificate);
  const auto key = read_key(node.key);
  const openssl::Chain others(sk_X509_new_null());
  const auto in = reader(chain);
  while (X509* const ca = PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr)) sk_X509_push(others.get(), ca);
  ERR_clear_error();
  const openssl::Pkcs12 bundle(PKCS12_create("", nullptr, key.get(), certificate.get(), others.get(), 0, 0, 0, 0, 0));
  const openssl::Bio out(BIO_new(BIO_s_mem()));
  if (!bundle || i2d_PKCS12_bio(out.get(), bundle.get()) != 1) return failed("make a PKCS#12 file");
  const auto bytes = contents(out.get());
  return Bytes(bytes.begin(), bytes.end());
}

}  // namespace rr
