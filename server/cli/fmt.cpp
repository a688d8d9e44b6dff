// rrgate fmt: service definitions in one layout. Layer: server/cli.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "core/robdef/format/format_source.hpp"
#include "server/cli/definition_options.hpp"

namespace rrgate {

namespace {

struct FormatOptions : DefinitionOptions {
  bool in_place = false;
  bool is_check = false;
  bool is_json = false;
};

bool write_whole(int file, std::string_view text) {
  while (!text.empty()) {
    const auto written = ::write(file, text.data(), text.size());
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file) == 0;
}

/// The file is there whole all the time: what it was, or what it is to be. It keeps its mode, and where
/// root writes its owner. False: it could not be written, and is what it was.
bool replace_file(const std::string& path, std::string_view text) {
  std::error_code error;
  const auto target = std::filesystem::canonical(path, error).string();  // a link stays one
  struct stat before {};
  if (error || ::access(target.c_str(), W_OK) != 0 || ::stat(target.c_str(), &before) != 0) return false;
  auto fresh = target + ".XXXXXX";
  const int file = ::mkstemp(fresh.data());
  if (file < 0) return false;
  const bool is_given = ::fchown(file, before.st_uid, before.st_gid) == 0 || ::geteuid() != 0;
  const bool is_complete = is_given && ::fchmod(file, before.st_mode & 0777u) == 0 && write_whole(file, text);
  ::close(file);
  if (is_complete && ::rename(fresh.c_str(), target.c_str()) == 0) return true;
  ::unlink(fresh.c_str());
  return false;
}

int format_definition(const FormatOptions& options, const std::string& file, const rr::ParseResult& source) {
  const auto& text = source.definition.text;
  if (!source.ok()) {
    for (const auto& diagnostic : source.diagnostics) {
      if (options.is_json)
        print_json_diagnostic(diagnostic);
      else
        std::cerr << rr::format_diagnostic(diagnostic) << "\n";
    }
    return exit_failed;
  }
  if (options.is_check) {
    const bool is_formatted = rr::format_source(source.definition) == text;
    if (options.is_json)
      print_json_line({{"file", file}, {"formatted", is_formatted}});
    else if (!is_formatted)
      std::cout << file << "\n";
    return is_formatted ? exit_ok : exit_failed;
  }
  if (!options.in_place) {
    const auto formatted = rr::format_service_definition(source.definition);
    if (options.is_json)
      print_json_line({{"file", file}, {"text", formatted}});
    else
      std::cout << formatted;
    return exit_ok;
  }
  const auto formatted = rr::format_source(source.definition);
  if (formatted != text && !replace_file(file, formatted)) {
    std::cerr << file << ": error: cannot be written\n";
    return exit_failed;
  }
  if (options.is_json) print_json_line({{"file", file}, {"changed", formatted != text}});
  return exit_ok;
}

int format(const FormatOptions& options) {
  const bool has_input = std::find(options.files.begin(), options.files.end(), "-") != options.files.end();
  if (has_input && (options.in_place || options.is_check))
    return usage_error("fmt", "--in-place and --check take files, and no standard input");
  int code = exit_ok;
  for (const auto& file : options.files) {
    const auto sources = parse_definitions(file, options.mode());
    if (!sources) {
      std::cerr << file << ": error: found no file that can be read, expected a service definition\n";
      code = exit_failed;
      continue;
    }
    for (const auto& source : *sources)
      if (const int done = format_definition(options, file, source); done != exit_ok) code = done;
  }
  return code;
}

}  // namespace

void add_fmt(Commands& commands) {
  const auto [app, options] = commands.add("fmt", "Format service definitions", format);
  add_files(app, options);
  auto* compat = add_compat(app, options);
  auto* check = app.add_flag("--check", options.is_check, "List files with another format");
  app.add_flag("--in-place", options.in_place, "Write the files anew")->excludes(check)->excludes(compat);
  check->excludes(compat);
  app.add_flag("--json", options.is_json, "Print each file, error and warning as one line of JSON");
}

}  // namespace rrgate
