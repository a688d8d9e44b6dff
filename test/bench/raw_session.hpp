// The least that a client can be: a blocking socket and messages encoded beforehand. What a benchmark measures with it
// is the other side and the way there, not a client.
#pragma once

#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/wire/codec.hpp"
#include "core/wire/frame_scanner.hpp"

namespace rr::bench {

using boost::asio::ip::tcp;

inline tcp::socket connect_to(boost::asio::io_context& io, std::uint16_t port) {
  tcp::socket socket(io);
  socket.connect({boost::asio::ip::address_v4::loopback(), port});
  socket.set_option(tcp::no_delay(true));
  return socket;
}

/// A session in message version 4 without string table, with service "interop" of node "interop.service".
class RawSession {
 public:
  RawSession(boost::asio::io_context& io, std::uint16_t port) : socket_(connect_to(io, port)) {
    Message message;
    message.header = header(2);
    message.header.receiver_node_name = "interop.service";
    message.begin_entry(EntryType::stream_op, "", "CreateConnection");
    const std::array<std::uint32_t, 2> capabilities{0x0200'0003, 0x0400'0003};
    message.add("capabilities", DataType::uint32_t, 2, store(message, capabilities.data(), sizeof capabilities));
    round_trip(encoded(message));

    message.clear();
    message.header = header(4);
    message.begin_entry(EntryType::connect_client_combined, "interop", "", next_request_++);
    message.add_text("clientversion", "1.2.8");
    message.add_text("returnservicedefs", "false");
    round_trip(encoded(message));
    Message reply;
    decode_reply(reply);
    service_endpoint_ = reply.header.sender_endpoint;
    service_node_ = reply.header.sender_node_id;
  }

  /// A call of `function`, ready to be sent; a parameter of doubles, if one is named. Every call made of it has the
  /// same request id, which is right as long as they follow one another.
  Bytes make_call(std::string_view function, std::string_view parameter = {}, const std::vector<double>& items = {}) {
    Message message;
    message.header = header(4);
    message.begin_entry(EntryType::function_call_req, "interop", function, next_request_++);
    if (!parameter.empty())
      message.add(parameter, DataType::double_t, static_cast<std::uint32_t>(items.size()),
                  store(message, items.data(), items.size() * sizeof(double)));
    return encoded(message);
  }
  Bytes make_call(std::string_view function, std::string_view parameter, std::uint32_t number) {
    Message message;
    message.header = header(4);
    message.begin_entry(EntryType::function_call_req, "interop", function, next_request_++);
    message.add_scalar(parameter, DataType::uint32_t, number);
    return encoded(message);
  }

  /// Sends and waits for the next message. Returns its size in bytes.
  /// Throws   std::runtime_error: the reply is an error, or no message.
  std::size_t round_trip(ByteSpan request) {
    boost::asio::write(socket_, boost::asio::buffer(request.data(), request.size()));
    received_.clear();
    std::size_t expected = 10;
    while (received_.size() < expected) {
      const std::size_t before = received_.size();
      received_.resize(std::max(expected, before + 65536));
      const std::size_t count =
          socket_.read_some(boost::asio::buffer(received_.data() + before, received_.size() - before));
      received_.resize(before + count);
      if (expected == 10 && received_.size() >= 10) {
        expected = received_[4] | received_[5] << 8 | received_[6] << 16 | static_cast<std::size_t>(received_[7]) << 24;
      }
    }
    return received_.size();
  }

  /// The last reply, checked.
  void decode_reply(Message& reply) const {
    if (const auto decoded = decode(received_, {}, reply); !decoded) throw std::runtime_error(decoded.error().message);
    const auto& entry = reply.entries.at(0);
    if (entry.error == ErrorCode::none) return;
    const auto* text = reply.elements_of(entry).find("errorstring");
    throw std::runtime_error("the service answered: " + std::string(text ? text->text() : "an error"));
  }

 private:
  MessageHeader header(std::uint16_t version) const {
    MessageHeader result;
    result.version = version;
    result.sender_node_id.bytes[0] = 1;
    result.sender_endpoint = version == 2 ? 0 : 4711;
    result.receiver_node_id = service_node_;
    result.receiver_endpoint = service_endpoint_;
    return result;
  }
  static ByteSpan store(Message& message, const void* data, std::size_t size) {
    return message.store(ByteSpan(static_cast<const std::uint8_t*>(data), size));
  }
  static Bytes encoded(const Message& message) {
    EncodedMessage result;
    if (const auto done = encode(message, {}, result); !done) throw std::runtime_error(done.error().message);
    return result.to_bytes();
  }

  tcp::socket socket_;
  std::uint32_t next_request_ = 1;
  std::uint32_t service_endpoint_ = 0;
  NodeId service_node_;
  Bytes received_;
};

}  // namespace rr::bench
