// rrgate-demo-microassembly: one of the four nodes of a cell. Layer: example.
//
//   rrgate-demo-microassembly cell|stages|cameras|illuminators [--group NAME] [--port N]
#include <iostream>
#include <map>
#include <string>

#include "cameras.hpp"
#include "cell.hpp"

namespace {

using namespace microassembly;
using std::chrono::milliseconds;

template <class T>
void serve(rr::Node& node, const std::string& service, const std::string& port, const std::shared_ptr<T>& object) {
  node.add(rr::make_service(service, object));
  const auto bound = node.listen("rr+tcp://127.0.0.1:" + port);
  node.listen("rr+local:///");  // where the others find it
  std::cout << "rr+tcp://127.0.0.1:" << bound << "/?service=" << service << std::endl;
  node.run();
}

void run(const std::string& part, const std::string& group, const std::string& port) {
  rr::Node node(group + "." + part);
  if (part == "stages") {
    const auto stages = std::make_shared<Stages>();
    node.every(milliseconds(50), [&] { stages->move(0.05); });
    return serve(node, "Stages", port, stages);
  }
  if (part == "illuminators") return serve(node, "Illuminators", port, std::make_shared<Illuminators>());
  Finder finder(node.io_context(), group);
  if (part == "cameras") {
    const auto cameras = std::make_shared<Cameras>(finder);
    node.every(milliseconds(100), [&] { cameras->take_pictures(); });
    return serve(node, "Cameras", port, cameras);
  }
  const auto cell = std::make_shared<Cell>(finder);
  node.every(milliseconds(100), [&] { cell->publish(); });
  serve(node, "Cell", port, cell);
}

int fail_usage() {
  std::cerr << "usage: rrgate-demo-microassembly cell|stages|cameras|illuminators [--group NAME] [--port N]\n";
  return 2;
}

}  // namespace

int main(int count, char** words) {
  std::map<std::string, std::string> options{{"--group", "microassembly"}, {"--port", "0"}};
  const std::string part = count > 1 ? words[1] : "";
  if (part != "cell" && part != "stages" && part != "cameras" && part != "illuminators") return fail_usage();
  for (int i = 2; i < count; i += 2) {
    const auto option = options.find(words[i]);
    if (option == options.end() || i + 1 == count) return fail_usage();
    option->second = words[i + 1];
  }
  try {
    run(part, options.at("--group"), options.at("--port"));
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-demo-microassembly: " << failure.what() << '\n';
    return 1;
  }
}
