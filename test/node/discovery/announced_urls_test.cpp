#include "node/discovery/announced_urls.hpp"

#include <catch2/catch.hpp>

using namespace rr;

namespace {

const NodeId id = parse_node_id("82301bf1-e1ef-4e89-8d8f-0848291587ac").value();

LocalAddress own(const std::string& text, const std::string& interface, unsigned index) {
  auto address = boost::asio::ip::make_address(text);
  if (address.is_v6() && address.to_v6().is_link_local()) {
    auto v6 = address.to_v6();
    v6.scope_id(index);
    address = v6;
  }
  return {address, interface, index};
}

const std::vector<LocalAddress> machine = {own("127.0.0.1", "lo", 1),  own("::1", "lo", 1),
                                           own("10.0.0.5", "eth0", 2), own("fe80::5", "eth0", 2),
                                           own("fd00::5", "eth0", 2),  own("fe80::7", "eth1", 3)};

/// "from -> url" a line; "(here)" where it stays on the machine.
std::string announced(const std::vector<ListenAddress>& listens) {
  std::string out;
  for (const auto& each : announced_urls(id, listens, machine)) {
    CHECK(each.url.substr(each.url.find('?')) ==
          "?nodeid=82301bf1-e1ef-4e89-8d8f-0848291587ac&service=RobotRaconteurServiceIndex");
    out +=
        each.from.interface + " -> " + each.url.substr(0, each.url.find('?')) + (each.stays_here ? " (here)\n" : "\n");
  }
  return out;
}

}  // namespace

TEST_CASE("a listener at all addresses is announced at the link-local ones and those of IPv4") {
  CHECK(announced({{"rr+tcp", "::", 52222}}) ==
        "eth0 -> rr+tcp://10.0.0.5:52222/\neth0 -> rr+tcp://[fe80::5]:52222/\neth1 -> rr+tcp://[fe80::7]:52222/\n");
  CHECK(announced({{"rrs+tcp", "0.0.0.0", 52222}}) == "eth0 -> rrs+tcp://10.0.0.5:52222/\n");
}

TEST_CASE("a listener at one address is announced there") {
  CHECK(announced({{"rr+tcp", "fe80::7%3", 1}}) == "eth1 -> rr+tcp://[fe80::7]:1/\n");
  CHECK(announced({{"rr+tcp", "10.0.0.5", 1}}) == "eth0 -> rr+tcp://10.0.0.5:1/\n");
  CHECK(announced({{"rr+tcp", "fd00::5", 1}}).empty());
  CHECK(announced({{"rr+tcp", "10.0.0.9", 1}}).empty());
  CHECK(announced({{"rr+local", "", 0}}).empty());
  CHECK(announced({}).empty());
}

TEST_CASE("a listener on the loopback is announced on this machine, from every link") {
  CHECK(announced({{"rr+tcp", "127.0.0.1", 1}}) ==
        "eth0 -> rr+tcp://127.0.0.1:1/ (here)\neth1 -> rr+tcp://127.0.0.1:1/ (here)\n");
  CHECK(announced({{"rr+tcp", "::1", 1}}) == "eth0 -> rr+tcp://[::1]:1/ (here)\neth1 -> rr+tcp://[::1]:1/ (here)\n");
}
