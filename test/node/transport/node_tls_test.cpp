#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/certificate_lab.hpp"

using namespace rr;
using namespace rr::test;
using Catch::Matchers::Contains;

namespace {

void add_greeter(Node& node) {
  const auto service = Service::from_text(
      {"service test.greeter\nstdver 0.10\nobject Greeter\n  function string who()\n  property double[] data\nend\n"},
      "Greeter", "Greeter");
  auto* raw = service.get();  // the node keeps it
  service->function("who", [raw] { return format_node_id(raw->current_caller().verified_node); });
  service->property("data").get([] { return std::vector<double>(100'000, 1.5); }).set([](const std::vector<double>&) {
  });
  node.add(service);
}

struct SecureNode {
  explicit SecureNode(CertificateLab& lab, bool require_tls = false)
      : running(add_greeter, options(lab, require_tls)) {}
  static NodeOptions options(CertificateLab& lab, bool require_tls) {
    NodeOptions out;
    out.id = service_node;
    out.tls = lab.context(lab.good(service_node));
    out.require_tls = require_tls;
    out.report = [](const std::string&) {};
    return out;
  }
  std::string url(const std::string& scheme) const {
    return scheme + "://127.0.0.1:" + std::to_string(running.port()) + "/?service=Greeter";
  }
  RunningNode running;
};

ConnectOptions as(const TlsContextPtr& context, const NodeId& id = {}) {
  ConnectOptions options;
  options.dial.tls = context;
  options.connection.self.id = id;
  return options;
}

}  // namespace

TEST_CASE("TLS below a session, over TCP and WebSockets, beside clients in clear", "[tls]") {
  CertificateLab lab;
  SecureNode node(lab);
  for (const auto* scheme : {"rrs+tcp", "rrs+ws"}) {
    const auto greeter = connect(node.url(scheme), as(lab.anonymous()));
    CHECK(greeter.call("who").to_text().value() == format_node_id({}));
    const Value large = greeter.get("data");
    CHECK(large.to_items<double>().value().size() == 100'000);
    greeter.set("data", large);
  }
  for (const auto* scheme : {"rr+tcp", "rr+ws"})
    CHECK(connect(node.url(scheme)).call("who").to_text().value() == format_node_id({}));
}

TEST_CASE("handlers know the node that a client's certificate proves", "[tls]") {
  CertificateLab lab;
  SecureNode node(lab);
  const auto context = lab.context(lab.good(client_node));
  CHECK(connect(node.url("rrs+tcp"), as(context, client_node)).call("who").to_text().value() ==
        format_node_id(client_node));
  // Who says to be another is refused.
  CHECK(error_of([&] { connect(node.url("rrs+tcp"), as(context, NodeId{{9}})); }).code == ErrorCode::node_not_found);
}

TEST_CASE("a node tells by which schemes it is reached", "[tls]") {
  CertificateLab lab;
  Node node("x", SecureNode::options(lab, false));
  const auto port = std::to_string(node.listen("rr+tcp://127.0.0.1:0"));
  const auto secure_port = std::to_string(node.listen("rrs+tcp://127.0.0.1:0"));
  const auto query = "?nodeid=" + format_node_id(service_node, NodeIdFormat::dashes);
  CHECK(node.listen_urls() == std::vector<std::string>{"rr+tcp://127.0.0.1:" + port + query,
                                                       "rrs+tcp://127.0.0.1:" + port + query,
                                                       "rrs+tcp://127.0.0.1:" + secure_port + query});
}

TEST_CASE("a node that requires TLS", "[tls]") {
  CertificateLab lab;
  SecureNode node(lab, true);
  CHECK_NOTHROW(connect(node.url("rrs+tcp"), as(lab.anonymous())));
  CHECK_THAT(error_of([&] { connect(node.url("rr+tcp")); }).message, Contains("use rrs+tcp"));
  CHECK_THAT(error_of([&] { connect(node.url("rr+ws")); }).message, Contains("use rrs+tcp"));
}

TEST_CASE("TLS that can't be", "[tls]") {
  CertificateLab lab;
  CertificateLab strangers;
  SecureNode node(lab);
  const auto untrusting = error_of([&] { connect(node.url("rrs+tcp"), as(strangers.anonymous())); });
  CHECK(untrusting.code == ErrorCode::authentication_error);
  CHECK_THAT(untrusting.message, Contains("the CA 'CN = Lab CA' is not trusted here"));
  RunningNode plain(add_greeter);
  CHECK_THAT(error_of([&] {
               connect("rrs+tcp://127.0.0.1:" + std::to_string(plain.port()) + "/?service=Greeter",
                       as(lab.anonymous()));
             }).message,
             Contains("Server certificate not loaded"));
  Node without("x");
  CHECK_THROWS_WITH(without.listen("rrs+tcp://127.0.0.1:0"), Contains("TLS needs a certificate"));
}
