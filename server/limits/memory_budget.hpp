// One account of the bytes that clients make the gateway hold. Layer: server/limits. Without locks: for one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

namespace rrgate {

/// How much memory there is: that of the machine, or of the control group where that is less.
std::size_t machine_memory();

/// Nobody may hold more than is left for all others. So one client alone gets half of it, two get a third each, and
/// there is always something left for whoever comes next.
class MemoryBudget {
  struct State {
    std::size_t total;
    std::size_t used = 0;
    std::uint64_t refusals = 0;
    std::map<std::string, std::size_t> by_client = {};
  };

 public:
  /// Bytes that are held for one client; given back when it goes. May outlive the budget.
  class Charge {
   public:
    Charge(Charge&& other) noexcept : state_(std::move(other.state_)), client_(std::move(other.client_)) {
      bytes_ = std::exchange(other.bytes_, 0);
    }
    Charge& operator=(Charge&&) = delete;
    ~Charge() { hold(0); }

    /// From now on so many bytes are held. False: that is too much, and nothing has changed; less is never too much.
    [[nodiscard]] bool resize(std::size_t bytes);
    /// The same for what is there already: counted in any case.
    void hold(std::size_t bytes);
    /// Whether so many bytes more would go. Counts as a refusal where not.
    [[nodiscard]] bool has_room(std::size_t more) const;
    std::size_t bytes() const { return bytes_; }
    /// Another one of the same client, of nothing yet.
    Charge sibling() const { return Charge(state_, client_); }

   private:
    friend class MemoryBudget;
    Charge(std::shared_ptr<State> state, std::string client) : state_(std::move(state)), client_(std::move(client)) {}

    std::shared_ptr<State> state_;
    std::string client_;
    std::size_t bytes_ = 0;
  };

  explicit MemoryBudget(std::size_t total) : state_(std::make_shared<State>(State{total})) {}

  /// Of nothing yet. `client`  by its network; empty: the gateway itself.
  Charge charge(std::string client) { return Charge(state_, std::move(client)); }

  void set_total(std::size_t total) { state_->total = total; }
  std::size_t total() const { return state_->total; }
  std::size_t used() const { return state_->used; }
  std::uint64_t refusals() const { return state_->refusals; }
  std::size_t clients() const { return state_->by_client.size(); }

 private:
  std::shared_ptr<State> state_;
};

}  // namespace rrgate
