#include "server/limits/memory_budget.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace rrgate {

namespace {

/// The number in a file; the largest one where it says "max", or is not there.
std::size_t number_in(const std::string& file) {
  std::ifstream in(file);
  std::size_t number = 0;
  return in >> number ? number : std::size_t(-1);
}

}  // namespace

std::size_t machine_memory() {
  auto bytes = static_cast<std::size_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  const std::string groups = "/sys/fs/cgroup";
  bytes = std::min(bytes, number_in(groups + "/memory.max"));  // of a container
  std::ifstream own("/proc/self/cgroup");
  for (std::string line; std::getline(own, line);)
    if (line.starts_with("0::/")) bytes = std::min(bytes, number_in(groups + line.substr(3) + "/memory.max"));
  return bytes;
}

bool MemoryBudget::Charge::has_room(std::size_t more) const {
  const auto& state = *state_;
  const auto found = state.by_client.find(client_);
  const auto own = found == state.by_client.end() ? 0 : found->second;
  const auto left = state.total - std::min(state.total, state.used);
  if (more <= left && own + more <= left - more) return true;
  ++state_->refusals;
  return false;
}

bool MemoryBudget::Charge::resize(std::size_t bytes) {
  if (bytes > bytes_ && !has_room(bytes - bytes_)) return false;
  hold(bytes);
  return true;
}

void MemoryBudget::Charge::hold(std::size_t bytes) {
  if (bytes == bytes_) return;
  auto& own = state_->by_client[client_];
  own += bytes - bytes_;  // wraps around, and back
  state_->used += bytes - bytes_;
  bytes_ = bytes;
  if (own == 0) state_->by_client.erase(client_);
}

}  // namespace rrgate
