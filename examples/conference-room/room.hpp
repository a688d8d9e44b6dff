// The light of the room: which lights and sensors there are, and how much of each light reaches each sensor. Layer:
// example, pure.
#pragma once

#include <vector>

#include "experimental__conference_room.hpp"

namespace conference_room {

using experimental::conference_room::Colour;
using experimental::conference_room::Place;
using Colours = std::vector<Colour>;
using Places = std::vector<Place>;

/// Eight, in two rows along the table.
Places light_places();
/// Twelve on the table and beside it: six in the northern half, then six in the southern one.
Places sensor_places();

/// The light transport T: what a light of level 1 adds to a sensor, in lx.
double transport(const Place& light, const Place& sensor);

/// daylight + T levels: what each sensor measures.
Colours measure(const Colours& levels, const Places& lights, const Places& sensors, const Colour& daylight);

/// One step of the controller, levels + gain T' (target - readings) / |T|^2, kept within 0 and 1.
Colours follow(const Colours& levels, const Places& lights, const Colours& readings, const Places& sensors,
               const Colour& target, double gain);

}  // namespace conference_room
