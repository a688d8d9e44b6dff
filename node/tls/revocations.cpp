#include "node/tls/revocations.hpp"

#include <algorithm>
#include <cstdio>
#include <new>

#include "node/tls/openssl.hpp"

namespace rr {

namespace {

/// The issuer's name is hashed as OpenSSL compares it, so that a list may spell it in another way.
std::string mark_of(const X509_NAME* issuer, const ASN1_INTEGER* serial) {
  int is_hashed = 0;
  const unsigned long hash = X509_NAME_hash_ex(issuer, nullptr, nullptr, &is_hashed);
  const std::unique_ptr<BIGNUM, openssl::Free<BN_free>> number(ASN1_INTEGER_to_BN(serial, nullptr));
  unsigned char* digits = nullptr;
  if (is_hashed == 1 && number) digits = reinterpret_cast<unsigned char*>(BN_bn2hex(number.get()));
  const openssl::Text owner(digits);
  if (!digits) throw std::bad_alloc();
  char name[32];
  std::snprintf(name, sizeof(name), "%lx-", hash);
  return name + std::string(reinterpret_cast<const char*>(digits));
}

}  // namespace

std::string chain_marks(const ssl_st* ssl) {
  std::string out;
  const STACK_OF(X509)* const chain = SSL_get0_verified_chain(ssl);
  for (int i = 0; chain && i < sk_X509_num(chain); ++i) {
    const X509* const certificate = sk_X509_value(chain, i);
    if (!out.empty()) out += ' ';
    out += mark_of(X509_get_issuer_name(certificate), X509_get0_serialNumber(certificate));
  }
  return out;
}

Result<> read_revocation_lists(const std::string& file, const std::function<void(X509_crl_st*)>& take) {
  const auto fail = [&file](const std::string& why) {
    return make_error(ErrorCode::invalid_configuration, "revocation list " + quote(file, 200) + ": " + why);
  };
  const openssl::Bio in(BIO_new_file(file.c_str(), "r"));
  if (!in) return fail(openssl::last_error());
  bool has_any = false;
  while (const openssl::RevocationList list{PEM_read_bio_X509_CRL(in.get(), nullptr, nullptr, nullptr)}) {
    has_any = true;
    take(list.get());
  }
  ERR_clear_error();
  if (!has_any) return fail("found none in it, expected PEM (X509 CRL)");
  return {};
}

Result<Revocations> Revocations::from_files(std::span<const std::string> files) {
  Revocations out;
  for (const auto& file : files) {
    const auto read = read_revocation_lists(file, [&out](X509_CRL* list) {
      const STACK_OF(X509_REVOKED)* const revoked = X509_CRL_get_REVOKED(list);
      for (int i = 0; i < sk_X509_REVOKED_num(revoked); ++i)
        out.marks_.insert(
            mark_of(X509_CRL_get_issuer(list), X509_REVOKED_get0_serialNumber(sk_X509_REVOKED_value(revoked, i))));
    });
    if (!read) return read.error();
  }
  return out;
}

bool Revocations::has_any_of(std::string_view marks) const {
  while (!marks.empty() && !marks_.empty()) {
    const auto end = std::min(marks.find(' '), marks.size());
    if (marks_.contains(marks.substr(0, end))) return true;
    marks.remove_prefix(std::min(end + 1, marks.size()));
  }
  return false;
}

}  // namespace rr
