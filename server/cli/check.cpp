// rrgate check: whether service definitions are good. Layer: server/cli.
#include "server/cli/command.hpp"
#include "server/cli/diagnostics.hpp"

namespace rrgate {

int run_check(Arguments arguments) {
  constexpr std::string_view flags[] = {"--compat"};
  constexpr std::string_view repeated[] = {"-I"};
  const auto parsed = parse_arguments(arguments, {{}, flags, repeated});
  if (!parsed.error.empty()) return usage_error("check", parsed.error);
  if (parsed.operands.empty()) return usage_error("check", "expected a FILE or several");
  const auto set = DefinitionSet::from_files(parsed.operands, parsed.repeated, mode_of(parsed));
  if (!report_diagnostics(set)) return exit_failed;
  for (const auto* definition : set.requested())
    std::cout << definition->file << ": good; " << definition->name << "\n";
  return exit_ok;
}

}  // namespace rrgate
