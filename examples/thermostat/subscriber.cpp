// Warms a room up each time that its device comes, and says how warm it is: thermostat_subscriber URL
#include <iostream>

#include "example__thermostat.hpp"
#include "rrgate/subscribe.hpp"

int main(int, char** words) {
  using Room = example::thermostat::ThermostatAsyncClient;
  boost::asio::io_context io;
  auto rooms = rr::subscribe_service(io, words[1]);
  rooms.on_connected([](const rr::AsyncObject& room) { Room(room).target().set(21, [](std::exception_ptr) {}); });
  auto reading = rooms.wire(&Room::reading);
  reading.on_value([](const auto& now) { std::cout << now->celsius << " degrees" << std::endl; });
  io.run();
}
