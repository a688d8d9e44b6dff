#include "test/server/support/test_gateway.hpp"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <stdexcept>

#include "server/log/log.hpp"

namespace rrgate::test {

namespace asio = boost::asio;

namespace {

std::string device_name(std::size_t index) {
  return std::string(1, static_cast<char>('x' + index));
}

}  // namespace

TestGateway::TestGateway(std::size_t device_count, const std::function<void(Config&)>& change) {
  configure_log("error", "text");
  Config config;
  config.listen.push_back({"127.0.0.1", 0});
  config.retry = {milliseconds(50), milliseconds(100), milliseconds(200)};
  config.timeouts.drain = milliseconds(0);
  for (std::size_t i = 0; i < device_count; ++i) {
    devices_.push_back(std::make_unique<FakeDevice>(io_, "node." + device_name(i)));
    device_ports_.push_back(devices_.back()->port());
    config.devices.push_back({device_name(i), rr::parse_url(devices_.back()->url()).value(), 0});
  }
  if (change) change(config);
  gateway_.emplace(io_, std::move(config));
  port_ = gateway_->start().value().front().port;
  work_.emplace(io_.get_executor());
  thread_ = std::thread([this] { io_.run(); });
}

TestGateway::~TestGateway() {
  stop().wait();
  devices_.clear();
  work_.reset();
  thread_.join();
}

void TestGateway::end_device(std::size_t index) {
  devices_.at(index).reset();
}

void TestGateway::restart_device(std::size_t index) {
  std::promise<void> done;
  asio::post(io_, [&] {
    devices_.at(index) = std::make_unique<FakeDevice>(io_, "node." + device_name(index), device_ports_.at(index));
    done.set_value();
  });
  done.get_future().wait();
}

nlohmann::json TestGateway::wait_for(const std::string& path,
                                     const std::function<bool(const nlohmann::json&)>& is_wanted) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  TestClient client(port_);
  nlohmann::json answer;
  while (std::chrono::steady_clock::now() < give_up) {
    client.send("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    answer = nlohmann::json::parse(client.receive_response().body);
    if (is_wanted(answer)) return answer;
  }
  throw std::runtime_error(path + " not as wanted within 10 s: " + answer.dump());
}

nlohmann::json TestGateway::wait_for_device(std::size_t index,
                                            const std::function<bool(const nlohmann::json&)>& is_wanted) {
  const auto answer =
      wait_for("/api/v1/devices", [&](const auto& all) { return is_wanted(all.at("devices").at(index)); });
  return answer.at("devices").at(index);
}

void TestGateway::announce(const rr::Announcement& announcement) {
  asio::post(io_, [this, announcement] { gateway_->found()->discovery().handle_announcement(announcement); });
}

void TestGateway::withdraw(const rr::NodeId& node_id, const std::string& url) {
  asio::post(io_, [this, node_id, url] { gateway_->found()->discovery().handle_withdrawn(node_id, url); });
}

void TestGateway::reconfigure(const std::function<void(Config&)>& change) {
  std::promise<rr::Result<>> done;
  asio::post(io_, [&] {
    auto next = gateway_->config();
    change(next);
    done.set_value(gateway_->reconfigure(std::move(next)));
  });
  done.get_future().get().value();
}

void TestGateway::visit(const std::function<void(Gateway&)>& look) {
  std::promise<void> done;
  asio::post(io_, [&] {
    look(*gateway_);
    done.set_value();
  });
  done.get_future().wait();
}

std::string TestGateway::wait_for_state(std::string_view state, std::size_t index) {
  return wait_for_device(index, [&](const auto& device) { return device["state"] == std::string(state); }).dump();
}

std::future<void> TestGateway::stop() {
  auto done = std::make_shared<std::promise<void>>();
  auto future = done->get_future();
  asio::post(io_, [this, done] {
    if (std::exchange(is_stopped_, true)) return done->set_value();
    gateway_->stop([done] { done->set_value(); });
  });
  return future;
}

}  // namespace rrgate::test
