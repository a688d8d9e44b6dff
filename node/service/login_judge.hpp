// Judges logins on a thread of its own. Layer: node/service. Source: sessions spec section 2.15.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <memory>

#include "core/session/service/service_session.hpp"

namespace rr {

/// A good password hash takes long: what a node does for its other clients must not wait for it.
class LoginJudge {
 public:
  using Done = std::function<void(Result<AuthenticatedUser> result)>;

  LoginJudge() = default;
  LoginJudge(const LoginJudge&) = delete;
  LoginJudge& operator=(const LoginJudge&) = delete;
  ~LoginJudge();

  /// Calls `done` on `executor`, later.
  void judge(const LoginRequested& login, const boost::asio::any_io_executor& executor, Done done);

 private:
  std::unique_ptr<boost::asio::thread_pool> thread_;  ///< there once somebody has tried to log in
};

}  // namespace rr
