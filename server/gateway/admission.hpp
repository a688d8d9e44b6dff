// How many connections there may be. Layer: server/gateway.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <map>
#include <optional>
#include <utility>

namespace rrgate {

/// Counts open connections, in all and by address. Outlives its tickets.
class Admission {
 public:
  Admission(std::size_t total, std::size_t per_address) : total_(total), per_address_(per_address) {}

  /// Held by a connection as long as it lives.
  class Ticket {
   public:
    Ticket(Ticket&& other) noexcept : owner_(std::exchange(other.owner_, nullptr)), address_(other.address_) {}
    Ticket& operator=(Ticket&&) = delete;
    ~Ticket() {
      if (owner_) owner_->release(address_);
    }

   private:
    friend class Admission;
    Ticket(Admission& owner, boost::asio::ip::address address) : owner_(&owner), address_(std::move(address)) {}
    Admission* owner_;
    boost::asio::ip::address address_;
  };

  /// nullopt when there are too many already.
  std::optional<Ticket> admit(const boost::asio::ip::address& address) {
    const auto found = open_by_address_.find(address);
    if (open_ >= total_ || (found != open_by_address_.end() && found->second >= per_address_)) return std::nullopt;
    ++open_;
    ++open_by_address_[address];
    return Ticket(*this, address);
  }

  std::size_t open() const { return open_; }

 private:
  void release(const boost::asio::ip::address& address) {
    --open_;
    const auto found = open_by_address_.find(address);
    if (--found->second == 0) open_by_address_.erase(found);
  }

  std::size_t total_;
  std::size_t per_address_;
  std::size_t open_ = 0;
  std::map<boost::asio::ip::address, std::size_t> open_by_address_;
};

}  // namespace rrgate
