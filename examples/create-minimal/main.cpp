// rrgate-create-serial DEVICE [[HOST:]PORT]: a Robot Raconteur node with an iRobot Create on a serial line. Layer:
// example.
#include <iostream>

#include "create_serial.hpp"

int main(int count, char** words) {
  if (count < 2 || count > 3 || words[1][0] == '-') {
    std::cerr
        << "usage: rrgate-create-serial DEVICE [[HOST:]PORT]    as /dev/ttyUSB0; 52222 without PORT, 0 for a free "
           "one; all addresses without HOST\n";
    return 2;
  }
  int exit_code = 0;
  try {
    rr::Node node("experimental.create.Create");
    const create_minimal::CreateSerial create(node, words[1], [&](const std::string& why) {
      std::cerr << "rrgate-create-serial: " << words[1] << " is gone: " << why << std::endl;
      exit_code = 1;
      node.stop();
    });
    const std::string address = count == 3 ? words[2] : "52222";
    const bool has_host = address.find(':') != std::string::npos;
    const auto port = node.listen("rr+tcp://" + (has_host ? "" : std::string("0.0.0.0:")) + address);
    std::cout << "rr+tcp://127.0.0.1:" << port << "/?service=Create" << std::endl;
    node.run();
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-create-serial: " << words[1] << ": " << failure.what() << '\n';
    return 1;
  }
  return exit_code;
}
