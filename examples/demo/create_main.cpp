// rrgate-demo-create: a Robot Raconteur node with a simulated iRobot Create. Layer: demo.
#include <iostream>

#include "examples/demo/create_device.hpp"
#include "examples/demo/options.hpp"

int main(int argc, char** argv) {
  using namespace rrgate::demo;
  int exit_code = 0;
  const auto options =
      parse_options({"rrgate-demo-create", "A simulated iRobot Create, for Robot Raconteur.", {"127.0.0.1", 52222, {}}},
                    argc, argv, exit_code);
  if (!options) return exit_code;
  try {
    rr::Node node("rrgate.demo.create");
    const CreateDevice create(node);
    const auto port = node.listen(listen_url(*options));
    std::cout << "create: " << service_url(options->host, port, CreateDevice::service_name) << std::endl;
    node.run();
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-demo-create: " << failure.what() << '\n';
    return 1;
  }
}
