// A service of a device that many clients share: kept connected, and offered again as the gateway's. Layer:
// server/rr. Source: sessions spec section 2.20.
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/upstream/upstream.hpp"

namespace rrgate {

class SharedClient;
class SharedService;

/// The attribute by which a client names its session to the gateway's own service.
inline constexpr std::string_view session_attribute = "rrgate.session";

/// Where a service is offered: on the node of its device, and on the gateway's.
class ServiceBoard {
 public:
  /// Who judges logins; null: the device does.
  virtual std::shared_ptr<const rr::Authenticator> authenticator() const = 0;
  /// Where the name is taken already, the service is not offered there. Does nothing where it is offered already.
  virtual void publish(const std::shared_ptr<rr::HostedService>& hosted, SharedService& service) = 0;
  virtual void withdraw(const rr::HostedService& hosted) = 0;

 protected:
  ~ServiceBoard() = default;
};

class SharedService : public std::enable_shared_from_this<SharedService> {
 public:
  /// `boards`  outlive it.
  SharedService(std::shared_ptr<Device> device, std::string name, std::vector<ServiceBoard*> boards);

  /// Connects, again and again, until stop(). `rests_after`  see Upstream::rest_unused().
  void start(std::chrono::milliseconds rests_after);
  void stop();
  /// Whether the device says that it has the service. Where not, it is offered to nobody until it can be opened again,
  /// and given up with the last one who waits for it.
  void set_listed(bool is_listed);
  /// Offers the service once more where its name was taken.
  void offer_again();
  /// Has logins judged by whoever the boards name now.
  void renew_judge();

  const std::string& name() const { return name_; }
  const std::shared_ptr<Device>& device() const { return device_; }
  /// Null before the device has answered for the first time.
  const std::shared_ptr<rr::HostedService>& hosted() const { return hosted_; }
  /// Whether the first attempt to connect is over, well or not.
  bool has_tried() const { return upstream_->has_tried(); }
  /// The session that all clients share.
  const std::shared_ptr<Upstream>& upstream() const { return upstream_; }
  /// A session for one client alone; not open yet.
  std::shared_ptr<Upstream> make_own_upstream(UpstreamLogin login) const;
  /// Whether a login is for the device to judge.
  bool is_for_device(const rr::Authenticator& authenticator) const { return &authenticator == for_device_.get(); }

  /// Looks for an object and adds it to what is hosted.
  void find_object(Upstream& by, const std::string& path, std::function<void(rr::Result<>)> done);

  void add(SharedClient& client);
  void remove(SharedClient& client);
  const std::set<SharedClient*>& clients() const { return clients_; }
  /// Adds what the clients that are there have had.
  void add_traffic(Traffic& traffic) const;

 private:
  void forget_released(Upstream& upstream) const;
  rr::Result<> publish();
  void publish_anew();
  void withdraw();

  std::shared_ptr<Device> device_;
  std::string name_;
  std::vector<ServiceBoard*> boards_;
  std::shared_ptr<Upstream> upstream_;
  std::shared_ptr<const rr::Authenticator> for_device_;
  std::shared_ptr<rr::TypeRegistry> types_;  ///< of what is hosted
  std::shared_ptr<rr::HostedService> hosted_;
  std::set<SharedClient*> clients_;
};

}  // namespace rrgate
