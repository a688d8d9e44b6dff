#include "server/http/static_files.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "core/session/url.hpp"
#include "server/http/etag.hpp"

namespace rrgate {

namespace fs = std::filesystem;

namespace {

constexpr std::uintmax_t largest_file = 64u * 1024 * 1024;

/// The page runs its own scripts and WebAssembly and nothing inline; it may open WebSockets anywhere (a dashboard may
/// watch several gateways) and shows camera frames from memory.
constexpr std::string_view content_security_policy =
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self' ws: wss:; "
    "img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; frame-ancestors 'none'";

bool is_safe_segment(std::string_view segment) {
  return !segment.empty() && segment.front() != '.' && std::none_of(segment.begin(), segment.end(), [](char c) {
    return c == '\\' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
}

bool is_safe_path(std::string_view path) {
  for (;;) {
    const auto slash = path.find('/');
    if (!is_safe_segment(path.substr(0, slash))) return false;
    if (slash == std::string_view::npos) return true;
    path.remove_prefix(slash + 1);
  }
}

}  // namespace

StaticFiles::StaticFiles(const fs::path& root) {
  std::error_code error;
  if (!root.empty()) root_ = fs::canonical(root, error);
}

const StaticFiles::Cached* StaticFiles::load(const fs::path& file) {
  std::error_code error;
  const auto real = fs::canonical(file, error);
  if (error || !fs::is_regular_file(real, error)) return nullptr;
  const auto inside = std::mismatch(root_.begin(), root_.end(), real.begin(), real.end());
  if (inside.first != root_.end()) return nullptr;  // a link that leads out
  const auto changed = fs::last_write_time(real, error);
  if (error || fs::file_size(real, error) > largest_file) return nullptr;
  auto& entry = cache_[real];
  if (entry.content && entry.changed == changed) return &entry;
  std::ifstream in(real, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) {
    cache_.erase(real);
    return nullptr;
  }
  entry.changed = changed;
  entry.content = std::make_shared<const std::string>(std::move(text).str());
  entry.etag = make_etag(*entry.content, real.extension() == ".br" ? "-br" : real.extension() == ".gz" ? "-gz" : "");
  return &entry;
}

Response StaticFiles::answer(const Request& request, std::string_view path) {
  if (root_.empty())
    return problem_response(404, "no dashboard here: set web_root in the configuration to the folder of its files");
  const bool is_folder = path.empty() || path.back() == '/';
  const auto decoded = rr::percent_decode(std::string(path) + (is_folder ? "index.html" : ""));
  if (!decoded || !is_safe_path(*decoded)) return problem_response(404, "no such file");
  const auto file = root_ / *decoded;

  const auto accepted = request.list(http::field::accept_encoding);
  const Cached* found = nullptr;
  std::string_view encoding;
  for (const auto& [name, ending] : {std::pair("br", ".br"), std::pair("gzip", ".gz")}) {
    if (found || !accepts(accepted, name)) continue;
    auto packed = file;
    packed += ending;
    found = load(packed);
    if (found) encoding = name;
  }
  if (!found) found = load(file);
  if (!found) return problem_response(404, "nothing is at " + rr::quote(request.path()));

  Response response;
  const auto name = file.filename().string();
  response.set("Content-Type", std::string(mime_type(name)));
  response.set("ETag", found->etag);
  response.set("Vary", "Accept-Encoding");
  response.set("Cache-Control", has_content_hash(name) ? "public, max-age=31536000, immutable" : "no-cache");
  if (!encoding.empty()) response.set("Content-Encoding", std::string(encoding));
  response.set("Content-Security-Policy", std::string(content_security_policy));  // the script of a worker has its own
  if (has_etag(request, found->etag)) {
    response.status = 304;
  } else {
    response.body = found->content;
  }
  return response;
}

std::string_view mime_type(std::string_view file_name) {
  constexpr std::pair<std::string_view, std::string_view> types[] = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".webmanifest", "application/manifest+json"},
      {".wasm", "application/wasm"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".ico", "image/x-icon"},
      {".webp", "image/webp"},
      {".woff2", "font/woff2"},
      {".txt", "text/plain; charset=utf-8"},
  };
  const auto dot = file_name.rfind('.');
  if (dot != std::string_view::npos)
    for (const auto& [ending, type] : types)
      if (equals_ignoring_case(file_name.substr(dot), ending)) return type;
  return "application/octet-stream";
}

bool has_content_hash(std::string_view file_name) {
  const auto dot = file_name.find('.', file_name.rfind('-') == std::string_view::npos ? 0 : file_name.rfind('-'));
  if (dot == std::string_view::npos || dot < 9) return false;
  const auto hash = file_name.substr(dot - 8, 8);
  const auto is_hash_char = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  const bool is_mixed = std::any_of(hash.begin(), hash.end(), [](char c) { return c < 'a' || c > 'z'; });
  return file_name[dot - 9] == '-' && is_mixed && std::all_of(hash.begin(), hash.end(), is_hash_char);
}

}  // namespace rrgate
