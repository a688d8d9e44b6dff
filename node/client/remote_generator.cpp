#include "node/client/remote_generator.hpp"

#include "node/client/client.hpp"

namespace rr {

RemoteGenerator::RemoteGenerator(std::shared_ptr<BlockingConnection> connection, std::string path, std::string function,
                                 std::int32_t index)
    : state_(std::make_shared<State>(State{std::move(connection), std::move(path), std::move(function), index})) {}

std::optional<Value> RemoteGenerator::step(const std::optional<Value>& parameter) {
  if (state_->has_ended) return std::nullopt;
  try {
    return state_->connection->wait_for([&](ClientConnection& connection, auto done) {
      connection.next_generator(state_->path, state_->function, state_->index, parameter, std::move(done));
    });
  } catch (const ClientException& exception) {
    if (exception.error().code != ErrorCode::stop_iteration) throw;
    state_->has_ended = true;
    return std::nullopt;
  }
}

void RemoteGenerator::close() {
  if (std::exchange(state_->has_ended, true)) return;
  state_->connection->wait_for([&](ClientConnection& connection, auto done) {
    connection.close_generator(state_->path, state_->function, state_->index, std::move(done));
  });
}

void RemoteGenerator::abort() {
  if (state_->has_ended) return;
  state_->connection->wait_for([&](ClientConnection& connection, auto done) {
    connection.abort_generator(state_->path, state_->function, state_->index, std::move(done));
  });
}

}  // namespace rr
