// An iRobot Create on a serial line, as the Robot Raconteur paper's Example 1 describes it. Layer: example.
#pragma once

#include <array>
#include <boost/asio/serial_port.hpp>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "rrgate/device.hpp"
#include "sensor_stream.hpp"

namespace create_minimal {

class CreateSerial {
 public:
  static constexpr const char* service_name = "Create";

  /// Opens `device`, starts the robot and adds the service to `node`, which does not run any more once this is gone.
  /// `on_lost`  hears once that the line is gone, and why. Requests to the robot fail from then on.
  /// Throws   boost::system::system_error: the line can't be opened.
  CreateSerial(rr::Node& node, const std::string& device, std::function<void(const std::string& why)> on_lost);

 private:
  void add_members();
  void drive(std::int16_t velocity, std::int16_t radius);
  void start_streaming(rr::ClientId client);
  void stop_streaming(rr::ClientId client);
  void press_play();

  void send(std::vector<std::uint8_t> command);
  void write_what_waits();
  void read();
  void take(const std::vector<std::uint8_t>& packet);
  void lose(const boost::system::error_code& why);

  boost::asio::serial_port line_;
  std::function<void(const std::string&)> on_lost_;
  std::string lost_;  ///< why the line is gone; empty while it is not
  std::vector<std::uint8_t> waiting_;
  std::vector<std::uint8_t> written_;
  std::array<std::uint8_t, 512> received_;
  StreamReader stream_;

  std::set<rr::ClientId> listeners_;
  rr::ClientId driver_ = 0;  ///< who sent the last Drive and is still there
  int distance_ = 0;
  int angle_ = 0;
  Sensors sensors_;
  std::shared_ptr<rr::Service> service_;
};

}  // namespace create_minimal
