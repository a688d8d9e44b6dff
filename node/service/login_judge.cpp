#include "node/service/login_judge.hpp"

#include <boost/asio/post.hpp>

namespace rr {

namespace asio = boost::asio;

LoginJudge::~LoginJudge() {
  if (!thread_) return;
  thread_->stop();
  thread_->join();
}

void LoginJudge::judge(const LoginRequested& login, const asio::any_io_executor& executor, Done done) {
  if (!thread_) thread_ = std::make_unique<asio::thread_pool>(1);
  asio::post(*thread_, [login, executor, done = std::move(done)] {
    Result<AuthenticatedUser> result = make_error(ErrorCode::authentication_error, "Authentication Failed");
    try {
      result = login.authenticator->authenticate(login.attempt);
    } catch (...) {
      // Its text, where it has one, may hold anything: the client only hears that it failed.
    }
    asio::post(executor, [login, done, result = std::move(result)] { done(result); });
  });
}

}  // namespace rr
