#include "server/socket/json_request.hpp"

#include <algorithm>

#include "server/http/endpoints/large_json.hpp"
#include "server/http/endpoints/refusal.hpp"
#include "server/json/value_to_json.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_id_bytes = 64;

bool is_id(const rr::Json& json) {
  return json.is_number_integer() || (json.is_string() && json.get_ref<const std::string&>().size() <= max_id_bytes);
}

}  // namespace

rr::Result<JsonRequest> JsonRequest::from_text(std::string_view message) {
  auto json = rr::read_json(message);
  if (!json) return json.error();
  auto request = from_json(std::move(*json));
  if (request) request->is_large_ = message.size() > large_json_bytes;
  return request;
}

rr::Result<JsonRequest> JsonRequest::from_json(rr::Json message) {
  const auto refused = [](std::string why) { return rr::make_error(rr::ErrorCode::invalid_argument, std::move(why)); };
  if (!message.is_object()) return refused("a message is an object {\"id\": ..., \"op\": ...}");
  JsonRequest request(std::move(message));
  const auto* id = request.find("id");
  if (!id || id->is_null()) return request;
  if (!is_id(*id))
    return refused("\"id\" is a whole number, or a string of at most " + std::to_string(max_id_bytes) + " bytes");
  request.id_ = id->dump();
  return request;
}

const rr::Json* JsonRequest::find(std::string_view name) const {
  const auto found = message_.find(name);
  return found == message_.end() ? nullptr : &*found;
}

const rr::Json& JsonRequest::at(std::string_view name) const {
  const auto* found = find(name);
  if (!found) refuse(rr::ErrorCode::invalid_argument, "\"" + std::string(name) + "\" is missing");
  return *found;
}

std::string JsonRequest::text(std::string_view name, std::string otherwise) const {
  const auto* found = find(name);
  if (!found) return otherwise;
  if (!found->is_string()) refuse(rr::ErrorCode::invalid_argument, "\"" + std::string(name) + "\" is not a string");
  return found->get<std::string>();
}

std::optional<std::vector<std::uint64_t>> JsonRequest::numbers(std::string_view name, std::size_t count) const {
  const auto* found = find(name);
  if (!found) return std::nullopt;
  const auto is_number = [](const rr::Json& item) { return item.is_number_unsigned(); };
  if (!found->is_array() || found->size() != count || !std::all_of(found->begin(), found->end(), is_number))
    refuse(rr::ErrorCode::invalid_argument,
           "\"" + std::string(name) + "\" is not an array of " + std::to_string(count) + " whole numbers");
  return found->get<std::vector<std::uint64_t>>();
}

std::string json_answer(const std::string& id, const rr::OrderedJson& result) {
  return "{\"id\":" + id + ",\"result\":" + rr::write_json(result) + "}";
}

std::string json_refusal(const std::string& id, const rr::Error& error, std::optional<int> retry_after) {
  static const rr::TypeRegistry no_types;
  auto told = rr::error_to_json(error, no_types);
  if (retry_after) rr::add_key(told["error"], "retry_after") = *retry_after;
  return "{\"id\":" + id + "," + rr::write_json(told).substr(1);
}

}  // namespace rrgate
