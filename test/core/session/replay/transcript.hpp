// Sessions between a client and a service of the reference, as they were recorded. Source: test/golden/transcripts.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/session/capabilities.hpp"
#include "core/support/time.hpp"
#include "core/wire/message.hpp"

namespace rr::test {

/// One message of one connection.
struct Step {
  bool is_clients = false;
  int connection = 0;
  std::chrono::microseconds time{0};  ///< since the first byte
  std::string text;                   ///< one line that says what it is
  Bytes bytes;
  std::unique_ptr<Message> message;  ///< decoded; borrows from `bytes`

  const MessageEntry& entry() const { return message->entries.front(); }
};

struct Transcript {
  std::string name;
  std::vector<Step> steps;

  /// What the client offered, and what the service agreed to, in their first messages.
  Features client_features() const;
  Features service_features() const;
  /// Of the URLs that the service index tells; empty if it was not asked.
  std::string base_url() const;
  /// The periods that the two sides were set to.
  std::chrono::milliseconds service_heartbeat_period() const;
  std::chrono::milliseconds client_heartbeat_period() const;
  /// Whether the recorded node had a service: where its index was asked, only those that it lists.
  bool has_service(std::string_view service) const;
  /// The first endpoint that this side's messages on a connection name; 0 if there is none.
  std::uint32_t endpoint(int connection, bool of_client) const;
};

/// The messages of test/golden/transcripts/NAME.json; WebSocket frames are joined, HTTP headers left out.
Transcript read_transcript(const std::string& name);

/// Names of all transcripts that hold messages, in order.
std::vector<std::string> transcript_names();

/// The definition behind the transcripts, in the canonical form that the reference sends.
std::string transcript_definition();

/// Ids that two sides draw at random; exchanged before messages are compared or delivered.
struct Renaming {
  std::map<std::uint32_t, std::uint32_t> endpoints;
  std::map<std::uint32_t, std::uint32_t> requests;
  std::map<std::int32_t, std::int32_t> generators;

  Renaming reversed() const;
  /// Whether apply() changes anything in the message.
  bool concerns(const Message& message) const;
  void apply(Message& message) const;
};

/// Makes the texts of errors empty: those that a node makes itself are its own.
void wipe_error_texts(Message& message);

/// Empty if both say the same but for what is free: ids of messages and nodes, the times of packets, and what void
/// functions return. Both are changed: what is free is wiped.
std::string compare(Message& found, Message& expected);

}  // namespace rr::test
