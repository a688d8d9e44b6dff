#include "server/node/service_client.hpp"

#include <exception>
#include <variant>

namespace rr {

namespace {

Error error_of(const std::exception& exception) {
  if (const auto* service_exception = dynamic_cast<const ServiceException*>(&exception))
    return service_exception->error();
  return {ErrorCode::remote_error, exception.what(), "rrgate.UnhandledException"};
}

}  // namespace

ServiceClient::ServiceClient(ClientId id, ServiceClientOwner& owner, ServiceDirectory& directory,
                             ServiceSessionOptions options, boost::asio::ip::tcp::socket socket)
    : SessionDriver(std::move(socket), directory, std::move(options), read_clocks()), id_(id), owner_(&owner) {}

void ServiceClient::send_event(const std::string& path, const MemberDefinition& event,
                               std::span<const Value> arguments) {
  // The values were checked; what fails now is the connection, and its end is heard of by itself.
  (void)session_.send_event(path, event, arguments, read_clocks());
  settle();
}

void ServiceClient::send_wire(const std::string& path, const MemberDefinition& wire, const Value& value) {
  if (!session_.has_wire(path, wire.name)) return;
  (void)session_.send_wire(path, wire, value, read_clocks());
  settle();
}

void ServiceClient::release_path(const std::string& path) {
  session_.release_path(path, read_clocks());
  settle();
}

void ServiceClient::close_service() {
  if (!service_) return close(make_error(ErrorCode::connection_error, "the node stops"));
  session_.close_service(read_clocks());
  settle();
}

void ServiceClient::abandon() {
  owner_ = nullptr;
  close(make_error(ErrorCode::connection_error, "the node was destroyed"));
}

bool ServiceClient::handle_event(Now now) {
  const auto event = session_.poll_event();
  if (!event) return false;
  if (owner_) std::visit([&](const auto& happened) { handle(happened, now); }, *event);
  return true;
}

void ServiceClient::ended() {
  if (owner_) owner_->client_ended(*this);
}

void ServiceClient::handle(const Called& called, Now now) {
  owner_->set_current_client(id_);
  Result<Value> answer = Value{};
  try {
    answer = static_cast<Object&>(*called.object).answer(called);
  } catch (const std::exception& exception) {
    answer = error_of(exception);
  }
  if (owner_) owner_->set_current_client(0);
  session_.reply(called.id, answer, now);
}

void ServiceClient::handle(const ClientConnected& connected, Now) {
  service_ = owner_->find_service(*connected.service);
  if (service_ && service_->on_connected_) service_->on_connected_(id_);
}

void ServiceClient::handle(const LoginRequested& login, Now) {
  owner_->judge_login(login, std::static_pointer_cast<ServiceClient>(shared_from_this()));
}

void ServiceClient::answer_login(LoginId id, Result<AuthenticatedUser> result) {
  session_.answer_login(id, std::move(result), read_clocks());
  settle();
}

void ServiceClient::handle(const WireConnected& connected, Now now) {
  const Value* value = static_cast<Object&>(*connected.object).in_value(*connected.member);
  if (value) (void)session_.send_wire(connected.path, *connected.member, *value, now);  // checked when it was set
}

void ServiceClient::handle(const WireReceived& received, Now) {
  owner_->set_current_client(id_);
  try {
    static_cast<Object&>(*received.object).receive_wire(received);
  } catch (const std::exception& exception) {
    owner_->report("wire '" + received.member->name + "': its handler failed: " + exception.what());
  }
  if (owner_) owner_->set_current_client(0);
}

void ServiceClient::handle(const ClientGone&, Now) {
  Service* const left = std::exchange(service_, nullptr);
  if (left && left->on_gone_) left->on_gone_(id_);
}

}  // namespace rr
