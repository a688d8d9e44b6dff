// Command line of the demo devices. Layer: demo.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rrgate::demo {

inline constexpr std::string_view all_devices = "auto", no_device = "none";

struct Options {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;
  std::string robot;                 ///< webcams: URL of the Create service
  bool is_on_robot = false;          ///< webcams: --robot was given
  std::vector<std::string> devices;  ///< webcams: paths, or one of the words above; empty: none was given
  std::string pictures;              ///< webcams: a file or folder; empty: none
};

/// What a program takes, with its defaults.
struct Program {
  std::string_view name;
  std::string_view purpose;
  Options defaults;
};

/// Reads the arguments; empty where the program is to end now with `exit_code`, after --help (0) or a mistake, which
/// was written to stderr (2).
std::optional<Options> parse_options(const Program& program, int argc, char** argv, int& exit_code);

/// "rr+tcp://127.0.0.1:52222/?service=Create": where a client on this machine finds the service.
std::string service_url(const std::string& host, std::uint16_t port, std::string_view service);

/// Whether none but this machine can connect to `host`, as far as its text tells.
bool is_loopback(std::string_view host);

/// "rr+tcp://127.0.0.1:52222", for Node::listen().
std::string listen_url(const Options& options);

}  // namespace rrgate::demo
