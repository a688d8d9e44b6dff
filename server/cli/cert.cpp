// rrgate cert: certificates of one's own, for a lab that has no CA. Layer: server/cli.
//
// Nodes and web servers have a CA each: what marks a node's CA is unknown to browsers, and critical.
#include <charconv>
#include <filesystem>
#include <iostream>

#include "core/session/start_tls.hpp"
#include "core/support/random.hpp"
#include "core/support/words.hpp"
#include "node/platform/folders.hpp"
#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"
#include "node/tls/certificate_files.hpp"
#include "node/tls/issue_certificates.hpp"
#include "node/tls/node_certificate_check.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t day = 24 * 3600;
constexpr std::int64_t clock_slack = 3600;  // of machines in the lab, in seconds

constexpr std::string_view node_ca = "node-ca";
constexpr std::string_view web_ca = "web-ca";

rr::Result<> write_pair(const fs::path& stem, const rr::CertificateAndKey& pair, std::string_view chain, bool force,
                        rr::SecretReaders readers) {
  std::error_code error;
  for (const auto* ending : {".pem", ".key"})
    if (!force && fs::exists(stem.string() + ending, error))
      return rr::make_error(rr::ErrorCode::operation_failed,
                            stem.string() + ending + ": is there already; --force replaces it");
  if (auto done = rr::write_secret(stem.string() + ".key", pair.key, force, readers); !done) return done;
  // Certificates are no secrets; the service that answers with one must read it, and so may it a CA's.
  return rr::write_secret(stem.string() + ".pem", pair.certificate + std::string(chain), force,
                          rr::SecretReaders::folder_group);
}

rr::Result<rr::CertificateAndKey> read_ca(const fs::path& folder, std::string_view name) {
  const auto stem = (folder / name).string();
  const auto certificate = read_text_file(stem + ".pem");
  const auto key = read_text_file(stem + ".key");
  if (!certificate || !key)
    return rr::make_error(rr::ErrorCode::io_error,
                          stem + ".pem and .key: can't be read; \"rrgate cert ca " + folder.string() + "\" makes them");
  return rr::CertificateAndKey{*certificate, *key};
}

struct Wishes {
  fs::path folder;
  std::vector<std::string> operands;
  std::int64_t days;
  bool force;
};

int make_cas(const Wishes& wishes) {
  struct Kind {
    std::string_view file;
    std::string_view name;
    const char* oid;
  };
  for (const auto& kind :
       {Kind{node_ca, "Robot Raconteur Lab Root CA", rr::root_oid}, Kind{web_ca, "Lab Web CA", ""}}) {
    rr::CertificateWish wish;
    // With a number of its own: two labs must not look alike to those who sort certificates by name.
    wish.common_name =
        std::string(kind.name) + " " + rr::format_node_id(rr::random_node_id(), rr::NodeIdFormat::plain).substr(0, 8);
    wish.node_level_oid = kind.oid;
    wish.is_ca = true;
    wish.begins_after_seconds = -clock_slack;
    wish.ends_after_seconds = wishes.days * day;
    const auto made = rr::issue_certificate(wish, nullptr);
    if (!made) return report_failure("cert", made.error().message);
    if (auto done = write_pair(wishes.folder / kind.file, *made, {}, wishes.force, rr::SecretReaders::owner); !done)
      return report_failure("cert", done.error().message);
    std::cout << (wishes.folder / kind.file).string() << ".pem\n";
  }
  std::cout << "The .key files make certificates that are believed: keep them here. Programs that shall believe them "
               "are told by\n  export ROBOTRACONTEUR_SSL_CERT_FILE="
            << fs::absolute(wishes.folder / node_ca).string() << ".pem\n";
  return exit_ok;
}

/// The id that a node of this name has or, from now on, will have: what the reference keeps in nodeids/NAME.
rr::Result<rr::NodeId> id_of_name(const std::string& name) {
  if (!rr::is_valid_node_name(name))
    return rr::make_error(rr::ErrorCode::invalid_argument, rr::quote(name) + " is neither a node id nor a node name");
  const auto folder = rr::user_config_folder();
  if (!folder) return folder.error();
  const auto path = fs::path(*folder) / "nodeids" / name;
  if (const auto text = read_text_file(path.string()); text && !text->empty()) {
    auto id = rr::parse_node_id(rr::trim(*text, " \t\r\n"));
    if (!id || id->is_any())
      return rr::make_error(rr::ErrorCode::invalid_configuration, path.string() + ": holds no node id");
    return id;
  }
  const auto id = rr::random_node_id();
  if (auto done = rr::write_secret(path, rr::format_node_id(id), true); !done) return done.error();
  return id;
}

int make_node(const Wishes& wishes, const std::string& output) {
  if (wishes.operands.size() != 1) return usage_error("cert node", "expected FOLDER and one NODEID or NODENAME");
  const auto& node = wishes.operands.front();
  const auto ca = read_ca(wishes.folder, node_ca);
  if (!ca) return report_failure("cert", ca.error().message);
  const auto parsed = rr::parse_node_id(node);
  const auto id = parsed && !parsed->is_any() ? parsed : id_of_name(node);
  if (!id) return report_failure("cert", id.error().message);
  auto path = rr::Result<std::string>((fs::path(output) / (rr::format_node_id(*id) + ".p12")).string());
  if (output.empty()) path = rr::node_certificate_path(*id);
  if (!path) return report_failure("cert", path.error().message);

  rr::CertificateWish wish;
  wish.common_name = rr::format_certificate_name(*id);
  wish.node_level_oid = rr::node_oid;
  wish.begins_after_seconds = -clock_slack;
  wish.ends_after_seconds = wishes.days * day;
  const auto made = rr::issue_certificate(wish, &*ca);
  if (!made) return report_failure("cert", made.error().message);
  const auto bundle = rr::make_node_bundle(*made, ca->certificate);
  if (!bundle) return report_failure("cert", bundle.error().message);
  if (auto done = rr::write_secret(*path, rr::as_text(*bundle), wishes.force); !done)
    return report_failure("cert", done.error().message);
  std::cout << *path << "\n";
  return exit_ok;
}

int make_web(const Wishes& wishes) {
  if (wishes.operands.empty()) return usage_error("cert web", "expected FOLDER and at least one HOST");
  const auto ca = read_ca(wishes.folder, web_ca);
  if (!ca) return report_failure("cert", ca.error().message);
  rr::CertificateWish wish;
  wish.common_name = wishes.operands.front().substr(0, 64);
  wish.hosts = wishes.operands;
  wish.begins_after_seconds = -clock_slack;
  wish.ends_after_seconds = wishes.days * day;
  const auto made = rr::issue_certificate(wish, &*ca);
  if (!made) return report_failure("cert", made.error().message);
  auto name = wishes.operands.front();
  for (auto& letter : name)
    if (letter == '*' || letter == ':') letter = '_';
  const auto stem = wishes.folder / name;
  if (auto done = write_pair(stem, *made, {}, wishes.force, rr::SecretReaders::folder_group); !done)
    return report_failure("cert", done.error().message);
  std::cout << stem.string() << ".pem\n" << stem.string() << ".key\n";
  return exit_ok;
}

}  // namespace

int run_cert(Arguments arguments) {
  constexpr std::string_view options[] = {"--days", "--output"};
  constexpr std::string_view flags[] = {"--force"};
  const auto parsed = parse_arguments(arguments, {options, flags});
  if (!parsed.error.empty()) return usage_error("cert", parsed.error);
  if (parsed.operands.size() < 2) return usage_error("cert", "expected ca, node or web, then FOLDER");
  const auto& kind = parsed.operands[0];
  const auto option = [&parsed](const char* name) {
    const auto found = parsed.options.find(name);
    return found == parsed.options.end() ? std::string() : found->second;
  };
  // Browsers refuse certificates of web servers that are good for more than 825 days.
  Wishes wishes{parsed.operands[1],
                {parsed.operands.begin() + 2, parsed.operands.end()},
                kind == "ca" ? 3650 : 800,
                parsed.flags.contains("--force")};
  if (const auto days = option("--days"); !days.empty()) {
    const auto [end, error] = std::from_chars(days.data(), days.data() + days.size(), wishes.days);
    if (error != std::errc() || end != days.data() + days.size() || wishes.days < 1 || wishes.days > 36500)
      return usage_error("cert", "--days: found " + rr::quote(days) + ", expected 1 to 36500");
  }
  if (kind != "node" && parsed.options.contains("--output")) return usage_error("cert", "--output is for node alone");
  if (kind == "ca" && wishes.operands.empty()) return make_cas(wishes);
  if (kind == "node") return make_node(wishes, option("--output"));
  if (kind == "web") return make_web(wishes);
  return usage_error("cert", "expected ca, node or web, then FOLDER");
}

}  // namespace rrgate
