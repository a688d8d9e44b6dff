#include "core/discovery/announcement.hpp"

#include <catch2/catch.hpp>

#include "core/session/url.hpp"
#include "test/support/print.hpp"

using namespace rr;

namespace {

const std::string id_text = "82301bf1-e1ef-4e89-8d8f-0848291587ac";
const NodeId id = parse_node_id(id_text).value();
const std::string title = "Robot Raconteur Node Discovery Packet\n";

PacketSource from(std::string_view address, std::string zone = "eth0") {
  return {parse_ip_address(address).value(), std::move(zone), false};
}

std::string url_at(const std::string& host, const std::string& scheme = "rr+tcp") {
  return scheme + "://" + host + ":52222/?nodeid=" + id_text + "&service=RobotRaconteurServiceIndex";
}

std::string packet(const std::string& url, const std::string& node = "{" + id_text + "},probe.srv") {
  return title + node + "\n" + url + "\nServiceStateNonce: HMWmpo4JgxqgfzQS\n";
}

Announcement accepted(std::string_view text, const PacketSource& source) {
  const auto read = parse_announcement(text, source);
  INFO(text);
  REQUIRE(read);
  return *read;
}

void refused(std::string_view text, const PacketSource& source, std::string_view why) {
  const auto read = parse_announcement(text, source);
  INFO(text);
  REQUIRE_FALSE(read.has_value());
  CHECK(read.error().code == ErrorCode::protocol_error);
  CHECK_THAT(read.error().message, Catch::Contains(std::string(why)));
}

}  // namespace

TEST_CASE("an announcement is written as the reference writes it, and read back") {
  Announcement announcement{id, "probe.srv", url_at("192.168.1.5"), "HMWmpo4JgxqgfzQS"};
  const auto text = format_announcement(announcement);
  CHECK(text ==
        "Robot Raconteur Node Discovery Packet\n"
        "{82301bf1-e1ef-4e89-8d8f-0848291587ac},probe.srv\n"
        "rr+tcp://192.168.1.5:52222/?nodeid=82301bf1-e1ef-4e89-8d8f-0848291587ac&service=RobotRaconteurServiceIndex\n"
        "ServiceStateNonce: HMWmpo4JgxqgfzQS\n");
  CHECK(accepted(text, from("192.168.200.9")) == announcement);

  announcement.node_name.clear();
  announcement.service_state_nonce.clear();
  CHECK(accepted(format_announcement(announcement), from("192.168.200.9")) == announcement);
}

TEST_CASE("the nonce goes when the packet would be too long") {
  Announcement announcement{id, "n", "rr+tcp://h/?" + std::string(2048 - title.size() - 39 - 2 - 13 - 36, 'x'),
                            "HMWmpo4JgxqgfzQS"};
  CHECK(format_announcement(announcement).size() == 2048);
  announcement.url += 'x';
  CHECK(format_announcement(announcement).size() == 2049 - 36);
}

TEST_CASE("a link-local URL gets the zone it was heard in") {
  const auto source = from("fe80::9", "eth0");
  CHECK(accepted(packet(url_at("[fe80::1]")), source).url == url_at("[fe80::1%eth0]"));
  CHECK(accepted(packet(url_at("[fe80::1%wlan7]")), source).url == url_at("[fe80::1%eth0]"));
  CHECK(accepted(packet(url_at("[fe80::1]")), from("fe80::9", "")).url == url_at("[fe80::1]"));
  CHECK(accepted(packet(url_at("[fec0::1]")), source).url == url_at("[fec0::1]"));
}

TEST_CASE("addresses must belong to the sender's network") {
  accepted(packet(url_at("192.168.1.5")), from("192.168.77.3"));
  refused(packet(url_at("192.168.1.5")), from("192.169.1.5"), "does not belong");
  refused(packet(url_at("192.168.1.5")), from("fe80::1"), "does not belong");
  refused(packet(url_at("[fe80::1]")), from("192.168.1.5"), "does not belong");
  refused(packet(url_at("[fd00::1]")), from("fe80::1"), "does not belong");
  refused(packet(url_at("[2001:db8::1]")), from("fe80::1"), "does not belong");
  refused(packet(url_at("[::ffff:192.168.1.5]")), from("fe80::1"), "does not belong");
}

TEST_CASE("a loopback URL is taken from this machine only") {
  for (const auto* host : {"127.0.0.1", "[::1]"}) {
    refused(packet(url_at(host)), from("fe80::9"), "does not belong");
    refused(packet(url_at(host)), from("192.168.1.1"), "does not belong");
    auto own = from("fe80::9");
    own.is_this_machine = true;
    accepted(packet(url_at(host)), own);
    accepted(packet(url_at(host)), from("127.0.0.1"));
  }
}

TEST_CASE("the URL is an IP literal and names the node") {
  const auto source = from("192.168.1.9");
  refused(packet(url_at("localhost")), source, "expected an IP address");
  refused(packet(url_at("robot.example.org")), source, "expected an IP address");
  refused(packet("rr+local:///?nodeid=" + id_text + "&service=RobotRaconteurServiceIndex"), source,
          "expected an IP address");
  refused(packet("rr+tcp://192.168.1.5:52222/?service=RobotRaconteurServiceIndex"), source, "expected nodeid=");
  refused(packet("rr+tcp://192.168.1.5:52222/?nodeid=82301bf1-e1ef-4e89-8d8f-0848291587ad&service=x"), source,
          "expected nodeid=");
  refused(packet("http://192.168.1.5/"), source, "scheme");
  refused(packet("rr+tcp://192.168.1.5:99999/?nodeid=" + id_text + "&service=x"), source, "port");
  refused(packet(url_at("192.168.1.5") + std::string(300, 'x')), source, "longer than 256");
}

TEST_CASE("the node id is a node's, and not one of ours") {
  const auto source = from("192.168.1.9");
  refused(packet(url_at("192.168.1.5"), "nobody"), source, "");
  refused(packet(url_at("192.168.1.5"), "{00000000-0000-0000-0000-000000000000},a"), source, "all zeros");
  const auto own = parse_announcement(packet(url_at("192.168.1.5")), source, std::span(&id, 1));
  REQUIRE_FALSE(own.has_value());
  CHECK_THAT(own.error().message, Catch::Contains("our own"));
}

TEST_CASE("what the reference does not object to") {
  const auto source = from("192.168.1.9");
  const auto plain = accepted(packet(url_at("192.168.1.5")), source);
  CHECK(accepted(packet(url_at("192.168.1.5"), id_text + ",probe.srv"), source) == plain);
  auto text = packet(url_at("192.168.1.5"));
  CHECK(accepted(text + '\0', source) == plain);
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.insert(at, "\r");
  CHECK(accepted(text, source) == plain);
  CHECK(accepted(packet(url_at("192.168.1.5", "rr+ws")), source).url == url_at("192.168.1.5", "rr+ws"));
  accepted(packet("rr+tcp://192.168.1.5:52222/?nodeid=" + id_text + "&service=Create"), source);
}

TEST_CASE("names that are too long, or none, become empty") {
  const auto name_of = [&](const std::string& name) {
    return accepted(packet(url_at("192.168.1.5"), "{" + id_text + "}," + name), from("192.168.1.9")).node_name;
  };
  CHECK(name_of("a.b-c_d1") == "a.b-c_d1");
  CHECK(name_of(std::string(128, 'a')) == std::string(128, 'a'));
  CHECK(name_of(std::string(129, 'a')).empty());
  CHECK(name_of("<b>").empty());
  CHECK(name_of("").empty());
}

TEST_CASE("attributes behind the URL") {
  const auto nonce_of = [&](const std::string& rest) {
    return accepted(title + id_text + "\n" + url_at("192.168.1.5") + "\n" + rest, from("192.168.1.9"))
        .service_state_nonce;
  };
  CHECK(nonce_of("").empty());
  CHECK(nonce_of("Other: x\n  ServiceStateNonce :  abc  \n") == "abc");
  CHECK(nonce_of("not an attribute\nServiceStateNonce: abc").compare("abc") == 0);
  CHECK(nonce_of("ServiceStateNonce: " + std::string(31, 'n')) == std::string(31, 'n'));
  CHECK(nonce_of("ServiceStateNonce: " + std::string(32, 'n')).empty());
}

TEST_CASE("packets cut at any byte are refused or read, never more") {
  const auto text = packet(url_at("192.168.1.5"));
  for (std::size_t size = 0; size < text.size(); ++size) {
    const auto read = parse_announcement(std::string_view(text).substr(0, size), from("192.168.1.9"));
    if (read) CHECK(read->node_id == id);
  }
  refused(text + std::string(max_discovery_packet_bytes, 'x'), from("192.168.1.9"), "expected at most 8192");
}

TEST_CASE("requests") {
  const auto text = format_discovery_request(id);
  CHECK(text == "Robot Raconteur Discovery Request Packet\n{82301bf1-e1ef-4e89-8d8f-0848291587ac}\n");
  REQUIRE(parse_discovery_request(text));
  CHECK(parse_discovery_request(text).value() == id);
  CHECK_FALSE(parse_discovery_request("Robot Raconteur Discovery Request Packet\n").has_value());
  CHECK_FALSE(parse_discovery_request("Robot Raconteur Discovery Request Packet\nwho\n").has_value());
  CHECK_FALSE(parse_discovery_request(packet(url_at("192.168.1.5"))).has_value());
  refused(text, from("192.168.1.9"), "begins with");
}

TEST_CASE("nonces are 16 letters and digits, each time others") {
  const auto one = make_service_state_nonce();
  CHECK(one.size() == 16);
  CHECK(one.find_first_not_of("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz") == std::string::npos);
  CHECK(one != make_service_state_nonce());
}
