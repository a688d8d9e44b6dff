#include "controller.hpp"

#include <cmath>

namespace conference_room {

namespace definition = experimental::conference_room;

Controller::Controller(boost::asio::io_context& io, const std::string& lights, const std::vector<std::string>& sensors,
                       const std::vector<std::string>& guests)
    : io_(io), lights_(rr::subscribe_service(io, lights)) {
  lights_.on_connected([this](const rr::AsyncObject& object) {
    const definition::LightsAsyncClient client(object);
    client.places().get([this](std::exception_ptr failure, Places places) {
      if (!failure) light_places_ = std::move(places);
    });
  });
  lights_.on_lost([this](const auto&, const auto&) { light_places_.clear(); });
  for (const auto& url : sensors) subscribe_sensors(url, false);
  for (const auto& url : guests) subscribe_sensors(url, true);
}

void Controller::subscribe_sensors(const std::string& url, bool is_guest) {
  auto service = rr::subscribe_service(io_, url);
  auto readings = service.wire(&definition::SensorsAsyncClient::readings);
  groups_.push_back(std::make_unique<Group>(Group{std::move(service), std::move(readings)}));
  auto& group = *groups_.back();
  group.is_guest = is_guest;
  group.service.on_connected([&group](const rr::AsyncObject& object) {
    definition::SensorsAsyncClient(object).places().get([&group](std::exception_ptr failure, Places places) {
      if (!failure) group.places = std::move(places);
    });
  });
  group.service.on_lost([&group](const auto&, const auto&) {
    group.places.clear();
    group.newest.clear();
  });
  group.readings.on_value([&group](Colours values) { group.newest = std::move(values); });
}

void Controller::step() {
  Places places;
  Colours readings;
  for (const auto& group : groups_) {
    if (group->places.empty() || group->newest.size() != group->places.size()) {
      if (group->is_guest) continue;
      return;
    }
    places.insert(places.end(), group->places.begin(), group->places.end());
    readings.insert(readings.end(), group->newest.begin(), group->newest.end());
  }
  Colour sum;
  double squares = 0;
  for (const auto& each : readings) {
    sum = {sum.red + each.red, sum.green + each.green, sum.blue + each.blue};
    for (const auto colour : {&Colour::red, &Colour::green, &Colour::blue})
      squares += std::pow(each.*colour - target_.*colour, 2);
  }
  const auto count = static_cast<double>(readings.size());
  mean({sum.red / count, sum.green / count, sum.blue / count});
  error(std::sqrt(squares / (3 * count)));

  const auto client = lights_.default_client();
  if (!is_on_ || !client || light_places_.empty()) {
    levels_.clear();
    return;
  }
  const definition::LightsAsyncClient lights(*client);
  if (levels_.size() != light_places_.size()) {  // begins with what somebody has set meanwhile
    lights.levels().get([this](std::exception_ptr failure, Colours levels) {
      if (!failure) levels_ = std::move(levels);
    });
    return;
  }
  levels_ = follow(levels_, light_places_, readings, places, target_, gain_);
  lights.levels().set(levels_, [this](std::exception_ptr failure) {
    if (failure) levels_.clear();
  });
}

void Controller::set_target(Colour target) {
  for (const auto colour : {&Colour::red, &Colour::green, &Colour::blue})
    if (!(target.*colour >= 0 && target.*colour <= 1000))
      throw rr::ServiceException("target " + std::to_string(target.*colour) + ", expected 0 to 1000 lx",
                                 rr::ErrorCode::invalid_argument);
  target_ = target;
}

void Controller::set_gain(double gain) {
  if (!(gain > 0 && gain < 2))
    throw rr::ServiceException("gain " + std::to_string(gain) + ", expected above 0 and below 2",
                               rr::ErrorCode::invalid_argument);
  gain_ = gain;
}

}  // namespace conference_room
