#include "test/load/load_client.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>

#include "core/session/service_path.hpp"
#include "core/support/random.hpp"
#include "node/transport/dial.hpp"

namespace asio = boost::asio;

MemberName MemberName::parse(const std::string& text) {
  const auto dot = text.rfind('.');
  if (dot == std::string::npos) return {"", text};
  return {text.substr(0, dot), text.substr(dot + 1)};
}

LoadClient::LoadClient(asio::io_context& io, const LoadPlan& plan, LoadOwner& owner, bool stalls)
    : io_(io),
      plan_(plan),
      owner_(owner),
      stalls_(stalls),
      backoff_(std::chrono::milliseconds(250), std::chrono::milliseconds(4000)),
      retry_(io) {}

void LoadClient::connect() {
  asio::co_spawn(io_, open(), asio::detached);
}

void LoadClient::connect_later() {
  retry_.expires_after(backoff_.next());
  retry_.async_wait([this](const rr::error_code& error) {
    if (!error) connect();
  });
}

void LoadClient::resume() {
  if (stream_) stream_->resume();
}

asio::awaitable<void> LoadClient::open() {
  rr::DialOptions options;
  options.timeout = std::chrono::seconds(30);
  auto dialed = co_await rr::dial(plan_.url, std::move(options));
  if (!dialed) co_return end(dialed.error());
  auto stream = std::make_unique<StallingStream>(std::move(*dialed));
  stream_ = stream.get();
  rr::ClientOptions session;
  session.service = plan_.url.service;
  session.connection.target = {plan_.url.node_id.value_or(rr::NodeId{}), plan_.url.node_name};
  if (stalls_) session.connection.heartbeat_period = session.connection.receive_timeout = std::chrono::hours(24);
  rr::ClientConnection::open(std::move(stream), std::move(session),
                             [this](rr::Result<std::shared_ptr<rr::ClientConnection>> result) {
                               if (result)
                                 opened(std::move(*result));
                               else
                                 end(result.error());
                             });
}

void LoadClient::opened(std::shared_ptr<rr::ClientConnection> connection) {
  connection_ = std::move(connection);
  connection_->on_closed([this](const rr::Error& reason) { end(reason); });
  if (!plan_.wire.member.empty()) find(plan_.wire, &LoadClient::listen_to_wire);
  if (!plan_.pipe.member.empty()) find(plan_.pipe, &LoadClient::listen_to_pipe);
  if (!plan_.event.member.empty()) find(plan_.event, &LoadClient::listen_to_event);
  look_whether_ready();
}

void LoadClient::find(const MemberName& name, void (LoadClient::*use)(const std::string& path)) {
  if (name.path.empty()) return (this->*use)(connection_->root_path());
  const auto path = connection_->root_path() + "." + name.path;
  connection_->find_object(path, [this, path, use](const rr::Result<rr::Value>& found) {
    if (!connection_) return;
    if (found)
      (this->*use)(path);
    else
      connection_->close(found.error());
  });
}

void LoadClient::listen_to_wire(const std::string& path) {
  auto received = [this](const rr::Value&, rr::TimeSpec time) {
    owner_.received_value(*this, time);
    has_value_ = true;
    look_whether_ready();
  };
  connection_->connect_wire(path, plan_.wire.member, received, [this](const rr::Result<rr::Value>& connected) {
    if (!connected && connection_) connection_->close(connected.error());
  });
}

void LoadClient::listen_to_pipe(const std::string& path) {
  rr::ClientConnection::PipeHandlers handlers;
  handlers.received = [this](const rr::Value& packet) { note_packet(packet); };
  handlers.closed = [this] {
    connection_->close(rr::make_error(rr::ErrorCode::connection_error, "the service closed the pipe"));
  };
  connection_->connect_pipe(path, plan_.pipe.member, rr::any_pipe_index, std::move(handlers),
                            [this](const rr::Result<rr::Value>& connected) {
                              if (!connection_) return;
                              if (!connected) return connection_->close(connected.error());
                              has_pipe_ = true;
                              look_whether_ready();
                            });
}

void LoadClient::listen_to_event(const std::string& path) {
  connection_->on_event(path, plan_.event.member,
                        [this](std::span<const rr::Value> arguments) { note_packet(arguments.front()); });
  has_event_ = true;
  look_whether_ready();
}

/// Packets of the load device are numbered; those of others count alone.
void LoadClient::note_packet(const rr::Value& packet) {
  const auto* structure = packet.get_if<rr::Structure>();
  const auto* number = structure ? structure->find("number") : nullptr;
  const auto current = number ? number->to<std::uint64_t>().value() : last_packet_ + 1;
  const bool is_next = last_packet_ == 0 || current == last_packet_ + 1;
  last_packet_ = current;
  owner_.received_packet(*this, is_next);
}

void LoadClient::look_whether_ready() {
  const auto waits_for = [](const MemberName& name, bool is_there) { return !name.member.empty() && !is_there; };
  if (is_ready_ || waits_for(plan_.wire, has_value_) || waits_for(plan_.pipe, has_pipe_) ||
      waits_for(plan_.event, has_event_))
    return;
  is_ready_ = true;
  backoff_.reset();
  if (stalls_) stream_->stall();
  owner_.became_ready(*this);
}

void LoadClient::end(const rr::Error& reason) {
  stream_ = nullptr;
  connection_.reset();
  has_value_ = has_pipe_ = has_event_ = false;
  last_packet_ = 0;
  owner_.ended(*this, reason);
  is_ready_ = false;
}
