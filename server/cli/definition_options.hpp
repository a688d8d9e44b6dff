// What commands about service definitions share: their options, and diagnostics for the terminal. Layer: server/cli.
#pragma once

#include <iostream>
#include <nlohmann/json.hpp>

#include "node/generate/definition_set.hpp"
#include "server/cli/command.hpp"

namespace rrgate {

struct DefinitionOptions {
  std::vector<std::string> files;
  std::vector<std::string> folders;
  bool is_compatible = false;

  rr::RobdefMode mode() const { return is_compatible ? rr::RobdefMode::compat : rr::RobdefMode::strict; }
};

inline void add_files(CLI::App& app, DefinitionOptions& options) {
  app.add_option("FILE", options.files, "Service definitions; - for standard input")->required()->option_text("...");
}
inline void add_folders(CLI::App& app, DefinitionOptions& options) {
  app.add_option("-I", options.folders, "Folder with imported definitions; may be repeated")
      ->allow_extra_args(false)
      ->option_text("FOLDER");
}
inline CLI::Option* add_compat(CLI::App& app, DefinitionOptions& options) {
  return app.add_flag("--compat", options.is_compatible, "Accept what Robot Raconteur 1.x accepts beyond the standard");
}

/// One line of JSON on standard output.
inline void print_json_diagnostic(const rr::Diagnostic& diagnostic) {
  auto json = nlohmann::ordered_json::object();
  json["file"] = diagnostic.file;
  json["line"] = diagnostic.column != 0 ? diagnostic.column_line : diagnostic.line;
  if (diagnostic.column != 0) json["column"] = diagnostic.column;
  json["severity"] = diagnostic.severity == rr::Severity::error ? "error" : "warning";
  json["code"] = diagnostic.code;
  json["message"] = diagnostic.message;
  print_json_line(json);
}

/// Prints all diagnostics to stderr; returns whether the definitions can be used.
inline bool report_diagnostics(const DefinitionSet& set) {
  for (const auto& diagnostic : set.diagnostics()) std::cerr << rr::format_diagnostic(diagnostic) << "\n";
  return set.is_good();
}

}  // namespace rrgate
