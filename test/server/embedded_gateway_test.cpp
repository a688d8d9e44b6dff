// A gateway inside a program, as its users have it.
#include "server/gateway/embedded_gateway.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <thread>

#include "core/session/url.hpp"
#include "test/server/support/test_client.hpp"

using namespace rrgate::test;
using Catch::Matchers::Contains;

namespace {

const std::string quiet = R"("devices": [], "log": {"level": "error"})";

std::string listening_on(const std::string& address) {
  return R"({"listen": [")" + address + R"("], )" + quiet + "}";
}

unsigned health_of(const std::string& address) {
  TestClient client(rr::parse_host_port(address).value().port);
  client.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  return client.receive_response().status;
}

/// What the constructor throws.
template <class Problem>
std::string problem_with(const std::string& config) {
  try {
    rr::EmbeddedGateway gateway(config);
  } catch (const Problem& problem) {
    return problem.what();
  }
  return "nothing";
}

}  // namespace

TEST_CASE("a gateway inside a program serves at its addresses until another thread stops it") {
  rr::EmbeddedGateway gateway(R"({"listen": ["127.0.0.1:0", "127.0.0.1:0"], )" + quiet + "}");
  REQUIRE(gateway.addresses().size() == 2);
  std::thread serving([&] { gateway.run(); });
  for (const auto& address : gateway.addresses()) CHECK(health_of(address) == 200);
  gateway.stop();
  serving.join();
  CHECK_THROWS(health_of(gateway.addresses().front()));
}

TEST_CASE("a gateway that was stopped before it ran does not run, and one that never ran just goes") {
  rr::EmbeddedGateway stopped(listening_on("127.0.0.1:0"));
  stopped.stop();
  stopped.run();
  const rr::EmbeddedGateway unused(listening_on("127.0.0.1:0"));
  CHECK(unused.addresses().size() == 1);
}

TEST_CASE("a gateway that can't be is an exception that says why") {
  const auto mistakes = problem_with<std::invalid_argument>(R"({"listen": ["here"], "devices": [], "limit": 3})");
  CHECK_THAT(mistakes, Contains("/listen/0: address 'here'") && Contains("\n") && Contains("/limit"));
  const rr::EmbeddedGateway first(listening_on("127.0.0.1:0"));
  CHECK_THAT(problem_with<std::runtime_error>(listening_on(first.addresses().front())), Contains("in use"));
}

TEST_CASE("files of an embedded gateway's configuration are looked for in the folder that is given") {
  const auto folder = std::filesystem::temp_directory_path() / ("rrgate_embedded_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder / "site");
  std::ofstream(folder / "site/index.html") << "<html>here</html>";
  {
    rr::EmbeddedGateway gateway(R"({"listen": ["127.0.0.1:0"], "web_root": "site", )" + quiet + "}", folder);
    std::thread serving([&] { gateway.run(); });
    TestClient client(rr::parse_host_port(gateway.addresses().front()).value().port);
    client.send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    CHECK(client.receive_response().body == "<html>here</html>");
    gateway.stop();
    serving.join();
  }
  std::filesystem::remove_all(folder);
}
