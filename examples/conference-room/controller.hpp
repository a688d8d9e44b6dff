// The controller: a client of the lights and the sensors that is a service itself. Layer: example.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "room.hpp"
#include "rrgate/device.hpp"
#include "rrgate/subscribe.hpp"

namespace conference_room {

class Controller : public experimental::conference_room::ControllerService {
 public:
  /// Stays connected to the lights and to all sensors, for as long as it lives.
  /// `guests`  sensors that may be missing, such as phones: they count while they are there.
  Controller(boost::asio::io_context& io, const std::string& lights, const std::vector<std::string>& sensors,
             const std::vector<std::string>& guests);
  /// To be called regularly. Does nothing while a device is not there: the lights stay as they are.
  void step();

 private:
  using Readings = rr::TypedWireSubscription<Colours>;
  /// The sensors of one service.
  struct Group {
    rr::ServiceSubscription service;
    Readings readings;
    Places places = {};  ///< empty: not connected
    Colours newest = {};
    bool is_guest = false;
  };

  void subscribe_sensors(const std::string& url, bool is_guest);

  Colour get_target() override { return target_; }
  void set_target(Colour target) override;
  double get_gain() override { return gain_; }
  void set_gain(double gain) override;
  bool get_on() override { return is_on_; }
  void set_on(bool on) override { is_on_ = on; }

  boost::asio::io_context& io_;
  rr::ServiceSubscription lights_;
  Places light_places_;  ///< empty: not connected
  Colours levels_;
  std::vector<std::unique_ptr<Group>> groups_;
  Colour target_{400, 380, 320};
  double gain_ = 0.5;
  bool is_on_ = true;
};

}  // namespace conference_room
