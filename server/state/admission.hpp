// How many connections there may be. Layer: server/state.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <map>
#include <optional>
#include <utility>

#include "server/access/network.hpp"

namespace rrgate {

/// Counts open connections, in all and by address (of IPv6, by network). Outlives its tickets.
class Admission {
 public:
  using Address = boost::asio::ip::address;

  Admission(std::size_t total, std::size_t per_address) : total_(total), per_address_(per_address) {}

  /// Held by a connection as long as it lives.
  class Ticket {
   public:
    Ticket(Ticket&& other) noexcept
        : owner_(std::exchange(other.owner_, nullptr)), address_(std::move(other.address_)) {}
    Ticket& operator=(Ticket&&) = delete;
    ~Ticket() {
      if (owner_) owner_->release(address_);
    }

    /// A proxy has told who its client is, who counts from now on. False when that one has too many already.
    bool pass_to(const Address& client) {
      const auto address = network_of(client);
      if (address_ == address) return true;
      if (owner_->is_full(address)) return false;
      owner_->uncount(address_);
      address_ = address;
      owner_->count(address_);
      return true;
    }

   private:
    friend class Admission;
    Ticket(Admission& owner, std::optional<Address> address) : owner_(&owner), address_(std::move(address)) {}
    Admission* owner_;
    std::optional<Address> address_;
  };

  /// nullopt when there are too many already. Without an address (a proxy: its clients are not told apart yet) the
  /// connection counts in all only.
  std::optional<Ticket> admit(const std::optional<Address>& client) {
    const auto address = client ? std::optional(network_of(*client)) : std::nullopt;
    if (open_ >= total_ || (address && is_full(*address))) return std::nullopt;
    ++open_;
    count(address);
    return Ticket(*this, address);
  }

  /// From now on; who is there already stays.
  void set_limits(std::size_t total, std::size_t per_address) {
    total_ = total;
    per_address_ = per_address;
  }
  std::size_t open() const { return open_; }

 private:
  bool is_full(const Address& address) const {
    const auto found = open_by_address_.find(address);
    return found != open_by_address_.end() && found->second >= per_address_;
  }
  void count(const std::optional<Address>& address) {
    if (address) ++open_by_address_[*address];
  }
  void uncount(const std::optional<Address>& address) {
    if (!address) return;
    const auto found = open_by_address_.find(*address);
    if (--found->second == 0) open_by_address_.erase(found);
  }
  void release(const std::optional<Address>& address) {
    --open_;
    uncount(address);
  }

  std::size_t total_;
  std::size_t per_address_;
  std::size_t open_ = 0;
  std::map<Address, std::size_t> open_by_address_;
};

}  // namespace rrgate
