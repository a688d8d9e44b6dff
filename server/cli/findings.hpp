// What is wrong with a configuration, for the terminal. Layer: server/cli.
#pragma once

#include <filesystem>
#include <iostream>
#include <string>

#include "server/config/config.hpp"

namespace rrgate {

/// The file's name alone: the messages name places inside it.
inline std::string short_name(const std::string& file) {
  return std::filesystem::path(file).filename().string();
}

/// Prints all findings to stderr; returns whether the configuration can be used.
inline bool report_findings(const std::string& file, const ParsedConfig& parsed) {
  for (const auto& finding : parsed.findings) std::cerr << format_finding(short_name(file), finding) << "\n";
  return parsed.findings.empty();
}

}  // namespace rrgate
