#include "node/service/pipe_endpoint.hpp"

#include <algorithm>

namespace rr {

Result<> PipeEndpoint::send(const Value& value) const {
  if (!is_open())
    return make_error(ErrorCode::invalid_operation, "pipe '" + state_->member->name + "': the endpoint is closed");
  auto sent = state_->sender->send_pipe_packet(state_->id, value);
  if (!sent) return sent.error();
  return {};
}

void PipeEndpoint::close() const {
  if (is_open()) state_->sender->close_pipe(state_->id);
}

bool PipeEndpoint::broadcast(SharedPipePacket& packet, std::int32_t max_backlog) const {
  if (!is_open()) return false;
  const bool is_limited = max_backlog != no_backlog_limit;
  const bool lags = is_limited && backlog() > static_cast<std::size_t>(std::max(max_backlog, 0));
  const auto sent = lags ? make_error(ErrorCode::out_of_system_resource, "the endpoint lags behind")
                         : state_->sender->send_pipe_packet(state_->id, packet);
  if (!sent) {
    ++state_->missed;
    return false;
  }
  if (is_limited) state_->unacknowledged.push_back(*sent);
  return true;
}

void PipeEndpoint::acknowledge(std::span<const std::uint32_t> numbers) const {
  for (const auto number : numbers) std::erase(state_->unacknowledged, number);
}

}  // namespace rr
