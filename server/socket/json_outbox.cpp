#include "server/socket/json_outbox.hpp"

namespace rrgate {

namespace {

/// What may wait for a slow reader before it is told and closed; one message alone may be larger.
constexpr std::size_t max_outbox_bytes = 4u * 1024 * 1024;
constexpr std::size_t max_waiting_messages = 100'000;
/// About as much goes out in one write.
constexpr std::size_t write_bytes = 64u * 1024;

}  // namespace

void JsonOutbox::add(std::string text) {
  if (is_closed_) return;
  const auto bytes = bytes_ + text.size();
  const bool is_full =
      bytes > max_outbox_bytes || waiting_.size() >= max_waiting_messages || !memory_.resize(in_flight_ + bytes);
  if (is_full && !waiting_.empty()) {
    waiting_.clear();
    newest_.clear();
    has_overflown_ = is_closed_ = true;
    text = R"({"error":{"name":"RobotRaconteur.OutOfSystemResource",)"
           R"("message":"too slow: messages were lost, so the connection ends"}})";
    bytes_ = 0;
  }
  bytes_ += text.size();
  memory_.hold(in_flight_ + bytes_);
  waiting_.push_back({std::move(text), {}});
  news_.cancel();
}

void JsonOutbox::add_newest(const std::string& name, std::function<std::string()> text) {
  if (is_closed_) return;
  const auto [place, is_new] = newest_.insert_or_assign(name, std::move(text));
  if (!is_new) return;
  waiting_.push_back({{}, name});
  news_.cancel();
}

void JsonOutbox::close() {
  is_closed_ = true;
  waiting_.clear();
  newest_.clear();
  bytes_ = 0;
  memory_.hold(in_flight_);
  news_.cancel();
}

std::vector<std::string> JsonOutbox::take() {
  std::vector<std::string> out;
  std::size_t taken = 0;
  while (!waiting_.empty() && taken < write_bytes) {
    auto entry = std::move(waiting_.front());
    waiting_.pop_front();
    if (entry.name.empty()) {
      bytes_ -= entry.text.size();
      out.push_back(std::move(entry.text));
    } else {
      const auto found = newest_.extract(entry.name);
      out.push_back(found.mapped()());
    }
    taken += out.back().size();
  }
  in_flight_ = taken;
  memory_.hold(in_flight_ + bytes_);
  return out;
}

void JsonOutbox::note_sent() {
  in_flight_ = 0;
  memory_.hold(bytes_);
}

}  // namespace rrgate
