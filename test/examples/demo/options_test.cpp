#include "examples/demo/options.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

using namespace rrgate::demo;

namespace {

constexpr int not_set = -1;

std::optional<Options> parse(std::vector<std::string> arguments, int& exit_code, const std::string& robot = {}) {
  std::vector<char*> argv{const_cast<char*>("program")};
  for (auto& argument : arguments) argv.push_back(argument.data());
  exit_code = not_set;
  return parse_options({"program", "A purpose.", {"127.0.0.1", 52222, robot}}, static_cast<int>(argv.size()),
                       argv.data(), exit_code);
}

}  // namespace

TEST_CASE("options are read in both spellings, defaults stay") {
  int exit_code = 0;
  CHECK(parse({}, exit_code)->port == 52222);
  const auto options = parse({"--port", "0", "--host=::1"}, exit_code);
  REQUIRE(options);
  CHECK(options->port == 0);
  CHECK(options->host == "::1");
  CHECK(listen_url(*options) == "rr+tcp://[::1]:0");
  const auto with_robot = parse({"--robot=rr+tcp://h:1/?service=Create"}, exit_code, "rr+tcp://x:1/?service=Create");
  CHECK(with_robot->robot == "rr+tcp://h:1/?service=Create");
}

TEST_CASE("mistakes end the program with code 2, help with 0") {
  int exit_code = 0;
  for (const auto& mistake : std::vector<std::vector<std::string>>{
           {"--port", "70000"}, {"--port", "12x"}, {"--port"}, {"--prt", "1"}, {"file"}, {"--robot", "x"}}) {
    CHECK_FALSE(parse(mistake, exit_code));
    CHECK(exit_code == 2);
  }
  CHECK_FALSE(parse({"--robot", "nonsense"}, exit_code, "rr+tcp://x:1/?service=Create"));
  CHECK(exit_code == 2);
  CHECK_FALSE(parse({"--help"}, exit_code));
  CHECK(exit_code == 0);
}

TEST_CASE("webcams are of this machine, out of files, or on a robot") {
  const std::string robot = "rr+tcp://x:1/?service=Create";
  int exit_code = 0;
  const auto all = parse({}, exit_code, robot);
  REQUIRE(all);
  CHECK((all->devices.empty() && all->pictures.empty() && !all->is_on_robot));
  const auto two = parse({"--device", "/dev/video0", "--device=/dev/video2"}, exit_code, robot);
  CHECK(two->devices == std::vector<std::string>{"/dev/video0", "/dev/video2"});
  CHECK(parse({"--device", "auto"}, exit_code, robot)->devices == std::vector<std::string>{"auto"});
  CHECK(parse({"--device", "none"}, exit_code, robot)->devices == std::vector<std::string>{"none"});
  CHECK(parse({"--pictures", "folder"}, exit_code, robot)->pictures == "folder");
  CHECK(parse({"--robot", robot}, exit_code, robot)->is_on_robot);
  const std::vector<std::string> seventeen(17, "--device=/dev/video0");
  for (const auto& mistake : std::vector<std::vector<std::string>>{{"--device", "/dev/video0", "--device", "none"},
                                                                   {"--device", "auto", "--device", "auto"},
                                                                   {"--device", "none", "--pictures", "folder"},
                                                                   {"--device", "/dev/video0", "--robot", robot},
                                                                   {"--pictures", "folder", "--robot", robot},
                                                                   {"--device", ""},
                                                                   {"--pictures", ""},
                                                                   {"--device"},
                                                                   seventeen}) {
    CHECK_FALSE(parse(mistake, exit_code, robot));
    CHECK(exit_code == 2);
  }
  CHECK_FALSE(parse({"--device", "/dev/video0"}, exit_code));  // a program without cameras
  CHECK_FALSE(parse({"--pictures", "folder"}, exit_code));
}

TEST_CASE("the printed URL is one that clients can use") {
  CHECK(service_url("127.0.0.1", 5, "Create") == "rr+tcp://127.0.0.1:5/?service=Create");
  CHECK(service_url("0.0.0.0", 5, "Create") == "rr+tcp://127.0.0.1:5/?service=Create");
  CHECK(service_url("::1", 5, "Create") == "rr+tcp://[::1]:5/?service=Create");
}

TEST_CASE("it is known whether other machines can connect") {
  for (const char* host : {"127.0.0.1", "127.3.2.1", "localhost", "::1", "[::1]"}) CHECK(is_loopback(host));
  for (const char* host : {"0.0.0.0", "::", "[::]", "192.168.1.2", "robot.lab", ""}) CHECK_FALSE(is_loopback(host));
}
