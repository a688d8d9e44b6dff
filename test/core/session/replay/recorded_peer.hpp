// One session under replay: what it has sent, with the ids of the record put in for its own.
#pragma once

#include <algorithm>
#include <deque>
#include <memory>

#include "core/wire/codec.hpp"
#include "test/core/session/replay/transcript.hpp"

namespace rr::test {

template <class Session>
struct RecordedPeer {
  std::unique_ptr<Session> session;
  Renaming to_recorded;
  std::deque<std::unique_ptr<Message>> sent;  ///< not compared yet
  int heartbeats_sent = 0;
  int heartbeats_expected = 0;

  /// The bytes of a recorded message of the other side, with this session's own ids.
  Bytes for_session(Step& step) const {
    const auto to_own = to_recorded.reversed();
    if (!to_own.concerns(*step.message)) return step.bytes;
    to_own.apply(*step.message);
    EncodedMessage encoded;
    encode(*step.message, {}, encoded).value();
    to_recorded.apply(*step.message);
    return encoded.to_bytes();
  }

  /// Takes what the session has to send. When heartbeats come, and whether once or twice, is free: they are counted.
  void collect(Now now) {
    Bytes bytes;
    for (const auto slice : session->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    session->handle_transmitted(bytes.size(), now);
    const DecodeOptions options{session->connection().features().string_table};
    for (std::size_t at = 0; at < bytes.size();) {
      const auto size = load<std::uint32_t>(bytes.data() + at + 4);
      sent_bytes_.emplace_back(bytes.begin() + at, bytes.begin() + at + size);
      sent.push_back(std::make_unique<Message>());
      decode(sent_bytes_.back(), options, *sent.back()).value();
      at += size;
      if (sent.back()->entries.front().type != EntryType::connection_test) continue;
      sent.pop_back();
      ++heartbeats_sent;
    }
  }

  /// The first message with an entry like this one, or sent.end(). Request ids are compared where they are the peer's.
  std::deque<std::unique_ptr<Message>>::iterator find_sent(const MessageEntry& like, bool by_request_id) {
    return std::find_if(sent.begin(), sent.end(), [&](const auto& message) {
      const auto& entry = message->entries.front();
      return entry.type == like.type && entry.service_path == like.service_path &&
             entry.member_name == like.member_name && (!by_request_id || entry.request_id == like.request_id);
    });
  }

 private:
  std::deque<Bytes> sent_bytes_;  ///< that `sent` borrows from
};

}  // namespace rr::test
