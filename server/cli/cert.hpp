// Certificates of one's own. Layer: server/cli.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace rrgate {

struct CertificateOptions {
  std::filesystem::path folder;
  std::int64_t days = 800;  ///< browsers refuse certificates of web servers that are good for more than 825
  bool force = false;
};

struct WebCertificateOptions : CertificateOptions {
  std::vector<std::string> hosts;
};

/// Two CAs, for nodes and for web servers. Prints their files, or why there are none; returns an exit code.
int make_authorities(const CertificateOptions& options);
/// A certificate for web servers, for the first of `hosts` and all others. Prints as above.
int make_web_certificate(const WebCertificateOptions& options);

}  // namespace rrgate
