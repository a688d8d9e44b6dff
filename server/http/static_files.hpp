// Files of a folder: the dashboard, the documentation. Layer: server/http.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "server/http/request.hpp"

namespace rrgate {

/// Serves what lies below a folder, and nothing else: no dot files, no "..", no symbolic link that leads out of it.
/// Files are kept in memory and read again when they have changed.
class StaticFiles {
 public:
  /// An empty or missing folder makes every answer a 404 that says how to set one.
  explicit StaticFiles(const std::filesystem::path& root);

  /// `path` is percent-encoded, without a leading '/'; "" and "folder/" are the index.html there. Uses FILE.br or
  /// FILE.gz if the client takes them. Answers 304 to a matching If-None-Match.
  Response answer(const Request& request, std::string_view path);

 private:
  struct Cached {
    std::filesystem::file_time_type changed;
    std::shared_ptr<const std::string> content;
    std::string etag;
  };
  const Cached* load(const std::filesystem::path& file);

  std::filesystem::path root_;
  std::map<std::filesystem::path, Cached> cache_;
};

/// By the file name's ending; application/octet-stream where it is unknown.
std::string_view mime_type(std::string_view file_name);
/// Whether the name carries a hash of the content ("index-Bx81Qz0k.js"), so that it may be cached for ever.
bool has_content_hash(std::string_view file_name);

}  // namespace rrgate
