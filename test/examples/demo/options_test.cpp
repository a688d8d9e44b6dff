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

TEST_CASE("the printed URL is one that clients can use") {
  CHECK(service_url("127.0.0.1", 5, "Create") == "rr+tcp://127.0.0.1:5/?service=Create");
  CHECK(service_url("0.0.0.0", 5, "Create") == "rr+tcp://127.0.0.1:5/?service=Create");
  CHECK(service_url("::1", 5, "Create") == "rr+tcp://[::1]:5/?service=Create");
}
