#include "server/record/recorder.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::seconds follow_again_period{1};

/// The types of a session, which live as long as its connection.
std::shared_ptr<const rr::TypeRegistry> types_of(const std::shared_ptr<rr::ClientConnection>& connection) {
  return {connection, &connection->session().types()};
}

asio::awaitable<const rr::EntityDefinition*> find_object(std::shared_ptr<rr::ClientConnection> connection,
                                                         std::string path) {
  if (const auto* known = connection->session().object_type(path)) co_return known;
  const auto find = [connection, path](auto handler) {
    const rr::detail::CompleteOnce<rr::Value, decltype(handler)> done(std::move(handler), connection->executor());
    connection->find_object(path, done);
  };
  co_await asio::async_initiate<const asio::use_awaitable_t<>, void(std::exception_ptr, rr::Value)>(
      find, asio::use_awaitable);
  const auto* type = connection->session().object_type(path);
  if (!type)
    throw rr::ClientException(
        rr::make_error(rr::ErrorCode::object_not_found, "the type of " + rr::quote(path) + " is not known"));
  co_return type;
}

}  // namespace

void Recorder::start(const rr::ConnectOptions& options) {
  rr::SubscriptionOptions how;
  how.connect = options;
  subscription_ = rr::subscribe_service(io_, url_, how);
  const std::weak_ptr<Recorder> weak = weak_from_this();
  subscription_->on_failed([weak](const rr::Error& error, const std::string&) {
    if (const auto self = weak.lock()) self->record_->begin(error);
  });
  subscription_->on_lost([weak](const rr::AsyncObject&, const rr::Error& reason) {
    const auto self = weak.lock();
    if (!self) return;
    self->record_->end_connection();
    self->record_->tell_problem("connection", "lost: " + reason.message);
  });
  subscription_->on_connected([weak](const rr::AsyncObject& root) {
    if (const auto self = weak.lock()) asio::co_spawn(self->io_, self->handle_connected(root), asio::detached);
  });
}

void Recorder::close() {
  record_->close();
  if (subscription_) subscription_->close();
}

asio::awaitable<void> Recorder::handle_connected(rr::AsyncObject root) {
  const auto self = shared_from_this();
  try {
    co_await record(root);
  } catch (const rr::Exception& failure) {
    if (record_->has_begun())
      record_->tell_problem("connection", failure.what());
    else
      record_->begin(failure.error());
  }
}

asio::awaitable<void> Recorder::record(rr::AsyncObject root) {
  const auto connection = root.connection();
  record_->end_connection();
  const auto types = types_of(connection);
  ServiceRecord::FindObject find = [connection](std::string path) { return find_object(connection, std::move(path)); };
  const auto choice = co_await record_->choose(connection->session(), *types, std::move(find));
  if (record_->is_closed()) co_return;
  std::vector<RecordedMemberPlace> properties;
  for (const auto& each : choice.members) {
    if (each.member->kind == rr::MemberKind::property) {
      properties.push_back(each);
      continue;
    }
    std::string refusal;
    try {
      co_await follow(connection, each);
      record_->solve_problem(each.name());
    } catch (const rr::Exception& failure) {
      refusal = failure.what();
    }
    if (!refusal.empty()) record_->tell_problem(each.name(), refusal);
  }
  record_->solve_problem("connection");
  record_->begin({});
  record_->read_properties(io_.get_executor(), properties, types, [connection](const RecordedMemberPlace& property) {
    return rr::AsyncObject(connection, property.path).get(property.member->name);
  });
}

asio::awaitable<void> Recorder::follow(std::shared_ptr<rr::ClientConnection> connection, RecordedMemberPlace member) {
  const auto& name = member.member->name;
  const rr::AsyncObject object(connection, member.path);
  // Without the connection, which has the handlers.
  const std::weak_ptr<ServiceRecord> weak = record_;
  const auto* types = &connection->session().types();
  if (member.member->kind == rr::MemberKind::event) {
    object.on_event(name, [weak, member, types](std::span<const rr::Value> values) {
      if (const auto record = weak.lock()) record->write_event(member, *types, values);
    });
    co_return;
  }
  const auto received = [weak, member, types](const rr::Value& value, std::optional<rr::TimeSpec> sent) {
    if (const auto record = weak.lock()) record->write_value(member, *types, value, sent);
  };
  const auto closed = [self = weak_from_this(), of = std::weak_ptr(connection), member] {
    const auto recorder = self.lock();
    if (!recorder || recorder->record_->is_closed()) return;
    recorder->record_->tell_problem(member.name(), "the device has closed it");
    const auto executor = recorder->io_.get_executor();
    asio::co_spawn(executor, follow_again(executor, self, of, member), asio::detached);
  };
  if (member.member->kind == rr::MemberKind::wire) {
    rr::ClientConnection::WireHandler handler = [received](const rr::Value& value, rr::TimeSpec time) {
      received(value, time);
    };
    connection->on_wire_closed(member.path, name, closed);
    co_await object.connect_wire(name, std::move(handler));
  } else {
    rr::ClientConnection::PipeHandlers handlers;
    handlers.received = [received](const rr::Value& packet) { received(packet, {}); };
    handlers.closed = closed;
    co_await object.connect_pipe(name, std::move(handlers));
  }
}

asio::awaitable<void> Recorder::follow_again(asio::any_io_executor executor, std::weak_ptr<Recorder> by,
                                             std::weak_ptr<rr::ClientConnection> connection,
                                             RecordedMemberPlace member) {
  asio::steady_timer timer(executor);
  for (;;) {
    timer.expires_after(follow_again_period);
    co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
    const auto self = by.lock();
    const auto still_there = connection.lock();
    if (!self || !still_there || still_there->is_closed() || self->record_->is_closed()) co_return;
    std::string refusal;
    try {
      co_await find_object(still_there, member.path);  // which the device may have replaced
      co_await self->follow(still_there, member);
    } catch (const rr::Exception& failure) {
      refusal = failure.what();
    }
    if (still_there->is_closed()) co_return;
    if (refusal.empty()) {
      self->record_->solve_problem(member.name());
      co_return;
    }
    self->record_->tell_problem(member.name(), refusal);
  }
}

}  // namespace rrgate
