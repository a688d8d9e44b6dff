// Seeds of fuzz_node_certificate: chains that are good, and some that are not. usage: make_certificate_seeds FOLDER
#include <filesystem>
#include <fstream>

#include "core/session/start_tls.hpp"
#include "node/tls/issue_certificates.hpp"
#include "node/tls/node_certificate_check.hpp"
#include "node/tls/openssl.hpp"

namespace {

constexpr std::int64_t years = 10 * 365 * 24 * 3600;
constexpr rr::NodeId node{{0x11, 0x22, 0x33}};

rr::CertificateAndKey issue(std::string name, std::string oid, bool is_ca, const rr::CertificateAndKey* issuer) {
  rr::CertificateWish wish;
  wish.common_name = std::move(name);
  wish.node_level_oid = std::move(oid);
  wish.is_ca = is_ca;
  wish.ends_after_seconds = years;
  return rr::issue_certificate(wish, issuer).value();
}

std::string der(const rr::CertificateAndKey& from) {
  const rr::openssl::Bio in(BIO_new_mem_buf(from.certificate.data(), static_cast<int>(from.certificate.size())));
  const rr::openssl::Certificate certificate(PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr));
  unsigned char* bytes = nullptr;
  const int size = i2d_X509(certificate.get(), &bytes);
  const rr::openssl::Text owner(bytes);
  return {reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size)};
}

}  // namespace

int main(int count, char** values) {
  if (count != 2) return 2;
  const std::filesystem::path folder = values[1];
  std::filesystem::create_directories(folder);
  const auto write = [&](const char* name, const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
  };
  const auto name = rr::format_certificate_name(node);
  const auto root = issue("Root", rr::root_oid, true, nullptr);
  const auto middle = issue("Middle", rr::intermediate_oid, true, &root);
  write("short", der(issue(name, rr::node_oid, false, &root)) + der(root));
  write("long", der(issue(name, rr::node_oid, false, &middle)) + der(middle) + der(root));
  write("unmarked", der(issue(name, "", false, &root)) + der(root));
  write("nameless", der(issue("robot", rr::node_oid, false, &root)) + der(root));
  write("alone", der(issue(name, rr::node_oid, false, nullptr)));
}
