// One account of the bytes that clients make the gateway hold. Layer: server/limits. Without locks: for one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

namespace rrgate {

/// How much memory there is: that of the machine, or of the control group where that is less.
std::size_t machine_memory();

/// Nobody may hold more than is left for all others. So one client alone gets half of it, two get a third each, and
/// there is always something left for whoever comes next.
class MemoryBudget {
  struct State;
  struct Account;

 public:
  /// Bytes that are held for one client; given back when it goes. May outlive the budget.
  class Charge {
   public:
    Charge(Charge&& other) noexcept;
    Charge& operator=(Charge&&) = delete;
    ~Charge();

    /// From now on so many bytes are held. False: that is too much, and nothing has changed; less is never too much.
    [[nodiscard]] bool resize(std::size_t bytes);
    /// The same for what is there already: counted in any case.
    void hold(std::size_t bytes);
    /// So many bytes more would go.
    std::size_t room() const;
    /// Whether so many bytes more would go. Counts as a refusal where not.
    [[nodiscard]] bool has_room(std::size_t more) const;
    std::size_t bytes() const { return bytes_; }
    /// Another one of the same client, of nothing yet.
    Charge sibling() const { return Charge(account_); }

   private:
    friend class MemoryBudget;
    explicit Charge(std::shared_ptr<Account> account) : account_(std::move(account)) {}

    std::shared_ptr<Account> account_;
    std::size_t bytes_ = 0;
  };

  explicit MemoryBudget(std::size_t total);

  /// Of nothing yet. `client`  by its network; empty: the gateway itself; "recordings": what plays those.
  Charge charge(const std::string& client);

  void set_total(std::size_t total);
  std::size_t total() const;
  std::size_t used() const;
  std::uint64_t refusals() const;
  /// With charges, of nothing as well.
  std::size_t clients() const;

 private:
  std::shared_ptr<State> state_;
};

/// Who asks for something new should have room for so much: else it is refused.
inline constexpr std::size_t least_room = 64 * 1024;

/// What stops something is taken though there be no room, where it has no more bytes than this.
inline constexpr std::size_t largest_urgent = 4 * 1024;

}  // namespace rrgate
