#include "server/cli/command.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <iostream>

#include "core/support/error.hpp"

namespace rrgate {

namespace {

void print_help(std::span<const Command> commands, std::ostream& out) {
  out << "rrgate: a gateway between devices that speak Robot Raconteur and the web\n\nusage:\n";
  std::size_t width = 0;
  for (const auto& command : commands) width = std::max(width, command.usage.size());
  for (const auto& command : commands)
    out << "  rrgate " << command.usage << std::string(width - command.usage.size() + 2, ' ') << command.summary
        << "\n";
  out << "  rrgate --help | --version\n";
}

}  // namespace

int run_command_line(std::span<const Command> commands, Arguments arguments) {
  if (arguments.empty()) {
    print_help(commands, std::cerr);
    return exit_usage;
  }
  const auto name = arguments.front();
  if (name == "--help" || name == "-h" || name == "help") {
    print_help(commands, std::cout);
    return exit_ok;
  }
  if (name == "--version") {
    std::cout << "rrgate " RRGATE_VERSION "\n";
    return exit_ok;
  }
  const auto rest = arguments.subspan(1);
  for (const auto& command : commands) {
    if (command.name != name) continue;
    if (std::find(rest.begin(), rest.end(), "--help") != rest.end()) {
      std::cout << "usage: rrgate " << command.usage << "\n" << command.summary << "\n";
      return exit_ok;
    }
    return command.run(rest);
  }
  std::cerr << "rrgate: unknown command or option " << rr::quote(name) << "\n\n";
  print_help(commands, std::cerr);
  return exit_usage;
}

ParsedArguments parse_arguments(Arguments arguments, const KnownOptions& known) {
  const auto is_one_of = [](std::string_view name, std::span<const std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  ParsedArguments out;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const auto argument = arguments[i];
    // "-" is standard input, "-5" a value.
    const bool is_operand =
        !argument.starts_with("-") || argument.size() == 1 || (argument[1] >= '0' && argument[1] <= '9');
    if (is_operand) {
      out.operands.emplace_back(argument);
      continue;
    }
    if (is_one_of(argument, known.flags)) {
      out.flags.emplace(argument);
      continue;
    }
    const auto equals = argument.find('=');
    const auto name = argument.substr(0, equals);
    if (is_one_of(name, known.flags)) {
      out.error = "option " + std::string(name) + " takes no value";
      return out;
    }
    const bool is_repeated = is_one_of(name, known.repeated);
    if (!is_repeated && !is_one_of(name, known.options)) {
      out.error = "unknown option " + rr::quote(name);
      return out;
    }
    if (equals == std::string_view::npos && i + 1 == arguments.size()) {
      out.error = "option " + std::string(name) + " needs a value";
      return out;
    }
    const auto value = equals == std::string_view::npos ? arguments[++i] : argument.substr(equals + 1);
    if (is_repeated) {
      out.repeated.emplace_back(value);
    } else if (!out.options.emplace(name, value).second) {
      out.error = "option " + std::string(name) + " is given twice";
      return out;
    }
  }
  return out;
}

std::optional<std::uint64_t> number_option(const ParsedArguments& parsed, std::string_view name, std::uint64_t absent,
                                           std::uint64_t largest) {
  const auto found = parsed.options.find(name);
  if (found == parsed.options.end()) return absent;
  const auto& text = found->second;
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number > largest) return std::nullopt;
  return number;
}

int report_failure(std::string_view command, std::string_view what) {
  std::cerr << "rrgate " << command << ": " << what << "\n";
  return exit_failed;
}

int usage_error(std::string_view command, std::string_view what) {
  std::cerr << "rrgate " << command << ": " << what << "; see rrgate --help\n";
  return exit_usage;
}

}  // namespace rrgate
