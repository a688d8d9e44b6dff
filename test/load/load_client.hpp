// One of many clients: connects, listens to a wire, a pipe, an event, or none of them, and tells what becomes of it.
// Test of load.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <string>

#include "node/client/client_connection.hpp"
#include "node/driver/backoff.hpp"
#include "test/load/stalling_stream.hpp"

/// "arm.state": the member "state" of the object behind "arm" of the root object; "state": of the root object.
struct MemberName {
  std::string path;  ///< empty: the root object
  std::string member;

  /// Splits at the last dot.
  static MemberName parse(const std::string& text);
};

/// What every client does; an empty member: none.
struct LoadPlan {
  rr::ConnectionUrl url;
  MemberName wire = {};
  MemberName pipe = {};
  MemberName event = {};
};

class LoadClient;

class LoadOwner {
 public:
  /// It is connected; the first value is there, and the pipe open, where there are such.
  virtual void became_ready(LoadClient& client) = 0;
  virtual void received_value(LoadClient& client, rr::TimeSpec time) = 0;
  /// Or an event. `is_next`  whether it follows the one before it.
  virtual void received_packet(LoadClient& client, bool is_next) = 0;
  /// Connecting failed, or the connection is lost.
  virtual void ended(LoadClient& client, const rr::Error& reason) = 0;

 protected:
  ~LoadOwner() = default;
};

/// For the thread of `io`, which ends before the client does.
class LoadClient {
 public:
  /// `stalls`  stops reading when it is ready, and says nothing more either.
  LoadClient(boost::asio::io_context& io, const LoadPlan& plan, LoadOwner& owner, bool stalls);

  void connect();
  /// The same after a while, half of it by chance.
  void connect_later();
  /// Reads on after the stall.
  void resume();
  bool stalls() const { return stalls_; }
  bool is_ready() const { return is_ready_; }

  std::uint64_t values = 0;  ///< for the owner

 private:
  boost::asio::awaitable<void> open();
  void opened(std::shared_ptr<rr::ClientConnection> connection);
  void listen_to_wire(const std::string& path);
  void listen_to_pipe(const std::string& path);
  void listen_to_event(const std::string& path);
  /// Calls `use` with the path of the member's object once that is known.
  void find(const MemberName& name, void (LoadClient::*use)(const std::string& path));
  void note_packet(const rr::Value& packet);
  void look_whether_ready();
  void end(const rr::Error& reason);

  boost::asio::io_context& io_;
  const LoadPlan& plan_;
  LoadOwner& owner_;
  bool stalls_;
  StallingStream* stream_ = nullptr;  ///< of the connection
  std::shared_ptr<rr::ClientConnection> connection_;
  bool has_value_ = false;
  bool has_pipe_ = false;
  bool has_event_ = false;
  bool is_ready_ = false;
  std::uint64_t last_packet_ = 0;
  rr::Backoff backoff_;
  boost::asio::steady_timer retry_;
};
