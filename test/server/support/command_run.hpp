// Runs subcommands in this process, on files of its own.
#pragma once

#include <filesystem>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "node/platform/text_file.hpp"
#include "server/cli/command.hpp"

namespace rrgate::test {

struct CommandRun {
  int code;
  std::string output;
  std::string errors;
};

inline CommandRun run_command(int (*command)(Arguments), const std::vector<std::string>& arguments) {
  const std::vector<std::string_view> words(arguments.begin(), arguments.end());
  std::ostringstream output;
  std::ostringstream errors;
  auto* const old_output = std::cout.rdbuf(output.rdbuf());
  auto* const old_errors = std::cerr.rdbuf(errors.rdbuf());
  const int code = command(words);
  std::cout.rdbuf(old_output);
  std::cerr.rdbuf(old_errors);
  return {code, output.str(), errors.str()};
}

/// A folder that goes with this object.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "rrgate-test-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string path(const std::string& name) const { return (path_ / name).string(); }
  /// Returns the path.
  std::string write(const std::string& name, std::string_view text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    write_text_file(path(name), text);
    return path(name);
  }
  std::string read(const std::string& name) const { return read_text_file(path(name)).value_or("(no file)"); }

 private:
  std::filesystem::path path_;
};

}  // namespace rrgate::test
