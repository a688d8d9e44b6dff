// A folder for the files of a test.
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "node/platform/text_file.hpp"

namespace rrgate::test {

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
