#include "examples/demo/options.hpp"

#include <charconv>
#include <iostream>

#include "rrgate/client.hpp"

namespace rrgate::demo {

namespace {

void print_help(const Program& program) {
  std::cout << "Usage: " << program.name << " [options]\n\n"
            << program.purpose << "\n\n"
            << "  --host HOST   address to listen on (" << program.defaults.host << ")\n"
            << "  --port N      port to listen on, 0 for a free one (" << program.defaults.port << ")\n";
  if (!program.defaults.robot.empty())
    std::cout << "  --robot URL   the robot that carries the cameras\n"
              << "                (" << program.defaults.robot << ")\n";
  std::cout << "  --help        this text\n";
}

/// Returns a sentence about what is wrong; empty where nothing is.
std::string read_option(const Program& program, std::string_view name, std::string_view value, Options& options) {
  if (name == "--host") {
    options.host = value;
  } else if (name == "--port") {
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), options.port);
    if (error != std::errc{} || end != value.data() + value.size())
      return "--port " + rr::quote(value) + ": expected a number from 0 to 65535";
  } else if (name == "--robot" && !program.defaults.robot.empty()) {
    if (const auto url = rr::parse_url(value); !url) return "--robot: " + url.error().message;
    options.robot = value;
  } else {
    return "unknown option " + rr::quote(name) + "; --help lists all";
  }
  return {};
}

}  // namespace

std::optional<Options> parse_options(const Program& program, int argc, char** argv, int& exit_code) {
  Options options = program.defaults;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--help" || name == "-h") {
      print_help(program);
      exit_code = 0;
      return {};
    }
    const auto equals = name.find('=');
    std::string problem;
    if (equals != std::string_view::npos)
      problem = read_option(program, name.substr(0, equals), name.substr(equals + 1), options);
    else if (i + 1 < argc)
      problem = read_option(program, name, argv[++i], options);
    else
      problem = "option " + rr::quote(name) + " needs a value, or is unknown; --help lists all";
    if (problem.empty()) continue;
    std::cerr << program.name << ": " << problem << '\n';
    exit_code = 2;
    return {};
  }
  return options;
}

std::string service_url(const std::string& host, std::uint16_t port, std::string_view service) {
  const bool is_everywhere = host == "0.0.0.0" || host == "::" || host == "[::]";
  return "rr+tcp://" + rr::format_host_port(is_everywhere ? "127.0.0.1" : host, port) +
         "/?service=" + std::string(service);
}

std::string listen_url(const Options& options) {
  return "rr+tcp://" + rr::format_host_port(options.host, options.port);
}

}  // namespace rrgate::demo
