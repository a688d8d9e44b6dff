#include "node/service/late_call.hpp"

#include <utility>

namespace rr {

LateCall::LateCall(std::shared_ptr<NodeThread> thread, boost::asio::any_io_executor executor, BlockingPool& pool,
                   Caller caller, std::shared_ptr<const void> needed, Done done)
    : thread_(std::move(thread)),
      executor_(std::move(executor)),
      pool_(pool),
      caller_(std::move(caller)),
      needed_(std::move(needed)),
      done_(std::move(done)) {}

LateCall::~LateCall() {
  answer(make_error(ErrorCode::operation_failed, "its handler has ended without an answer"));
}

void LateCall::answer(Result<Value> result, std::shared_ptr<const void> used) {
  if (is_answered_.exchange(true)) return;
  thread_->post([done = std::move(done_), result = std::move(result), needed = std::move(needed_),
                 used = std::move(used)] { done(result); });
}

}  // namespace rr
