// Records a service: follows its wires, pipes and events, asks for its properties. Layer: server/record.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "node/subscribe/service_subscription.hpp"
#include "server/record/recording_writer.hpp"

namespace rrgate {

struct RecorderOptions {
  /// Members by the paths of HTTP, with '*' and '?' in the member's name: "state", "axes/0/pos*". All of the root
  /// object: "*". Members that can't be recorded (functions, memories, what is writeonly) are meant by no pattern.
  std::vector<std::string> members = {"*"};
  std::chrono::milliseconds interval{1000};  ///< between two readings of a property
};

/// One service, for as long as it lives; connects again after each loss. For the thread of its io_context.
class Recorder : public std::enable_shared_from_this<Recorder> {
 public:
  struct Listener {
    /// Once: the members of the first connection are followed, or why there is nothing to record.
    std::function<void(const rr::Result<>&)> begun;
    /// What is not recorded; the rest goes on.
    std::function<void(const std::string&)> problem;
    /// The file can't be written: nothing is recorded any more.
    std::function<void(const rr::Error&)> failed;
  };

  /// `writer`  outlives close().
  Recorder(boost::asio::io_context& io, RecordingWriter& writer, RecorderOptions options, Listener listener)
      : io_(io), writer_(writer), options_(std::move(options)), listener_(std::move(listener)) {}

  void start(const std::string& url, const rr::ConnectOptions& options);
  /// Nothing is written any more. The service is told, which takes half a second at most.
  void close();

 private:
  struct Chosen {
    rr::AsyncObject object;
    std::string place;  ///< "axes/0"
    const rr::MemberDefinition* member = nullptr;
    std::uint16_t channel = 0;
  };
  struct Due {
    std::chrono::steady_clock::time_point time;
    Chosen property;
  };

  boost::asio::awaitable<void> handle_connected(rr::AsyncObject root);
  boost::asio::awaitable<void> record(const rr::AsyncObject& root);
  boost::asio::awaitable<std::vector<Chosen>> choose(const rr::AsyncObject& root, RecordedService& service);
  boost::asio::awaitable<void> choose_by(const std::string& pattern, const rr::AsyncObject& root,
                                         RecordedService& service, std::vector<Chosen>& chosen);
  void add_to_file(const rr::AsyncObject& root, RecordedService& service, std::vector<Chosen>& chosen);
  boost::asio::awaitable<void> follow(const Chosen& chosen);
  void read_properties(const std::vector<Chosen>& properties, std::uint64_t connection);
  boost::asio::awaitable<void> read_what_is_due(std::shared_ptr<std::deque<Due>> due, std::uint64_t connection);
  void write(std::uint16_t channel, const rr::OrderedJson& message, std::optional<rr::TimeSpec> sent);
  void write_value(const Chosen& chosen, const rr::TypeRegistry& types, const rr::Value& value,
                   std::optional<rr::TimeSpec> sent);
  void tell_problem(const std::string& where, const std::string& what);
  void begin(const rr::Result<>& outcome);

  boost::asio::io_context& io_;
  RecordingWriter& writer_;
  RecorderOptions options_;
  Listener listener_;
  std::string url_;
  std::optional<rr::ServiceSubscription> subscription_;
  std::optional<RecordedService> service_;         ///< once it is in the file
  std::map<std::string, std::uint16_t> channels_;  ///< by place and member
  std::map<std::string, std::string> problems_;    ///< told: each once, until it is another
  std::uint64_t connection_ = 0;                   ///< counts connections
  bool has_begun_ = false;
  bool is_closed_ = false;
};

}  // namespace rrgate
