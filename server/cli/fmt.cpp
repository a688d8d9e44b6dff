// rrgate fmt: service definitions in one layout. Layer: server/cli.
#include "core/robdef/format/format_source.hpp"
#include "node/platform/text_file.hpp"
#include "server/cli/definition_options.hpp"

namespace rrgate {

namespace {

struct FormatOptions : DefinitionOptions {
  bool in_place = false;
  bool is_check = false;
  bool is_json = false;
};

int format(const FormatOptions& options) {
  int code = exit_ok;
  for (const auto& file : options.files) {
    const auto text = read_text_file(file);
    if (!text) {
      std::cerr << file << ": error: found no file that can be read, expected a service definition\n";
      code = exit_failed;
      continue;
    }
    const auto source = rr::parse_service_definition(*text, options.mode(), file);
    if (!source.ok()) {
      for (const auto& diagnostic : source.diagnostics) {
        if (options.is_json)
          print_json_diagnostic(diagnostic);
        else
          std::cerr << rr::format_diagnostic(diagnostic) << "\n";
      }
      code = exit_failed;
    } else if (options.is_check) {
      const bool is_formatted = rr::format_source(source.definition) == *text;
      if (options.is_json)
        print_json_line({{"file", file}, {"formatted", is_formatted}});
      else if (!is_formatted)
        std::cout << file << "\n";
      if (!is_formatted) code = exit_failed;
    } else if (!options.in_place) {
      const auto formatted = rr::format_service_definition(source.definition);
      if (options.is_json)
        print_json_line({{"file", file}, {"text", formatted}});
      else
        std::cout << formatted;
    } else {
      const auto formatted = rr::format_source(source.definition);
      if (!write_text_file(file, formatted)) {
        std::cerr << file << ": error: cannot be written\n";
        code = exit_failed;
      } else if (options.is_json) {
        print_json_line({{"file", file}, {"changed", formatted != *text}});
      }
    }
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
