// rr-test-certificates: a CA and node certificates, good ones and bad ones.
//
// usage: rr-test-certificates FOLDER NODEID OTHERNODEID
// Writes FOLDER/ca.pem and FOLDER/KIND/certificates/{NODEID}.p12, so that FOLDER/KIND is a configuration folder of the
// reference; kind "good" has one of OTHERNODEID as well.
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>

#include "core/session/start_tls.hpp"
#include "node/tls/issue_certificates.hpp"
#include "node/tls/node_certificate_check.hpp"

namespace {

constexpr std::int64_t day = 24 * 3600;

rr::CertificateWish node_wish(const rr::NodeId& id) {
  rr::CertificateWish wish;
  wish.common_name = rr::format_certificate_name(id);
  wish.node_level_oid = rr::node_oid;
  wish.begins_after_seconds = -2 * day;
  wish.ends_after_seconds = day;
  return wish;
}

rr::CertificateAndKey make_ca() {
  rr::CertificateWish wish;
  wish.common_name = "Interop Root CA";
  wish.node_level_oid = rr::root_oid;
  wish.is_ca = true;
  wish.begins_after_seconds = -2 * day;
  wish.ends_after_seconds = day;
  return rr::issue_certificate(wish, nullptr).value();
}

void write(const std::filesystem::path& path, std::string_view text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

void write_node(const std::filesystem::path& folder, const rr::NodeId& id, const rr::CertificateWish& wish,
                const rr::CertificateAndKey* ca) {
  const auto node = rr::issue_certificate(wish, ca).value();
  const auto bundle = rr::make_node_bundle(node, ca ? ca->certificate : "").value();
  write(folder / "certificates" / (rr::format_node_id(id) + ".p12"), rr::as_text(bundle));
}

}  // namespace

int main(int count, char** values) {
  if (count != 4) return 2;
  const std::filesystem::path folder = values[1];
  const auto id = rr::parse_node_id(values[2]).value();
  const auto other = rr::parse_node_id(values[3]).value();
  const auto ca = make_ca();
  const auto other_ca = make_ca();
  write(folder / "ca.pem", ca.certificate);
  write_node(folder / "good", id, node_wish(id), &ca);
  write_node(folder / "good", other, node_wish(other), &ca);
  auto wish = node_wish(id);
  wish.ends_after_seconds = -day;
  write_node(folder / "expired", id, wish, &ca);
  wish = node_wish(id);
  wish.node_level_oid = "";
  write_node(folder / "unmarked", id, wish, &ca);
  write_node(folder / "other-ca", id, node_wish(id), &other_ca);
  write_node(folder / "self-signed", id, node_wish(id), nullptr);
  write_node(folder / "other-node", id, node_wish(other), &ca);
}
