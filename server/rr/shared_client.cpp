#include "server/rr/shared_client.hpp"

#include "server/log/log.hpp"
#include "server/rr/shared_access.hpp"
#include "server/rr/shared_node.hpp"

namespace rrgate {

namespace {

/// So little is not worth an entry: what answers and values leave behind before the stream takes them.
constexpr std::size_t uncounted_bytes = 16 * 1024;

const std::string& path_of(const rr::ServiceObject& object) {
  return static_cast<const SharedObject&>(object).path();
}

}  // namespace

SharedClient::SharedClient(SharedNode& node, rr::ServiceSessionOptions options, std::unique_ptr<rr::ByteStream> stream,
                           ClientOrigin from, MemoryBudget::Charge memory, std::shared_ptr<SessionRights> rights,
                           std::string key)
    : SessionDriver(std::move(stream), node.directory(), std::move(options), rr::read_clocks()),
      node_(node),
      from_(std::move(from)),
      memory_(std::move(memory)),
      rights_(std::move(rights)),
      key_(std::move(key)) {}

template <class F>
auto SharedClient::while_here(F work) {
  return [this, weak = weak_from_this(), work = std::move(work)](const auto&... results) {
    const auto self = weak.lock();
    if (!self) return;
    work(results...);
    settle();
  };
}

void SharedClient::close_service() {
  session_.close_service(rr::read_clocks());
  settle();
}

/// A right to disconnect is the same as that to connect, and asking for it is not recorded.
void SharedClient::review() {
  for (const auto& [key, member] : std::map(wires_)) {
    if (!service_) return;  // what was sent has ended the session, and the members may be gone
    const auto& path = key.first;
    if (session_.admits(rr::EntryType::wire_disconnect_req, path, member)) continue;
    home_->leave_wire(*this, path, *member);
    close_wire(path, *member);
  }
  for (const auto& [id, pipe] : std::unordered_map(pipes_)) {
    if (!service_) return;
    if (session_.admits(rr::EntryType::pipe_disconnect_req, pipe.path, pipe.member)) continue;
    home_->leave_pipe(*this, id);
    close_pipe(id);
  }
  if (service_) home_->review_locks(*this);
}

bool SharedClient::handle_event(rr::Now) {
  const auto event = session_.poll_event();
  if (!event) return false;
  std::visit([&](const auto& happened) { handle(happened); }, *event);
  return true;
}

void SharedClient::ended() {
  handle(rr::ClientGone{});
  // One that came when the client had left already, or was not let in.
  if (const auto unused = std::exchange(login_, nullptr)) unused->close();
  node_.client_ended(*this);
}

void SharedClient::handle(const rr::ClientConnected& connected) {
  service_ = node_.find_service(connected.service->name());
  if (!service_) return;
  service_->add(*this);
  home_ = login_ ? login_ : service_->upstream();
  home_->add(*this);
}

void SharedClient::handle(const rr::ClientGone&) {
  if (!service_) return;
  home_->remove(*this);
  service_->remove(*this);
  if (login_) login_->close();
  service_.reset();
  wires_.clear();
  pipes_.clear();
  const auto callbacks = std::exchange(callbacks_, {});
  for (const auto& [id, answer] : callbacks)
    answer(rr::make_error(rr::ErrorCode::connection_error, "the client is gone"));
}

// --- requests ---

void SharedClient::handle(const rr::Called& called) {
  if (!service_) return;
  home_->request(*this, called, while_here([this, id = called.id](const rr::Result<rr::Value>& result) {
    session_.reply(id, result, rr::read_clocks());
  }));
}

void SharedClient::handle(const rr::GeneratorEnded& ended) {
  if (home_) home_->drop_generator(*this, ended.id);
}

void SharedClient::handle(const rr::ObjectWanted& wanted) {
  if (!service_) return;
  service_->find_object(*home_, wanted.path, while_here([this, path = wanted.path](const rr::Result<>& found) {
    session_.handle_object_found(path, found, rr::read_clocks());
  }));
}

/// A client that is told that it has left holds no lock any more.
void SharedClient::handle(const rr::LeaveWanted&) {
  auto left = while_here([this] { session_.answer_leave(rr::read_clocks()); });
  if (!service_) return left();
  if (!login_) return home_->remove(*this, std::move(left));
  home_->remove(*this);
  login_->close(std::move(left));  // and with it what its user has locked
}

// --- wires ---

void SharedClient::handle(const rr::WireConnected& connected) {
  if (!service_) return;
  wires_.insert_or_assign({connected.path, connected.member->name}, connected.member);
  home_->join_wire(*this, connected.path, *connected.member);
}

void SharedClient::handle(const rr::WireDisconnected& disconnected) {
  wires_.erase({disconnected.path, disconnected.member->name});
  if (home_) home_->leave_wire(*this, disconnected.path, *disconnected.member);
}

void SharedClient::handle(const rr::WireReceived& received) {
  if (!home_) return;
  // The newest wins: one that can't be sent is replaced. The protocol has no answer to one that may not be sent.
  const auto sent = home_->send_wire(*this, path_of(*received.object), *received.member, received.value);
  if (!sent && sent.error().code == rr::ErrorCode::object_locked_error && !std::exchange(was_refused_, true))
    log(LogLevel::info, "values of a wire are not passed on: " + sent.error().message, {{"peer", peer()}});
}

void SharedClient::receive_wire(rr::WirePacket& packet, rr::Now now) {
  rr::LentMessage lent;
  (void)session_.send_wire(packet, now, &lent);  // a lost connection is heard of by itself
  settle(lent, now);
}

void SharedClient::answer_wire(const std::string& path, const rr::MemberDefinition& wire, const rr::Result<>& result) {
  if (!result) wires_.erase({path, wire.name});
  session_.answer_wire(path, wire, result, rr::read_clocks());
  settle();
}

void SharedClient::note_conflated(const std::string& path, const rr::MemberDefinition& wire, std::uint64_t count) {
  session_.note_conflated(path, wire, count);
}

void SharedClient::close_wire(const std::string& path, const rr::MemberDefinition& wire) {
  wires_.erase({path, wire.name});
  session_.close_wire(path, wire, rr::read_clocks());
  settle();
}

// --- pipes ---

void SharedClient::handle(const rr::PipeConnected& connected) {
  if (!service_) return;
  const auto path = path_of(*connected.object);
  pipes_[connected.id] = {path, connected.member};
  home_->join_pipe(*this, connected.id, path, *connected.member);
}

void SharedClient::handle(const rr::PipeReceived& received) {
  if (home_) (void)home_->send_pipe(*this, received.id, received.value, received.wants_ack);
}

void SharedClient::handle(const rr::PipeClosed& closed) {
  pipes_.erase(closed.id);
  if (home_) home_->leave_pipe(*this, closed.id);
}

void SharedClient::accept_pipe(rr::PipeId id) {
  session_.accept_pipe(id, rr::read_clocks());
  settle();
}

void SharedClient::refuse_pipe(rr::PipeId id, const rr::Error& error) {
  pipes_.erase(id);
  session_.refuse_pipe(id, error, rr::read_clocks());
  settle();
}

void SharedClient::receive_packet(rr::PipeId id, rr::SharedPipePacket& packet, rr::Now now) {
  rr::LentMessage lent;
  const auto sent = session_.send_pipe_packet(id, packet, now, &lent);
  if (!sent && sent.error().code == rr::ErrorCode::out_of_system_resource) return end_too_slow(sent.error());
  settle(lent, now);
  if (is_behind_ || is_closed() || session_.queued_bytes() <= much_waiting()) return;
  is_behind_ = true;
  home_->pace(*this);
  if (std::exchange(was_behind_, true)) return;
  log(LogLevel::info, "client reads slowly: the device is held back on its pipes, as far as it minds credit",
      {{"peer", peer()}, {"waiting_bytes", session_.queued_bytes()}});
}

void SharedClient::has_written() {
  if (!is_behind_ || session_.queued_bytes() > much_waiting() / 2) return;
  is_behind_ = false;
  const std::weak_ptr<StreamDriver> weak = weak_from_this();
  post([this, weak] {
    const auto self = weak.lock();
    if (self && service_ && !is_behind_) home_->pace(*this);
  });
}

/// What waits for the client, and of what it sends, is drawn from the account. A client for whom nothing is left there
/// goes.
void SharedClient::has_settled() {
  const auto held = session_.held_bytes();
  const auto counted = held < uncounted_bytes ? 0 : held;
  if (memory_.resize(counted)) return;
  memory_.hold(counted);
  end_too_slow(rr::make_error(rr::ErrorCode::out_of_system_resource,
                              "the gateway has no memory left, and " + std::to_string(held) + " bytes wait"));
}

void SharedClient::acknowledge_packets(rr::PipeId id, std::span<const std::uint32_t> numbers) {
  session_.acknowledge_pipe(id, numbers, rr::read_clocks());
  settle();
}

void SharedClient::close_pipe(rr::PipeId id) {
  pipes_.erase(id);
  session_.close_pipe(id, rr::read_clocks());
  settle();
}

/// A packet that does not fit would be lost without anybody knowing: the client goes, and knows.
void SharedClient::end_too_slow(const rr::Error& error) {
  if (!end_reason_.empty()) return;
  end_soon("client too slow: " + error.message);
  log(LogLevel::warning, "client closed", {{"peer", peer()}, {"reason", end_reason_}});
}

/// Its own clients hear of an outage by the end of this session. Others keep theirs until the device is back.
void SharedClient::connection_lost(const rr::Error& error) {
  if (is_gateway() && end_reason_.empty()) end_soon(error.message);
}

void SharedClient::end_soon(std::string reason) {
  end_reason_ = std::move(reason);
  // Not here: whoever sends goes through a list of clients.
  post([this, self = shared_from_this()] {
    close_service();
    close(rr::make_error(rr::ErrorCode::connection_error, end_reason_));
  });
}

// --- events, callbacks ---

void SharedClient::receive_event(rr::EventPacket& packet, rr::Now now) {
  rr::LentMessage lent;
  (void)session_.send_event(packet, now, &lent);  // a lost connection is heard of by itself
  settle(lent, now);
}

void SharedClient::release_path(const std::string& path) {
  std::erase_if(wires_, [&](const auto& wire) { return rr::is_within(wire.first.first, path); });
  std::erase_if(pipes_, [&](const auto& pipe) { return rr::is_within(pipe.second.path, path); });
  session_.release_path(path, rr::read_clocks());
  settle();
}

void SharedClient::call_callback(const std::string& path, const rr::MemberDefinition& callback,
                                 std::span<const rr::Value> arguments, rr::ClientConnection::CallbackReply answer) {
  // The session keeps the definition until the answer: it must be that of the service, which outlives the device's.
  const auto found =
      session_.service() ? session_.service()->find_object(path) : rr::make_error(rr::ErrorCode::service_error, "");
  const auto* member = found ? found->type->find_member(callback.name) : nullptr;
  if (!member) return answer(rr::make_error(rr::ErrorCode::service_error, "Stub not found"));
  const auto called = session_.call_callback(path, *member, arguments, rr::read_clocks());
  if (!called) return answer(called.error());
  callbacks_.emplace(*called, std::move(answer));
  settle();
}

void SharedClient::handle(const rr::CallbackCompleted& completed) {
  const auto found = callbacks_.extract(completed.id);
  if (found) found.mapped()(completed.result);
}

// --- locks ---

rr::Result<> SharedClient::admit_lock(const rr::LockWanted& wanted) {
  const bool gives_back = wanted.command == rr::LockCommand::unlock ||
                          wanted.command == rr::LockCommand::exit_monitor ||
                          wanted.command == rr::LockCommand::release_lease;
  if (!rights_ || (gives_back && home_->has_lock(*this, wanted.path))) return {};
  const bool is_renewal = wanted.command == rr::LockCommand::renew_lease;
  return rights_->admit_lock(wanted.path, session_.user(), is_renewal ? Recorded::never : Recorded::each_time);
}

bool SharedClient::may_lock(const std::string& path) const {
  return !rights_ || rights_->admit_lock(path, session_.user(), Recorded::never).has_value();
}

bool SharedClient::has_role(std::string_view role) const {
  return rights_ && rights_->has_role(role, session_.user());
}

bool SharedClient::may_command(const std::string& path) const {
  return !rights_ || rights_->may_command(path, session_.user());
}

void SharedClient::begin_lock(const rr::LockWanted& wanted, std::function<void(const rr::Result<>&)> done) {
  const bool is_recorded =
      wanted.command != rr::LockCommand::renew_lease && wanted.command != rr::LockCommand::release_lease;
  const auto entry = rights_ && is_recorded ? rights_->begin_lock(wanted, session_.user()) : nullptr;
  home_->lock(*this, wanted, [entry, done = std::move(done)](const rr::Result<>& result) {
    if (entry) entry->finish(result);
    done(result);
  });
}

void SharedClient::ask_for_lease(rr::LockCommand command, const std::string& path, std::chrono::milliseconds deadman,
                                 std::function<void(const rr::Result<>&)> done) {
  if (!service_ || !rr::is_within(path, service_->name()))
    return done(rr::make_error(rr::ErrorCode::object_not_found, "the session has no object " + rr::quote(path)));
  rr::LockWanted wanted;
  wanted.command = command;
  wanted.path = path;
  wanted.timeout = deadman;
  if (const auto admitted = admit_lock(wanted); !admitted) return done(admitted);
  begin_lock(wanted, std::move(done));
}

AuditEntryPtr SharedClient::begin_lease_end(const std::string& path) const {
  if (!rights_) return nullptr;
  rr::LockWanted end;
  end.command = rr::LockCommand::release_lease;
  end.path = path;
  return rights_->begin_lock(end, session_.user());
}

void SharedClient::handle(const rr::LockWanted& wanted) {
  if (!service_) return;
  if (const auto admitted = admit_lock(wanted); !admitted)
    return session_.answer_lock(wanted.id, admitted, rr::read_clocks());
  begin_lock(wanted, while_here([this, id = wanted.id](const rr::Result<>& result) {
               session_.answer_lock(id, result, rr::read_clocks());
             }));
}

}  // namespace rrgate
