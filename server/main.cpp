#include "server/cli/command.hpp"

int main(int count, char** values) {
  return rrgate::run_command_line({values + 1, values + count});
}
