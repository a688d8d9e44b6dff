#include "server/gateway/embedded_gateway.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <stdexcept>

#include "server/config/config.hpp"
#include "server/gateway/gateway.hpp"
#include "server/log/log.hpp"

namespace rr {

namespace {

rrgate::Config read_embedded_config(std::string_view text, const std::filesystem::path& folder) {
  auto parsed = rrgate::parse_config(text, folder);
  std::string problems;
  for (const auto& finding : parsed.findings) {
    if (!problems.empty()) problems += '\n';
    problems += (finding.path.empty() ? "" : finding.path + ": ") + finding.text;
  }
  if (!problems.empty()) throw std::invalid_argument(problems);
  return std::move(parsed.config);
}

}  // namespace

struct EmbeddedGateway::State {
  explicit State(rrgate::Config config) : gateway(io, std::move(config)) {}

  void stop() {
    gateway.stop([] {});
  }

  boost::asio::io_context io{1};
  rrgate::Gateway gateway;
  std::vector<std::string> addresses;
};

EmbeddedGateway::EmbeddedGateway(std::string_view config, const std::filesystem::path& folder)
    : state_(std::make_unique<State>(read_embedded_config(config, folder))) {
  const auto& log = state_->gateway.config().log;
  rrgate::configure_log(log.level, log.format);
  const auto bound = state_->gateway.start();
  if (!bound) throw std::runtime_error(bound.error().message);
  for (const auto& address : *bound) state_->addresses.push_back(format_host_port(address.host, address.port));
}

EmbeddedGateway::~EmbeddedGateway() {
  if (state_->io.stopped()) return;  // run() has come to its end
  state_->stop();
  state_->stop();
  state_->io.run();
}

const std::vector<std::string>& EmbeddedGateway::addresses() const {
  return state_->addresses;
}

void EmbeddedGateway::run() {
  state_->io.run();  // returns when everything has ended by itself: nothing outlives what it refers to
}

void EmbeddedGateway::stop() {
  boost::asio::post(state_->io, [state = state_.get()] { state->stop(); });
}

}  // namespace rr
