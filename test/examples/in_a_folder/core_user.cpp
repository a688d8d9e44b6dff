#include <iostream>

#include "core/session/url.hpp"

int main() {
  std::cout << rr::parse_url("rr+tcp://127.0.0.1:52230/?service=Thermostat").value().port << std::endl;
}
