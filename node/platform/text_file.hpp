// Whole text files. Layer: definitions.
#pragma once

#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

namespace rrgate {

/// Nothing where there is no file that can be read.
inline std::optional<std::string> read_text_file(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return std::nullopt;
  return text.str();
}

/// False where it could not be written. A file that has this text already is left as it is, with its time: what is
/// built from it need not be built again.
inline bool write_text_file(const std::string& path, std::string_view text) {
  if (const auto old = read_text_file(path); old && *old == text) return true;
  std::ofstream file(path, std::ios::binary);
  file << text << std::flush;
  return static_cast<bool>(file);
}

}  // namespace rrgate
