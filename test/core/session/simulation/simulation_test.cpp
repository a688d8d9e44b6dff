// A thousand courses of events between sessions, each made by its seed. RR_SIMULATION_SEED=N plays one of them alone
// and tells what happens in it.
#include <catch2/catch.hpp>
#include <cstdlib>

#include "test/core/session/simulation/simulation.hpp"

#if RR_COUNT_ALLOCATIONS
#include "test/support/count_allocations.hpp"
#endif

using namespace rr::test;

namespace {

std::string play(std::uint64_t seed, Deeds& deeds, bool is_loud = false) {
  Simulation simulation(seed, is_loud);
  try {
    simulation.run();
  } catch (const std::exception& fault) {
    return std::string(fault.what()) + " (RR_SIMULATION_SEED=" + std::to_string(seed) + " plays it again)";
  }
  for (std::size_t i = 0; i < deeds.size(); ++i) deeds[i] += simulation.deeds()[i];
  return {};
}

}  // namespace

TEST_CASE("what both sides were told holds, however the network and the clocks behave") {
  Deeds deeds{};
  if (const auto* chosen = std::getenv("RR_SIMULATION_SEED")) {
    CHECK(play(std::strtoull(chosen, nullptr, 10), deeds, true) == "");
    return;
  }
  const auto* wanted = std::getenv("RR_SIMULATION_SEEDS");
  const std::uint64_t seeds = wanted ? std::strtoull(wanted, nullptr, 10) : RR_SIMULATION_SEEDS;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const auto fault = play(seed, deeds);
    if (!fault.empty()) FAIL_CHECK(fault);
  }
  // That much has happened that the above means something: each deed in every tenth run or more.
  for (std::size_t i = 0; i < deeds.size(); ++i) {
    CAPTURE(i, deeds[i]);
    CHECK(deeds[i] >= seeds / 10);
  }
}

TEST_CASE("a seed makes one course of events") {
  const auto trace = [](std::uint64_t seed) {
    Simulation simulation(seed);
    simulation.run();
    return simulation.trace();
  };
  CHECK(trace(7) == trace(7));
  CHECK(trace(7) != trace(8));
}

#if RR_COUNT_ALLOCATIONS
TEST_CASE("sessions that broke anywhere leave no memory behind") {
  Deeds deeds{};
  play(1, deeds);
  const auto before = live_bytes;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) play(seed, deeds);
  CHECK(live_bytes == before);
}
#endif
