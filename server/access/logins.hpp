// Logins: who judges them, in which order, how often one may try, and the record of it. Layer: server/access.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "node/transport/byte_stream.hpp"
#include "server/access/access.hpp"
#include "server/access/login_limits.hpp"

namespace rrgate {

/// A login that a device judges.
struct DeviceLogin {
  std::string user;
  std::string device;
  std::string service;
  ClientOrigin from;
};

/// For the gateway's thread, whichever way a login comes. Networks take turns, those first that have not failed
/// lately: whoever floods the gateway with passwords, be it from many addresses, keeps his own clients waiting.
class Logins {
 public:
  using Judged = rr::Result<rr::AuthenticatedUser>;
  using Done = std::function<void(Judged)>;

  Logins(boost::asio::any_io_executor executor, Access& access);
  Logins(const Logins&) = delete;
  Logins& operator=(const Logins&) = delete;
  ~Logins();

  /// Stands for judge(); null: the gateway has no users, devices judge.
  std::shared_ptr<const rr::Authenticator> authenticator() const { return access_.authenticator(); }

  enum class Of : std::uint8_t { session, request };
  /// Judges by the users file; `done` is called later. A password that was right is remembered for five minutes: with
  /// each request comes one. Of requests only those are recorded that were judged, of sessions all.
  /// Errors   authentication_error; out_of_system_resource: too many of this client are being judged.
  void judge(rr::LoginAttempt attempt, ClientOrigin from, Of of, Done done);
  rr::awaitable<Judged> judge(rr::LoginAttempt attempt, ClientOrigin from, Of of);

  /// Whether a device may be asked to judge a login. Errors   as above. Else finish_at_device() follows.
  rr::Result<LoginLimits::Ticket> begin_at_device(const DeviceLogin& login);
  void finish_at_device(const DeviceLogin& login, const rr::Result<>& result);

 private:
  using Users = std::shared_ptr<const rr::PasswordFileAuthenticator>;
  struct Job {
    std::shared_ptr<const rr::LoginAttempt> attempt;
    ClientOrigin from;
    Of of;
    Done done;
    std::string key;  ///< of known_
    Users users;
    LoginLimits::Ticket ticket;
  };
  struct Known {
    rr::AuthenticatedUser user;
    std::chrono::steady_clock::time_point ends;
  };

  std::deque<std::string>::iterator next_turn();
  std::size_t passwords_of(const std::string& network) const;
  void judge_next();
  void finish(const Job& job, const Judged& result);
  void record(const rr::LoginAttempt& attempt, const ClientOrigin& from, const Judged& result);
  std::string key_of(const rr::LoginAttempt& attempt) const;

  boost::asio::any_io_executor executor_;
  Access& access_;
  LoginLimits limits_;
  rr::Bytes salt_;
  BoundedTable<std::string, Known> known_;
  Users known_in_;                                  ///< the users file that known_ is of
  std::map<std::string, std::deque<Job>> waiting_;  ///< by network
  std::deque<std::string> turns_;                   ///< networks that have something waiting
  std::size_t turns_taken_ = 0;
  bool is_judging_ = false;
  std::shared_ptr<const char> life_ = std::make_shared<const char>('\0');
  boost::asio::thread_pool judge_{1};  ///< hashing a password takes as long as a hundred requests
};

}  // namespace rrgate
