#include "server/limits/memory_budget.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>

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

struct MemoryBudget::State {
  std::size_t total;
  std::size_t used = 0;
  std::uint64_t refusals = 0;
  std::map<std::string, std::weak_ptr<Account>> accounts = {};
};

/// Of one client; goes with its last charge.
struct MemoryBudget::Account {
  Account(std::shared_ptr<State> its_state, std::string its_client)
      : state(std::move(its_state)), client(std::move(its_client)) {}
  ~Account() { state->accounts.erase(client); }
  Account(const Account&) = delete;
  Account& operator=(const Account&) = delete;

  std::shared_ptr<State> state;
  std::string client;
  std::size_t bytes = 0;
};

MemoryBudget::Charge::Charge(Charge&& other) noexcept
    : account_(std::move(other.account_)), bytes_(std::exchange(other.bytes_, 0)) {}

MemoryBudget::Charge::~Charge() {
  hold(0);
}

std::size_t MemoryBudget::Charge::room() const {
  const auto& state = *account_->state;
  const auto left = state.total - std::min(state.total, state.used);
  return (left - std::min(left, account_->bytes)) / 2;
}

bool MemoryBudget::Charge::has_room(std::size_t more) const {
  if (more <= room()) return true;
  ++account_->state->refusals;
  return false;
}

bool MemoryBudget::Charge::resize(std::size_t bytes) {
  if (bytes > bytes_ && !has_room(bytes - bytes_)) return false;
  hold(bytes);
  return true;
}

void MemoryBudget::Charge::hold(std::size_t bytes) {
  if (bytes == bytes_) return;
  account_->bytes = account_->bytes - bytes_ + bytes;
  account_->state->used = account_->state->used - bytes_ + bytes;
  bytes_ = bytes;
}

MemoryBudget::MemoryBudget(std::size_t total) : state_(std::make_shared<State>(State{total})) {}

MemoryBudget::Charge MemoryBudget::charge(const std::string& client) {
  auto& known = state_->accounts[client];
  auto account = known.lock();
  if (!account) known = account = std::make_shared<Account>(state_, client);
  return Charge(std::move(account));
}

void MemoryBudget::set_total(std::size_t total) {
  state_->total = total;
}

std::size_t MemoryBudget::total() const {
  return state_->total;
}

std::size_t MemoryBudget::used() const {
  return state_->used;
}

std::uint64_t MemoryBudget::refusals() const {
  return state_->refusals;
}

std::size_t MemoryBudget::clients() const {
  return state_->accounts.size();
}

}  // namespace rrgate
