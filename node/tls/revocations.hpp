// Which certificates their CAs have taken back. Layer: node/tls. Source: RFC 5280 section 5.
#pragma once

#include <functional>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "core/support/error.hpp"

struct X509_crl_st;
struct ssl_st;

namespace rr {

/// A word for each certificate of the chain that the peer of `ssl` has shown and that was found good, with blanks
/// between. It tells the certificate from all others of the CAs that are believed. Empty: none was shown.
[[nodiscard]] std::string chain_marks(const ssl_st* ssl);

/// Calls `take` for each revocation list of a PEM file. Errors   invalid_configuration: the file can't be read, or
/// there is none in it.
[[nodiscard]] Result<> read_revocation_lists(const std::string& file, const std::function<void(X509_crl_st*)>& take);

/// What revocation lists say, whoever has signed them and whether or not they are out of date.
class Revocations {
 public:
  /// Errors   as read_revocation_lists().
  [[nodiscard]] static Result<Revocations> from_files(std::span<const std::string> files);

  /// `marks`  see chain_marks().
  bool has_any_of(std::string_view marks) const;

 private:
  std::set<std::string, std::less<>> marks_;
};

}  // namespace rr
