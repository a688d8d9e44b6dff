// The lights and the sensors of the simulated room. Layer: example.
#pragma once

#include <algorithm>
#include <memory>
#include <string>

#include "room.hpp"
#include "rrgate/device.hpp"

namespace conference_room {

namespace definition = experimental::conference_room;

inline void check_levels(const Colours& levels, std::size_t count) {
  if (levels.size() != count)
    throw rr::ServiceException(
        "levels of " + std::to_string(levels.size()) + " lights, expected " + std::to_string(count),
        rr::ErrorCode::invalid_argument);
  const auto is_level = [](double level) { return level >= 0 && level <= 1; };
  for (const auto& each : levels)
    if (!is_level(each.red) || !is_level(each.green) || !is_level(each.blue))
      throw rr::ServiceException("a level is outside of 0 to 1", rr::ErrorCode::invalid_argument);
}

/// Lights whose levels clients set.
class Lights : public definition::LightsService {
 public:
  const Places& at() const { return places_; }
  const Colours& levels() const { return levels_; }
  void publish() { shown(levels_); }

 private:
  struct Light : definition::LightService {
    Light(Lights& all, std::size_t number) : all_(all), number_(number) {}
    Colour get_level() override { return all_.levels_[number_]; }
    void set_level(Colour level) override {
      check_levels({level}, 1);
      all_.levels_[number_] = level;
    }
    Place get_place() override { return all_.places_[number_]; }
    Lights& all_;
    std::size_t number_;
  };

  Colours get_levels() override { return levels_; }
  void set_levels(Colours levels) override {
    check_levels(levels, levels_.size());
    levels_ = std::move(levels);
  }
  Places get_places() override { return places_; }
  std::shared_ptr<definition::LightService> get_lights(std::int32_t index) override {
    if (index < 0 || static_cast<std::size_t>(index) >= levels_.size()) return nullptr;
    return std::make_shared<Light>(*this, static_cast<std::size_t>(index));
  }

  Places places_ = light_places();
  Colours levels_ = Colours(places_.size());
};

/// Some of the sensors of the room.
class Sensors : public definition::SensorsService {
 public:
  explicit Sensors(Places places) : places_(std::move(places)) {}
  void publish(const Lights& lights) { readings(measure(lights.levels(), lights.at(), places_, daylight_)); }

 private:
  Places get_places() override { return places_; }
  Colour get_daylight() override { return daylight_; }
  void set_daylight(Colour daylight) override { daylight_ = daylight; }

  Places places_;
  Colour daylight_{60, 60, 80};
};

}  // namespace conference_room
