// A gateway inside a program, until somebody presses Enter: thermostat_gateway URL
#include <iostream>
#include <thread>

#include "rrgate/gateway.hpp"

int main(int, char** words) {
  rr::EmbeddedGateway gateway(R"({
    "listen": ["127.0.0.1:0"],
    "devices": [{"name": "room", "url": ")" +
                              std::string(words[1]) + R"("}],
    "log": {"level": "warning"}
  })");
  std::thread serving([&] { gateway.run(); });
  for (const auto& address : gateway.addresses()) std::cout << "http://" << address << std::endl;
  std::cin.get();
  gateway.stop();
  serving.join();
}
