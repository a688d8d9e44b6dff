// Warms a room up: thermostat_client URL
#include <iostream>

#include "example__thermostat.hpp"

int main(int, char** words) {
  const example::thermostat::ThermostatClient room(rr::connect(words[1]));
  bool is_warm = false;
  room.reached().on([&](double celsius) { is_warm = celsius >= 21; });
  room.target().set(21);
  const bool in_time = room.rr_object.connection().run_until([&] { return is_warm; }, std::chrono::seconds(30));
  std::cout << room.reading().peek()->celsius << " degrees" << std::endl;
  return in_time ? 0 : 1;
}
