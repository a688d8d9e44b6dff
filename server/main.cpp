// rrgate: the table of contents of the program.
#include <vector>

#include "server/cli/command.hpp"

int main(int count, char** values) {
  constexpr rrgate::Command commands[] = {
      {"serve", "serve --config FILE", "run the gateway", rrgate::run_serve},
      {"demo", "demo [--port N]", "run two simulated devices and a gateway to them", rrgate::run_demo},
      {"check-config", "check-config FILE [--as-service USER]", "say what is wrong with a configuration",
       rrgate::run_check_config},
      {"check", "check [--compat] [-I DIR] FILE...", "say what is wrong with service definitions", rrgate::run_check},
      {"fmt", "fmt [--in-place | --check | --compat] FILE...", "print or lay out service definitions", rrgate::run_fmt},
      {"generate", "generate ts|cpp FILE...|URL [-o OUT] [-I DIR]", "write TypeScript types or C++ classes",
       rrgate::run_generate},
      {"cert", "cert ca|node|web FOLDER [NODE | HOST...] [--force]", "make certificates for nodes and HTTPS",
       rrgate::run_cert},
      {"passwd", "passwd FILE NAME [--roles A,B] [--delete]", "set a user's password and roles", rrgate::run_passwd},
      {"token", "token FILE NAME [--roles A,B] [--days N] [--delete]", "make an API token", rrgate::run_token},
      {"health", "health [--ready] [HOST:PORT]", "ask a running gateway whether it is well", rrgate::run_health},
      {"init", "init [FOLDER] [--user NAME]", "write a configuration with TLS and a user to begin with",
       rrgate::run_init},
      {"ls", "ls [URL] [--type TYPE] [--wait SECONDS] [--json]", "list services: around here, of a node, of a gateway",
       rrgate::run_ls},
      {"info", "info URL [OBJECT] [--json]", "say what an object is and has", rrgate::run_info},
      {"robdef", "robdef URL", "print the service definitions of a service", rrgate::run_robdef},
      {"get", "get URL MEMBER [--json]", "print a property, a wire's newest value, a memory", rrgate::run_get},
      {"set", "set URL MEMBER VALUE", "write a property or a wire", rrgate::run_set},
      {"call", "call URL FUNCTION [ARGUMENT...] [--json]", "call a function and print what it returns",
       rrgate::run_call},
      {"watch", "watch URL MEMBER [--count N] [--for SECONDS] [--json | --csv]",
       "print values of a wire, packets of a pipe, events", rrgate::run_watch},
      {"ping", "ping URL [--count N] [--json]", "time requests to a service", rrgate::run_ping},
      {"proxy", "proxy URL [--port N] [--name NAME] [--relay]", "run a gateway for one device, without a file",
       rrgate::run_proxy},
  };
  const std::vector<std::string_view> arguments(values + 1, values + count);
  return rrgate::run_command_line(commands, arguments);
}
