// What is on the bench: probes that move, and what a microscope sees of them. Layer: example, pure.
#pragma once

#include <cstdint>
#include <vector>

#include "experimental__microassembly.hpp"

namespace microassembly {

namespace definition = experimental::microassembly;
using definition::Picture;
using definition::Pose;
using Poses = std::vector<Pose>;
using Numbers = std::vector<double>;

constexpr std::size_t probe_count = 6;
constexpr std::size_t microscope_count = 4;
constexpr std::size_t focus_count = 3;
constexpr std::size_t illuminator_count = 3;

/// In a circle around the middle of the bench, which is 10 mm wide.
Poses home_poses();
/// Whether an actuator can get there: within 5 mm of the middle, 0 to 2 mm high, any angle up to a turn.
bool is_reachable(const Pose& pose);
/// Nearer to its target, each actuator by its own speed.
Pose step(const Pose& pose, const Pose& target, double seconds);

/// What microscope `number` sees: a quarter of the bench for each. Probes that are not at its focus are blurred.
Picture look(std::size_t number, const Poses& probes, double focus, const Numbers& levels);

}  // namespace microassembly
