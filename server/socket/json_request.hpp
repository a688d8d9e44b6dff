// A message of a JSON WebSocket's client, and the forms of what it gets. Layer: server/socket. See docs/http-api.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/json/json.hpp"

namespace rrgate {

/// {"id": ..., "op": ..., ...}: what somebody asks for.
class JsonRequest {
 public:
  /// Errors   data_serialization_error: no JSON; invalid_argument: no object, or its id is none.
  static rr::Result<JsonRequest> from_text(std::string_view message);

  /// The same of what is read already.
  static rr::Result<JsonRequest> from_json(rr::Json message);

  /// As JSON; "null" without one.
  const std::string& id() const { return id_; }
  /// Its text was longer than large_json_bytes: to read it on, or to free it, is for a worker.
  bool is_large() const { return is_large_; }
  /// Null where it is not there.
  const rr::Json* find(std::string_view name) const;

  // Throw   rr::Exception, invalid_argument: it is not there, or something else.
  const rr::Json& at(std::string_view name) const;
  std::string text(std::string_view name, std::string otherwise) const;
  /// A number a dimension; nullopt where it is not there.
  std::optional<std::vector<std::uint64_t>> numbers(std::string_view name, std::size_t count) const;

 private:
  explicit JsonRequest(rr::Json message) : message_(std::move(message)) {}

  rr::Json message_;
  std::string id_ = "null";
  bool is_large_ = false;
};

// Texts of messages to the client. `id` is that of a request; `retry_after` the seconds until it may be asked again.
std::string json_answer(const std::string& id, const rr::OrderedJson& result);
std::string json_refusal(const std::string& id, const rr::Error& error, std::optional<int> retry_after = {});

}  // namespace rrgate
