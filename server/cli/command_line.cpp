// The program's table of contents. Layer: server/cli.
#include "server/cli/command.hpp"

namespace rrgate {

int run_command_line(std::vector<std::string> words) {
  Commands commands;
  commands.set_heading("The gateway");
  add_serve(commands);
  add_demo(commands);
  add_proxy(commands);
  add_init(commands);
  add_check_config(commands);
  add_health(commands);
  add_passwd(commands);
  add_token(commands);
  add_audit(commands);
  add_cert(commands);
  commands.set_heading("Devices");
  add_ls(commands);
  add_info(commands);
  add_robdef(commands);
  add_get(commands);
  add_set(commands);
  add_call(commands);
  add_watch(commands);
  add_record(commands);
  add_replay(commands);
  add_export(commands);
  add_mcp(commands);
  add_ping(commands);
  add_bench(commands);
  add_top(commands);
  commands.set_heading("Service definitions");
  add_check(commands);
  add_fmt(commands);
  add_generate(commands);
  commands.set_heading("Shells");
  add_completion(commands);
  return commands.run(std::move(words));
}

}  // namespace rrgate
