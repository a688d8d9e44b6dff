#include "node/tls/node_certificate_check.hpp"

#include <algorithm>
#include <iterator>

#include "core/session/start_tls.hpp"
#include "node/tls/openssl.hpp"

namespace rr {

namespace {

Error refused(std::string why) {
  return make_error(ErrorCode::authentication_error, std::move(why));
}

std::string about(X509* certificate) {
  return "the certificate of " + openssl::name_text(X509_get_subject_name(certificate));
}

std::string time_text(const ASN1_TIME* time) {
  const openssl::Bio out(BIO_new(BIO_s_mem()));
  ASN1_TIME_print_ex(out.get(), time, ASN1_DTFLGS_ISO8601);
  char* data = nullptr;
  const long size = BIO_get_mem_data(out.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

/// What OpenSSL's own checks found, with what an operator needs to put it right.
std::string describe_chain_error(X509_STORE_CTX* store) {
  const int error = X509_STORE_CTX_get_error(store);
  X509* const current = X509_STORE_CTX_get_current_cert(store);
  if (!current) return X509_verify_cert_error_string(error);
  const auto issuer = openssl::name_text(X509_get_issuer_name(current));
  switch (error) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return about(current) + " expired at " + time_text(X509_get0_notAfter(current));
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return about(current) + " is not valid before " + time_text(X509_get0_notBefore(current)) +
             "; is the clock right?";
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
      return about(current) + " is self-signed; expected one that a trusted CA has issued";
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
      return "the CA " + issuer + " is not trusted here";
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
      return about(current) + " is issued by " + issuer + ", which is no trusted CA and was not sent along";
    case X509_V_ERR_INVALID_PURPOSE:
      return about(current) + " may not be used for this: extended key usage";
    default:
      return about(current) + ": " + X509_verify_cert_error_string(error);
  }
}

std::string oid_text(const X509_EXTENSION* extension) {
  char text[128];
  OBJ_obj2txt(text, sizeof(text), X509_EXTENSION_get_object(const_cast<X509_EXTENSION*>(extension)), 1);
  return text;
}

struct Level {
  const char* name;
  const char* oid;
};
constexpr Level root{"a root", root_oid};
constexpr Level intermediate{"an intermediate CA", intermediate_oid};
constexpr Level node{"a node", node_oid};

Result<> check_level(X509* certificate, const Level& level) {
  // Subject key id, key usage, basic constraints, policies, authority key id: OpenSSL has looked at these.
  constexpr std::string_view allowed[] = {"2.5.29.14", "2.5.29.15", "2.5.29.19", "2.5.29.32", "2.5.29.35"};
  int marks = 0;
  for (int i = 0; i < X509_get_ext_count(certificate); ++i) {
    const X509_EXTENSION* extension = X509_get_ext(certificate, i);
    const bool is_critical = X509_EXTENSION_get_critical(extension) != 0;
    const auto oid = oid_text(extension);
    if (oid == level.oid) {
      ++marks;
      if (!is_critical)
        return refused(about(certificate) + ": the extension " + oid + ", which marks " + level.name +
                       ", is not critical");
    } else if (is_critical && std::find(std::begin(allowed), std::end(allowed), oid) == std::end(allowed)) {
      return refused(about(certificate) + " has the critical extension " + oid + ", which " + level.name +
                     "'s certificate may not have");
    }
  }
  if (marks != 1)
    return refused(about(certificate) + ": found " + (marks == 0 ? "no" : "more than one") + " extension " + level.oid +
                   ", expected one, which marks " + level.name);
  return {};
}

/// The subject is the common name and nothing else.
Result<NodeId> read_subject(X509* certificate) {
  const X509_NAME* subject = X509_get_subject_name(certificate);
  const X509_NAME_ENTRY* entry = X509_NAME_entry_count(subject) == 1 ? X509_NAME_get_entry(subject, 0) : nullptr;
  if (!entry || OBJ_obj2nid(X509_NAME_ENTRY_get_object(entry)) != NID_commonName)
    return refused(about(certificate) + ": expected a common name and nothing else in the subject");
  unsigned char* data = nullptr;
  const int size = ASN1_STRING_to_UTF8(&data, X509_NAME_ENTRY_get_data(entry));
  const openssl::Text owner(data);
  if (size < 0) return refused(about(certificate) + ": the common name is not a text");
  return parse_certificate_name({reinterpret_cast<const char*>(data), static_cast<std::size_t>(size)});
}

}  // namespace

Result<NodeId> check_node_chain(x509_store_ctx_st* store) {
  // Critical extensions that OpenSSL does not know are looked at below.
  X509_VERIFY_PARAM_set_flags(X509_STORE_CTX_get0_param(store), X509_V_FLAG_IGNORE_CRITICAL);
  if (X509_verify_cert(store) != 1) return refused(describe_chain_error(store));
  return read_node_chain(X509_STORE_CTX_get0_chain(store));
}

Result<NodeId> read_node_chain(const stack_st_X509* chain) {
  const int size = sk_X509_num(chain);
  if (size < 2)
    return refused(about(sk_X509_value(chain, 0)) + " is self-signed; expected one that a trusted CA has issued");
  for (int depth = size - 1; depth >= 0; --depth) {
    const auto& level = depth == 0 ? node : depth == size - 1 ? root : intermediate;
    if (auto checked = check_level(sk_X509_value(chain, depth), level); !checked) return checked.error();
  }
  return read_subject(sk_X509_value(chain, 0));
}

}  // namespace rr
