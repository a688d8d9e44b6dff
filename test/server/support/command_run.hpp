// Runs commands of rrgate in this process.
#pragma once

#include <functional>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "server/cli/command.hpp"

namespace rrgate::test {

struct CommandRun {
  int code;
  std::string output;
  std::string errors;
};

/// What `run` prints, and its exit code.
inline CommandRun run_in_process(const std::function<int()>& run) {
  std::ostringstream output;
  std::ostringstream errors;
  auto* const old_output = std::cout.rdbuf(output.rdbuf());
  auto* const old_errors = std::cerr.rdbuf(errors.rdbuf());
  const int code = run();
  std::cout.rdbuf(old_output);
  std::cerr.rdbuf(old_errors);
  return {code, output.str(), errors.str()};
}

inline CommandRun run_command(const std::string& command, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), command);
  return run_in_process([&] { return run_command_line(std::move(arguments)); });
}

}  // namespace rrgate::test
