// Records a service: follows its wires, pipes and events, asks for its properties. Layer: server/record.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <memory>
#include <optional>
#include <string>

#include "node/subscribe/service_subscription.hpp"
#include "server/record/service_record.hpp"

namespace rrgate {

/// One service, for as long as it lives; connects again after each loss. For the thread of its io_context.
class Recorder : public std::enable_shared_from_this<Recorder> {
 public:
  /// `writer`  outlives close().
  Recorder(boost::asio::io_context& io, RecordingWriter& writer, const std::string& url, RecorderOptions options,
           RecordListener listener)
      : io_(io),
        url_(url),
        record_(std::make_shared<ServiceRecord>(writer, url, std::move(options), std::move(listener))) {}

  void start(const rr::ConnectOptions& options);
  /// Nothing is written any more. The service is told, which takes half a second at most.
  void close();

 private:
  boost::asio::awaitable<void> handle_connected(rr::AsyncObject root);
  boost::asio::awaitable<void> record(rr::AsyncObject root);
  boost::asio::awaitable<void> follow(std::shared_ptr<rr::ClientConnection> connection, RecordedMemberPlace member);
  /// A wire or pipe that the device has closed is asked for again and again, as long as the connection is the same.
  static boost::asio::awaitable<void> follow_again(boost::asio::any_io_executor executor, std::weak_ptr<Recorder> by,
                                                   std::weak_ptr<rr::ClientConnection> connection,
                                                   RecordedMemberPlace member);

  boost::asio::io_context& io_;
  std::string url_;
  std::shared_ptr<ServiceRecord> record_;
  std::optional<rr::ServiceSubscription> subscription_;
};

}  // namespace rrgate
