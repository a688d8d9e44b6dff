#include "test/server/support/fake_device.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/use_future.hpp>
#include <boost/asio/write.hpp>
#include <cstring>

#include "core/wire/codec.hpp"

namespace rrgate::test {

namespace asio = boost::asio;
using asio::ip::tcp;

namespace {

using Socket = std::shared_ptr<tcp::socket>;
using StatePointer = std::shared_ptr<FakeDevice::State>;

constexpr auto await_tuple = asio::as_tuple(asio::use_awaitable);

rr::Bytes encoded(const rr::Message& message) {
  rr::EncodedMessage out;
  if (!rr::encode(message, {}, out)) std::abort();
  return out.to_bytes();
}

rr::Bytes answer_greeting(const FakeDevice::State& state, const rr::Message& request) {
  rr::Message reply;
  reply.header.version = 2;
  reply.header.sender_node_id = state.node_id;
  reply.header.sender_node_name = state.node_name;
  reply.header.receiver_node_id = request.header.sender_node_id;
  reply.begin_entry(rr::EntryType::stream_op_ret, "", "CreateConnection");
  const std::uint32_t capabilities[] = {0x02000003};
  reply.add("capabilities", rr::DataType::uint32_t, 1,
            rr::ByteSpan(reinterpret_cast<const std::uint8_t*>(capabilities), sizeof(capabilities)));
  return encoded(reply);
}

/// A device without a service index refuses it.
rr::Bytes refuse_service(const FakeDevice::State& state, const rr::Message& request) {
  rr::Message reply;
  reply.header.version = 2;
  reply.header.sender_node_id = state.node_id;
  reply.header.receiver_node_id = request.header.sender_node_id;
  reply.header.receiver_endpoint = request.header.sender_endpoint;
  const auto& entry = request.entries[0];
  reply.begin_entry(rr::reply_type(entry.type), entry.service_path, "", entry.request_id).error =
      rr::ErrorCode::service_not_found;
  reply.add_text("errorname", "RobotRaconteur.ServiceNotFound");
  reply.add_text("errorstring", "Service not found");
  return encoded(reply);
}

asio::awaitable<void> flood(Socket socket, StatePointer state) {
  const auto message = make_message("data", 100'000);
  for (;;) {
    auto [error, size] = co_await asio::async_write(*socket, asio::buffer(message), await_tuple);
    state->flooded += size;
    if (error) co_return;
  }
}

asio::awaitable<void> serve(Socket socket, StatePointer state) {
  rr::Bytes bytes;
  for (;;) {
    bytes.resize(10);
    auto [header_error, unused] = co_await asio::async_read(*socket, asio::buffer(bytes), await_tuple);
    if (header_error) co_return;
    bytes.resize(rr::load<std::uint32_t>(bytes.data() + 4));
    auto [error, unused2] =
        co_await asio::async_read(*socket, asio::buffer(bytes.data() + 10, bytes.size() - 10), await_tuple);
    if (error) co_return;
    rr::Message request;
    if (!rr::decode(bytes, {}, request) || request.entries.empty()) co_return;
    const auto member = request.entries[0].member_name;
    rr::Bytes answer = bytes;
    if (member == "CreateConnection") answer = answer_greeting(*state, request);
    if (request.entries[0].type == rr::EntryType::connect_client_combined) answer = refuse_service(*state, request);
    if (member == "bye") co_return;
    if (member == "flood") co_await flood(socket, state);
    if (member == "huge") {
      const std::uint32_t size = 200'000'000;
      std::memcpy(answer.data() + 4, &size, 4);
    }
    auto [write_error, unused3] = co_await asio::async_write(*socket, asio::buffer(answer), await_tuple);
    if (write_error) co_return;
  }
}

asio::awaitable<void> accept_all(std::shared_ptr<tcp::acceptor> acceptor, StatePointer state) {
  for (;;) {
    auto [error, accepted] = co_await acceptor->async_accept(await_tuple);
    if (error) co_return;
    auto socket = std::make_shared<tcp::socket>(std::move(accepted));
    state->sockets.push_back(socket);
    asio::co_spawn(acceptor->get_executor(), serve(socket, state), asio::detached);
  }
}

}  // namespace

rr::Bytes make_message(std::string_view member, std::size_t payload, const rr::NodeId& receiver,
                       std::string_view receiver_name) {
  rr::Bytes content(payload);
  for (std::size_t i = 0; i < payload; ++i) content[i] = static_cast<std::uint8_t>(i * 31 + i / 251);
  rr::Message message;
  message.header.version = 2;
  message.header.receiver_node_id = receiver;
  message.header.receiver_node_name = receiver_name;
  message.begin_entry(rr::EntryType::stream_op, "", member);
  message.add("content", rr::DataType::uint8_t, static_cast<std::uint32_t>(payload), content);
  rr::EncodedMessage out;
  rr::EncodeOptions options;
  options.max_message_size = 100'000'000;
  if (!rr::encode(message, options, out)) std::abort();
  return out.to_bytes();
}

rr::Bytes make_greeting(const rr::NodeId& receiver, std::string_view receiver_name) {
  return make_message("CreateConnection", 0, receiver, receiver_name);
}

FakeDevice::FakeDevice(asio::io_context& io, std::string node_name, std::uint16_t port)
    : io_(io),
      state_(std::make_shared<State>()),
      acceptor_(std::make_shared<tcp::acceptor>(io, tcp::endpoint(asio::ip::make_address("127.0.0.1"), port))),
      port_(acceptor_->local_endpoint().port()) {
  state_->node_name = std::move(node_name);
  for (std::size_t i = 0; i < 16; ++i)  // the whole port: two devices of a test never share an id
    state_->node_id.bytes[i] = static_cast<std::uint8_t>(i + (i % 2 ? port_ >> 8 : port_));
  asio::co_spawn(io_, accept_all(acceptor_, state_), asio::detached);
}

FakeDevice::~FakeDevice() {
  const auto close = [this] {
    acceptor_->close();
    for (const auto& weak : state_->sockets)
      if (const auto socket = weak.lock()) socket->close();
  };
  asio::post(io_, asio::use_future(close)).wait();
}

}  // namespace rrgate::test
