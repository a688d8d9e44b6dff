// Records a service of a device by the session that the gateway has with it. Layer: server/recordings.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <string>
#include <vector>

#include "node/driver/backoff.hpp"
#include "server/record/service_record.hpp"
#include "server/upstream/value_clients.hpp"

namespace rrgate {

/// For as long as it lives; the session connects again after each loss. For the gateway's thread.
class DeviceRecorder : public std::enable_shared_from_this<DeviceRecorder> {
 public:
  /// `clients`, `writer`  outlive close().
  DeviceRecorder(std::shared_ptr<Device> device, std::string service, ValueClients& clients, RecordingWriter& writer,
                 RecorderOptions options, RecordListener listener);

  /// RecordListener::failed hears, too, why there is nothing to record, now or from now on; begun hears of success
  /// alone.
  void start();
  /// Nothing is written any more.
  void close();
  const Device& device() const { return *device_; }
  /// Whether the session is there, and is recorded.
  bool is_following() const { return client_ && client_->upstream()->is_open(); }

 private:
  /// A wire, a pipe or an event.
  struct Followed {
    RecordedMemberPlace member;
    ValueClient::ListenerPtr listener = nullptr;
    std::shared_ptr<bool> has_ended = std::make_shared<bool>(false);  ///< for whatever reason but a lost connection
  };

  boost::asio::awaitable<void> run();
  boost::asio::awaitable<void> wait(std::chrono::milliseconds time);
  boost::asio::awaitable<void> record(std::shared_ptr<ValueClient> client);
  /// Chooses the members; those that are followed already go on. Returns whether all that is wanted is there.
  boost::asio::awaitable<bool> follow_chosen(std::shared_ptr<ValueClient> client);
  /// `types`  that `member` is of.
  boost::asio::awaitable<bool> follow(std::shared_ptr<ValueClient> client, RecordedMemberPlace member,
                                      std::shared_ptr<const rr::TypeRegistry> types);
  void read(const std::shared_ptr<ValueClient>& client, std::vector<RecordedMemberPlace> properties);
  bool has_one_ended() const;
  void leave();

  std::shared_ptr<Device> device_;
  std::string service_;
  ValueClients& clients_;
  std::function<void(const rr::Error&)> failed_;
  std::shared_ptr<ServiceRecord> record_;
  std::vector<Followed> followed_;
  std::vector<RecordedMemberPlace> properties_;  ///< that are read now
  rr::Backoff backoff_;
  boost::asio::steady_timer wake_;
  std::shared_ptr<ValueClient> client_;  ///< that is recorded
};

}  // namespace rrgate
