#include "test/server/support/test_client.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace rrgate::test {

TestClient::TestClient(std::uint16_t port, const std::string& host)
    : socket_(::socket(host.find(':') == std::string::npos ? AF_INET : AF_INET6, SOCK_STREAM, 0)) {
  const timeval limit{10, 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
  int failed;
  if (host.find(':') == std::string::npos) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    ::inet_pton(AF_INET, host.c_str(), &address.sin_addr);
    failed = ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  } else {
    sockaddr_in6 address{};
    address.sin6_family = AF_INET6;
    address.sin6_port = htons(port);
    ::inet_pton(AF_INET6, host.c_str(), &address.sin6_addr);
    failed = ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  }
  if (failed) {
    ::close(socket_);
    throw std::runtime_error("connect: " + std::string(std::strerror(errno)));
  }
}

TestClient::~TestClient() {
  if (socket_ >= 0) ::close(socket_);
}

bool TestClient::send(rr::ByteSpan bytes) {
  while (!bytes.empty()) {
    const auto count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

std::size_t TestClient::fill() {
  char buffer[65536];
  const auto count = ::recv(socket_, buffer, sizeof(buffer), 0);
  if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) throw std::runtime_error("nothing came for 10 s");
  if (count <= 0) return 0;  // a reset is an end too
  pending_.append(buffer, static_cast<std::size_t>(count));
  return static_cast<std::size_t>(count);
}

rr::Bytes TestClient::receive(std::size_t size) {
  while (pending_.size() < size)
    if (fill() == 0) throw std::runtime_error("the connection ended");
  rr::Bytes out(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(size));
  pending_.erase(0, size);
  return out;
}

std::string TestClient::receive_until(std::string_view delimiter) {
  for (;;) {
    const auto found = pending_.find(delimiter);
    if (found != std::string::npos) {
      auto out = pending_.substr(0, found + delimiter.size());
      pending_.erase(0, out.size());
      return out;
    }
    if (fill() == 0) throw std::runtime_error("the connection ended");
  }
}

std::string TestClient::receive_all() {
  while (fill() != 0) continue;
  return std::exchange(pending_, {});
}

void TestClient::finish_sending() {
  ::shutdown(socket_, SHUT_WR);
}

rr::Bytes TestClient::receive_message() {
  auto out = receive(10);
  const auto rest = receive(rr::load<std::uint32_t>(out.data() + 4) - 10);
  out.insert(out.end(), rest.begin(), rest.end());
  return out;
}

TestClient::HttpResponse TestClient::receive_response(bool has_body) {
  HttpResponse out;
  out.head = receive_until("\r\n\r\n");
  out.status = static_cast<unsigned>(std::stoul(out.head.substr(9, 3)));
  const auto length = out.head.find("Content-Length: ");
  if (has_body && length != std::string::npos) {
    const auto body = receive(std::stoul(out.head.substr(length + 16)));
    out.body = std::string(body.begin(), body.end());
  }
  return out;
}

TestClient::HttpResponse TestClient::upgrade(const std::string& target, const std::string& headers) {
  send("GET " + target +
       " HTTP/1.1\r\nHost: localhost:8080\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
       "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n" +
       headers + "\r\n");
  return receive_response();
}

bool TestClient::send_frame(std::uint8_t opcode, rr::ByteSpan payload) {
  rr::Bytes out{static_cast<std::uint8_t>(0x80 | opcode)};
  if (payload.size() < 126) {
    out.push_back(static_cast<std::uint8_t>(0x80 | payload.size()));
  } else {
    out.push_back(0x80 | 127);
    for (int shift = 56; shift >= 0; shift -= 8)
      out.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(payload.size()) >> shift));
  }
  const std::uint8_t mask[] = {0xa1, 0x02, 0xff, 0x40};
  out.insert(out.end(), mask, mask + 4);
  for (std::size_t i = 0; i < payload.size(); ++i) out.push_back(static_cast<std::uint8_t>(payload[i] ^ mask[i % 4]));
  return send(out);
}

TestClient::Frame TestClient::receive_frame() {
  const auto start = receive(2);
  std::size_t size = start[1] & 0x7f;
  if ((start[1] & 0x80) != 0 || size == 127) throw std::runtime_error("a masked or a 64-bit frame");
  if (size == 126) {
    const auto length = receive(2);
    size = static_cast<std::size_t>(length[0] << 8 | length[1]);
  }
  return {start[0], receive(size)};
}

rr::Bytes TestClient::receive_payload(std::size_t size) {
  rr::Bytes out;
  while (out.size() < size) {
    const auto frame = receive_frame();
    if (frame.first != 0x82 || frame.payload.empty()) throw std::runtime_error("a frame that isn't data");
    out.insert(out.end(), frame.payload.begin(), frame.payload.end());
  }
  return out;
}

}  // namespace rrgate::test
