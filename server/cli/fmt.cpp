// rrgate fmt: service definitions in one layout. Layer: server/cli.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "core/robdef/format/format_source.hpp"
#include "node/platform/replace_file.hpp"
#include "server/cli/definition_options.hpp"

namespace rrgate {

namespace {

struct FormatOptions : DefinitionOptions {
  bool in_place = false;
  bool is_check = false;
  bool is_json = false;
};

/// It keeps its mode, and where root writes its owner. False: it could not be written, and is what it was.
bool replace_definition(const std::string& path, std::string_view text) {
  std::error_code error;
  const auto target = std::filesystem::canonical(path, error);  // a link stays one
  struct stat before {};
  if (error || ::access(target.c_str(), W_OK) != 0 || ::stat(target.c_str(), &before) != 0) return false;
  return rr::replace_file(target, text, [&before](int file) {
    const bool is_given = ::fchown(file, before.st_uid, before.st_gid) == 0 || ::geteuid() != 0;
    return is_given && ::fchmod(file, before.st_mode & 0777u) == 0;
  });
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
  if (formatted != text && !replace_definition(file, formatted)) {
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
