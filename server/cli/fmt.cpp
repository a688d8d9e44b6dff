// rrgate fmt: service definitions in one layout. Layer: server/cli.
#include "core/robdef/format/format_source.hpp"
#include "node/platform/text_file.hpp"
#include "server/cli/command.hpp"
#include "server/cli/diagnostics.hpp"

namespace rrgate {

int run_fmt(Arguments arguments) {
  constexpr std::string_view flags[] = {"--in-place", "--check", "--compat"};
  const auto parsed = parse_arguments(arguments, {{}, flags, {}});
  if (!parsed.error.empty()) return usage_error("fmt", parsed.error);
  if (parsed.operands.empty()) return usage_error("fmt", "expected a FILE or several");
  const bool in_place = parsed.flags.count("--in-place") != 0;
  const bool is_check = parsed.flags.count("--check") != 0;
  if (parsed.flags.size() > 1) return usage_error("fmt", "expected one of --in-place, --check and --compat at most");

  int code = exit_ok;
  for (const auto& file : parsed.operands) {
    const auto text = read_text_file(file);
    if (!text) {
      std::cerr << file << ": error: found no file that can be read, expected a service definition\n";
      code = exit_failed;
      continue;
    }
    const auto source = rr::parse_service_definition(*text, mode_of(parsed), file);
    if (!source.ok()) {
      for (const auto& diagnostic : source.diagnostics) std::cerr << rr::format_diagnostic(diagnostic) << "\n";
      code = exit_failed;
    } else if (is_check) {
      if (rr::format_source(source.definition) == *text) continue;
      std::cout << file << "\n";
      code = exit_failed;
    } else if (!in_place) {
      std::cout << rr::format_service_definition(source.definition);
    } else if (!write_text_file(file, rr::format_source(source.definition))) {
      std::cerr << file << ": error: cannot be written\n";
      code = exit_failed;
    }
  }
  return code;
}

}  // namespace rrgate
