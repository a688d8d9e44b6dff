// Certificates of one's own. Layer: server/cli.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/support/error.hpp"

namespace rrgate {

struct CertificateOptions {
  std::filesystem::path folder;
  std::int64_t days = 800;  ///< browsers refuse certificates of web servers that are good for more than 825
  bool force = false;
  bool is_json = false;  ///< of the commands: print one JSON object
};

struct WebCertificateOptions : CertificateOptions {
  std::vector<std::string> hosts;
};

/// The files that were written: certificates (.pem), each followed by its key (.key).
using CertificateFiles = std::vector<std::filesystem::path>;

/// Two CAs, for nodes and for web servers.
/// Errors   operation_failed: a file is there already, and not `force`; io_error: it can't be written.
rr::Result<CertificateFiles> make_authorities(const CertificateOptions& options);
/// A certificate for web servers, for the first of `hosts` and all others. Errors   as above; io_error: there is no CA.
rr::Result<CertificateFiles> make_web_certificate(const WebCertificateOptions& options);

/// What people are told of files of make_authorities() and make_web_certificate(), on standard output.
void print_authorities(const CertificateFiles& files);
void print_web_certificate(const CertificateFiles& files);

}  // namespace rrgate
