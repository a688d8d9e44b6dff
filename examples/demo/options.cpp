#include "examples/demo/options.hpp"

#include <algorithm>
#include <charconv>
#include <iostream>

#include "rrgate/client.hpp"

namespace rrgate::demo {

namespace {

constexpr std::size_t max_devices = 16;

void print_help(const Program& program) {
  std::cout << "Usage: " << program.name << " [options]\n\n"
            << program.purpose << "\n\n"
            << "  --host HOST   address to listen on (" << program.defaults.host << ")\n"
            << "  --port N      port to listen on, 0 for a free one (" << program.defaults.port << ")\n";
  if (!program.defaults.robot.empty())
    std::cout << "  --device PATH a camera of this machine, as /dev/video0; may be repeated. auto: all that are\n"
                 "                there, or else simulated ones; none: simulated ones (auto, or none where\n"
                 "                other machines can connect)\n"
                 "  --pictures PATH\n"
                 "                pictures in place of a camera: a folder of .jpg files, or a .jpg or .mjpeg file\n"
                 "  --robot URL   the robot that carries simulated cameras\n"
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
    options.is_on_robot = true;
  } else if (name == "--device" && !program.defaults.robot.empty()) {
    if (value.empty()) return "--device \"\": expected a path, auto or none";
    if (options.devices.size() == max_devices)
      return "--device " + rr::quote(value) + ": " + std::to_string(max_devices) + " are given already";
    options.devices.emplace_back(value);
  } else if (name == "--pictures" && !program.defaults.robot.empty()) {
    if (value.empty()) return "--pictures \"\": expected a folder or a file";
    options.pictures = value;
  } else {
    return "unknown option " + rr::quote(name) + "; --help lists all";
  }
  return {};
}

/// Likewise, of options that are right each for itself.
std::string check_options(const Options& options) {
  const bool has_devices = !options.devices.empty();
  if (options.is_on_robot + has_devices + !options.pictures.empty() > 1)
    return "--robot, --device and --pictures exclude one another: expected one of them";
  const auto is_word = [](const auto& device) { return device == no_device || device == all_devices; };
  if (options.devices.size() > 1 && std::any_of(options.devices.begin(), options.devices.end(), is_word))
    return "--device: auto and none stand alone";
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
  if (const auto problem = check_options(options); !problem.empty()) {
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

bool is_loopback(std::string_view host) {
  return host == "localhost" || host == "::1" || host == "[::1]" || host.starts_with("127.");
}

std::string listen_url(const Options& options) {
  return "rr+tcp://" + rr::format_host_port(options.host, options.port);
}

}  // namespace rrgate::demo
