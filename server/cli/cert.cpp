// rrgate cert: certificates of one's own, for a lab that has no CA. Layer: server/cli.
//
// Nodes and web servers have a CA each: what marks a node's CA is unknown to browsers, and critical.
#include "server/cli/cert.hpp"

#include <iostream>
#include <nlohmann/json.hpp>

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

rr::Result<> write_pair(const fs::path& stem, const rr::CertificateAndKey& pair, bool force, rr::SecretReaders readers,
                        CertificateFiles& written) {
  std::error_code error;
  for (const auto* ending : {".pem", ".key"})
    if (!force && fs::exists(stem.string() + ending, error))
      return rr::make_error(rr::ErrorCode::operation_failed,
                            stem.string() + ending + ": is there already; --force replaces it");
  if (auto done = rr::write_secret(stem.string() + ".key", pair.key, force, readers); !done) return done;
  // Certificates are no secrets; the service that answers with one must read it, and so may it a CA's.
  if (auto done = rr::write_secret(stem.string() + ".pem", pair.certificate, force, rr::SecretReaders::folder_group);
      !done)
    return done;
  for (const auto* ending : {".pem", ".key"}) written.emplace_back(stem.string() + ending);
  return {};
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

struct NodeCertificateOptions : CertificateOptions {
  std::string node;
  std::string output;
};

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

int make_node_certificate(const NodeCertificateOptions& options) {
  const auto ca = read_ca(options.folder, node_ca);
  if (!ca) return report_failure("cert", ca.error().message);
  const auto parsed = rr::parse_node_id(options.node);
  const auto id = parsed && !parsed->is_any() ? parsed : id_of_name(options.node);
  if (!id) return report_failure("cert", id.error().message);
  auto path = rr::Result<std::string>((fs::path(options.output) / (rr::format_node_id(*id) + ".p12")).string());
  if (options.output.empty()) path = rr::node_certificate_path(*id);
  if (!path) return report_failure("cert", path.error().message);

  rr::CertificateWish wish;
  wish.common_name = rr::format_certificate_name(*id);
  wish.node_level_oid = rr::node_oid;
  wish.begins_after_seconds = -clock_slack;
  wish.ends_after_seconds = options.days * day;
  const auto made = rr::issue_certificate(wish, &*ca);
  if (!made) return report_failure("cert", made.error().message);
  const auto bundle = rr::make_node_bundle(*made, ca->certificate);
  if (!bundle) return report_failure("cert", bundle.error().message);
  if (auto done = rr::write_secret(*path, rr::as_text(*bundle), options.force); !done)
    return report_failure("cert", done.error().message);
  if (options.is_json)
    print_json_line({{"node", rr::format_node_id(*id)}, {"files", nlohmann::ordered_json::array({*path})}});
  else
    std::cout << *path << "\n";
  return exit_ok;
}

nlohmann::ordered_json names_of(const CertificateFiles& files) {
  auto out = nlohmann::ordered_json::array();
  for (const auto& file : files) out.push_back(file.string());
  return out;
}

int run_authorities(const CertificateOptions& options) {
  const auto files = make_authorities(options);
  if (!files) return report_failure("cert", files.error().message);
  if (options.is_json)
    print_json_line({{"files", names_of(*files)}});
  else
    print_authorities(*files);
  return exit_ok;
}

int run_web_certificate(const WebCertificateOptions& options) {
  const auto files = make_web_certificate(options);
  if (!files) return report_failure("cert", files.error().message);
  if (options.is_json)
    print_json_line({{"hosts", options.hosts}, {"files", names_of(*files)}});
  else
    print_web_certificate(*files);
  return exit_ok;
}

/// What all kinds take.
void add_certificate_options(CLI::App& app, CertificateOptions& options) {
  app.add_option("FOLDER", options.folder, "Where the CAs are")->required()->option_text(" ");
  app.add_option("--days", options.days, "How long it is good")->check(CLI::Range(1, 36500))->option_text("N");
  app.add_flag("--force", options.force, "Replace what is there");
  app.add_flag("--json", options.is_json, "Print the files as one line of JSON");
}

}  // namespace

rr::Result<CertificateFiles> make_authorities(const CertificateOptions& options) {
  CertificateFiles files;
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
    wish.ends_after_seconds = options.days * day;
    const auto made = rr::issue_certificate(wish, nullptr);
    if (!made) return made.error();
    if (auto done = write_pair(options.folder / kind.file, *made, options.force, rr::SecretReaders::owner, files);
        !done)
      return done.error();
  }
  return files;
}

void print_authorities(const CertificateFiles& files) {
  for (const auto& file : files)
    if (file.extension() == ".pem") std::cout << file.string() << "\n";
  std::cout
      << "The .key files beside them make certificates that are believed: keep them secret, and off the gateway's "
         "machine.\nPrograms that shall believe these certificates are told by\n  export "
         "ROBOTRACONTEUR_SSL_CERT_FILE="
      << fs::absolute(files.front()).string() << "\n";
}

rr::Result<CertificateFiles> make_web_certificate(const WebCertificateOptions& options) {
  const auto ca = read_ca(options.folder, web_ca);
  if (!ca) return ca.error();
  rr::CertificateWish wish;
  wish.common_name = options.hosts.front().substr(0, 64);
  wish.hosts = options.hosts;
  wish.begins_after_seconds = -clock_slack;
  wish.ends_after_seconds = options.days * day;
  const auto made = rr::issue_certificate(wish, &*ca);
  if (!made) return made.error();
  auto name = options.hosts.front();
  for (auto& letter : name)
    if (letter == '*' || letter == ':') letter = '_';
  CertificateFiles files;
  if (auto done = write_pair(options.folder / name, *made, options.force, rr::SecretReaders::folder_group, files);
      !done)
    return done.error();
  return files;
}

void print_web_certificate(const CertificateFiles& files) {
  for (const auto& file : files) std::cout << file.string() << "\n";
}

void add_cert(Commands& commands) {
  auto& group = commands.add_group("cert", "Make certificates for nodes and for HTTPS");
  const auto [ca, authorities] =
      commands.add("ca", "Make two CAs, for nodes and for web servers", run_authorities, &group);
  authorities.days = 3650;
  add_certificate_options(ca, authorities);

  const auto [node, one] =
      commands.add("node", "Make a certificate for a node (rrs+tcp)", make_node_certificate, &group);
  add_certificate_options(node, one);
  node.add_option("NODE", one.node, "Name or id of the node")->required()->option_text(" ");
  node.add_option("--output", one.output, "Folder for it; without it where nodes look")->option_text("FOLDER");

  const auto [web, server] =
      commands.add("web", "Make a certificate for a web server (HTTPS)", run_web_certificate, &group);
  add_certificate_options(web, server);
  web.add_option("HOST", server.hosts, "Names and addresses of the server")->required()->option_text("...");
}

}  // namespace rrgate
