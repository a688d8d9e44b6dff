// A blocking client for gateway tests: every wait has a limit, so that a hang is a failure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/support/bytes.hpp"

namespace rrgate::test {

class TestClient {
 public:
  explicit TestClient(std::uint16_t port, const std::string& host = "127.0.0.1");
  ~TestClient();
  TestClient(TestClient&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), pending_(std::move(other.pending_)) {}
  TestClient& operator=(TestClient&&) = delete;

  /// Returns false when the peer is gone.
  bool send(rr::ByteSpan bytes);
  bool send(std::string_view text) { return send(rr::as_bytes(text)); }
  /// Throws std::runtime_error when the connection ends or 10 s pass before `size` bytes are there.
  rr::Bytes receive(std::size_t size);
  /// Until and with the delimiter.
  std::string receive_until(std::string_view delimiter);
  /// Everything until the peer closes. Throws when that takes more than 10 s.
  std::string receive_all();
  void finish_sending();

  /// One Robot Raconteur message.
  rr::Bytes receive_message();
  /// An HTTP response: header block and body by Content-Length.
  struct HttpResponse {
    unsigned status = 0;
    std::string head;
    std::string body;
  };
  HttpResponse receive_response(bool has_body = true);

  /// Upgrades; returns the response. `headers` are whole lines with their line ends.
  HttpResponse upgrade(const std::string& target, const std::string& headers = {});
  /// One masked frame.
  bool send_frame(std::uint8_t opcode, rr::ByteSpan payload);
  struct Frame {
    std::uint8_t first = 0;
    rr::Bytes payload;
  };
  Frame receive_frame();
  /// Payload of binary frames until it holds `size` bytes. Throws at any other frame, an empty or a too long one.
  rr::Bytes receive_payload(std::size_t size);

 private:
  /// Bytes into pending_; 0 at the end.
  std::size_t fill();

  int socket_;
  std::string pending_;
};

}  // namespace rrgate::test
