#include "server/http/endpoints/members.hpp"

#include <algorithm>
#include <charconv>

#include "core/support/whole_number.hpp"
#include "core/types/multidim.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/member_values.hpp"

namespace rrgate {

namespace {

/// A value of the member: as an image, where that is wanted and it is one, or as JSON. Throws   rr::Exception.
rr::awaitable<Response> value_response(const ObjectRequest& request, const Target& target, const rr::Value& value) {
  const auto& type = target.member->type;
  const auto wanted = request.wanted_image();
  if (wanted.empty() || !is_image_type(type, target.types())) co_return co_await request.value_response(target, value);
  const auto work = value_or_throw(prepare_image(value, type, target.types(), wanted));
  auto room = request.writer().memory().sibling();
  if (!room.resize(3 * work.data.bytes().size()))  // the rows, and what becomes of them
    co_return refuse_for_memory(&request.gateway().metrics());
  const auto encode = [&work] { return encode_image(work); };
  auto bytes = value_or_throw(co_await request.gateway().workers().run(encode));
  auto response = text_response(200, wanted, std::move(bytes));
  response.set("Cache-Control", "no-store");
  co_return response;
}

rr::awaitable<rr::Value> body_value(const ObjectRequest& request, const Target& target) {
  const auto make = [&](const rr::Json& body) {
    return rr::value_from_json(body, target.member->type, target.types(), request.form(), target.member->name);
  };
  co_return value_or_throw(co_await request.from_body(is_apart(target.member->type), make));
}

/// What If-Match and If-None-Match say of a value, which is always there and has no ETag: asked where the request would
/// replace it otherwise. Source: RFC 9110, section 13.1.
std::optional<Response> precondition_failed(const Request& request) {
  const auto wanted = request.list(http::field::if_match);
  if ((wanted.empty() || wanted == "*") && request.list(http::field::if_none_match) != "*") return std::nullopt;
  return problem_response(412, "the value is there, and has no ETag that If-Match could name");
}

/// A property, or a wire as a value: the newest in, the newest out.
rr::awaitable<Response> answer_value(const ObjectRequest& request, const Target& target, rr::CallKind read,
                                     rr::CallKind write) {
  const auto direction = target.member->direction();
  const bool can_read = direction != rr::MemberDirection::writeonly;
  const bool can_write = direction != rr::MemberDirection::readonly;
  if (request.is_read() && can_read) {
    const auto value = co_await target.ask(read);
    co_return co_await value_response(request, target, value);
  }
  if (request.method() == http::verb::put && can_write) {
    if (auto failed = precondition_failed(request.request())) co_return std::move(*failed);
    auto value = co_await body_value(request, target);
    co_await target.ask(write, std::move(value));
    co_return request.written_response();
  }
  co_return request.method_response(!can_write ? "GET, HEAD" : !can_read ? "PUT" : "GET, HEAD, PUT");
}

rr::awaitable<Response> answer_function(const ObjectRequest& request, const Target& target) {
  const auto& member = *target.member;
  if (request.method() != http::verb::post) co_return request.method_response("POST");
  auto arguments = value_or_throw(co_await read_arguments(request, member, target.types()));
  auto called = target.request(rr::CallKind::function);
  called.arguments = std::move(arguments);
  const auto value = co_await target.client->ask(std::move(called));
  if (!request.wanted_image().empty() && is_image_type(member.type, target.types()))
    co_return co_await value_response(request, target, value);
  co_return co_await request.value_response(target, value, "result");
}

// --- memories ---

/// "1,2,3"; nothing where the option is not there.
std::optional<Shape> read_shape(const ObjectRequest& request, std::string_view name, std::size_t dimensions) {
  const auto text = request.option(name);
  if (!text) return std::nullopt;
  Shape out;
  const char* at = text->data();
  const char* end = at + text->size();
  for (;;) {
    std::uint64_t number = 0;
    const auto read = std::from_chars(at, end, number);
    if (read.ec != std::errc() || (read.ptr != end && *read.ptr != ',')) break;
    out.push_back(number);
    if (read.ptr == end) {
      if (out.size() != dimensions) break;
      return out;
    }
    at = read.ptr + 1;
  }
  refuse(rr::ErrorCode::invalid_argument, std::string(name) + " is " + rr::quote(*text) + ", expected " +
                                              std::to_string(dimensions) + " whole numbers, separated by commas");
}

rr::ByteSpan payload_of(const rr::Value& items) {
  if (const auto* array = items.get_if<rr::Array>()) return array->bytes();
  if (const auto* array = items.get_if<rr::MultiDimArray>()) return array->array.bytes();
  if (const auto* named = items.get_if<rr::NamedArray>()) return named->array.bytes();
  refuse(rr::ErrorCode::invalid_argument, "items of this memory have no plain bytes; ask for application/json");
}

/// Bytes [first, last] of a whole of `size`, as the Range header asks for; nullopt: none asked for, or another unit.
struct ByteRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
};
std::optional<ByteRange> read_range(std::string_view header, std::uint64_t size, bool& is_unsatisfiable) {
  constexpr std::string_view unit = "bytes=";
  if (header.substr(0, unit.size()) != unit || header.find(',') != std::string_view::npos || size == 0)
    return std::nullopt;
  header.remove_prefix(unit.size());
  const auto dash = header.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const auto first = rr::whole_number<std::uint64_t>(header.substr(0, dash));
  const auto last = rr::whole_number<std::uint64_t>(header.substr(dash + 1));
  ByteRange out;
  if (first && (last || dash + 1 == header.size())) {
    out = {*first, std::min(last.value_or(size - 1), size - 1)};
  } else if (dash == 0 && last) {
    out = {size - std::min(*last, size), size - 1};
  } else {
    return std::nullopt;
  }
  is_unsatisfiable = out.first > out.last;
  return out;
}

/// Bytes of a one-dimensional memory of numbers, as far as they are asked for.
rr::awaitable<Response> answer_memory_bytes(const ObjectRequest& request, const Target& target, std::uint64_t length,
                                            std::size_t item_bytes) {
  const auto size = length * item_bytes;
  bool is_unsatisfiable = false;
  // RFC 9110, sections 14.2 and 13.1.5: of GET alone, and values have nothing that If-Range could name.
  const bool takes_range =
      request.method() == http::verb::get && request.request().header(http::field::if_range).empty();
  const auto asked = takes_range ? request.request().header(http::field::range) : std::string_view();
  const auto range = read_range(asked, size, is_unsatisfiable);
  if (is_unsatisfiable) {
    auto response = problem_response(416, "the memory has " + std::to_string(size) + " bytes");
    response.set("Content-Range", "bytes */" + std::to_string(size));
    co_return response;
  }
  const ByteRange wanted = range.value_or(ByteRange{0, size == 0 ? 0 : size - 1});
  const auto first_item = wanted.first / item_bytes;
  const auto count = size == 0 ? 0 : wanted.last / item_bytes + 1 - first_item;
  if (count * item_bytes > max_memory_bytes)
    refuse(rr::ErrorCode::buffer_limit_violation, "that are " + std::to_string(count * item_bytes) +
                                                      " bytes; ask for at most " + std::to_string(max_memory_bytes) +
                                                      " with Range, by GET without If-Range");
  rr::Value items;
  if (count > 0) {
    auto part = target.request(rr::CallKind::memory_read);
    part.range.position = {first_item};
    part.range.count = {count};
    items = co_await target.client->ask(std::move(part));
  }
  const auto bytes = count > 0 ? payload_of(items) : rr::ByteSpan();
  const auto skipped = wanted.first - first_item * item_bytes;
  const auto length_wanted = size == 0 ? 0 : wanted.last + 1 - wanted.first;
  const auto part = rr::as_text(bytes).substr(skipped, length_wanted);
  auto response = text_response(range ? 206 : 200, "application/octet-stream", std::string(part));
  if (range)
    response.set("Content-Range", "bytes " + std::to_string(wanted.first) + "-" + std::to_string(wanted.last) + "/" +
                                      std::to_string(size));
  response.set("Accept-Ranges", "bytes").set("Cache-Control", "no-store");
  co_return response;
}

rr::awaitable<Response> answer_memory(const ObjectRequest& request, const Target& target) {
  const auto& member = *target.member;
  const auto direction = member.direction();
  const bool can_read = direction != rr::MemberDirection::writeonly;
  const bool can_write = direction != rr::MemberDirection::readonly && !target.is_shape;
  const auto allowed = !can_write ? "GET, HEAD" : !can_read ? "PUT" : "GET, HEAD, PUT";
  if (request.is_read() ? !can_read && !target.is_shape : request.method() != http::verb::put || !can_write)
    co_return request.method_response(allowed);
  if (auto failed = request.is_read() ? std::nullopt : precondition_failed(request.request()))
    co_return std::move(*failed);

  const auto shape = co_await memory_shape(target);
  if (target.is_shape) {
    co_return co_await request.value_response(rr::OrderedJson(shape));
  }

  const auto position = read_shape(request, "offset", shape.size());
  const auto count = read_shape(request, "count", shape.size());
  if (request.method() == http::verb::put) {
    rr::Value items;
    if (request.has_bytes_body()) {
      const auto& body = request.request().message.body();
      if (rr::is_multidim(member.type) || rr::item_size(member.type.type) == 0 ||
          body.size() % rr::item_size(member.type.type) != 0)
        refuse(rr::ErrorCode::invalid_argument,
               "plain bytes are for whole items of one-dimensional memories of numbers");
      items = rr::Array::copy(member.type.type, rr::as_bytes(body));
    } else {
      items = co_await body_value(request, target);
    }
    co_await write_items(target, shape, position, count, std::move(items));
    co_return request.written_response();
  }

  const bool is_flat = shape.size() == 1 && !rr::is_multidim(member.type);
  const bool is_whole = !position && !count;
  if (request.wanted() == BodyForm::bytes && is_whole && is_flat && item_bytes_of(target) > 0)
    co_return co_await answer_memory_bytes(request, target, shape[0], item_bytes_of(target));
  const auto items = co_await read_items(target, shape, position, count);
  if (request.wanted() == BodyForm::bytes) {
    const auto bytes = rr::as_text(payload_of(items));
    auto response = text_response(200, "application/octet-stream", std::string(bytes));
    response.set("Cache-Control", "no-store");
    co_return response;
  }
  co_return co_await request.value_response(target, items);
}

}  // namespace

rr::awaitable<rr::Result<std::vector<rr::Value>>> read_arguments(const ObjectRequest& request,
                                                                 const rr::MemberDefinition& member,
                                                                 const rr::TypeRegistry& types) {
  if (member.parameters.empty() && request.request().message.body().empty()) co_return std::vector<rr::Value>();
  const auto make = [&](const rr::Json& body) { return arguments_from_json(body, member, types, request.form()); };
  co_return co_await request.from_body(is_apart(member.parameters), make);
}

rr::awaitable<void> answer_member(const ObjectRequest& request, const Target& target) {
  // RFC 9110, section 14.4: what would write the part over the whole.
  if (request.method() == http::verb::put && !request.request().header(http::field::content_range).empty())
    refuse(rr::ErrorCode::invalid_argument,
           "Content-Range is not for values; a part of a memory is written with ?offset=");
  Response response;
  switch (target.member->kind) {
    case rr::MemberKind::property:
      response = co_await answer_value(request, target, rr::CallKind::property_get, rr::CallKind::property_set);
      break;
    case rr::MemberKind::function:
      response = co_await answer_function(request, target);
      break;
    case rr::MemberKind::wire:
      response = co_await answer_value(request, target, rr::CallKind::peek_in, rr::CallKind::poke_out);
      break;
    case rr::MemberKind::memory:
      response = co_await answer_memory(request, target);
      break;
    case rr::MemberKind::event:
    case rr::MemberKind::pipe:
      if (target.member->direction() == rr::MemberDirection::writeonly) {
        response = problem_response(501, "the pipe can only be sent to, which HTTP can't; use a WebSocket");
        break;
      }
      if (!request.is_read()) {
        const bool takes_packets =
            target.member->kind == rr::MemberKind::pipe && target.member->direction() != rr::MemberDirection::readonly;
        response = takes_packets
                       ? problem_response(501, "HTTP can only receive from a pipe; use a WebSocket to send to it")
                       : request.method_response("GET, HEAD");
        break;
      }
      response =
          problem_response(406, std::string(target.member->kind == rr::MemberKind::pipe ? "a pipe" : "an event") +
                                    " comes as a stream: ask for it with Accept: text/event-stream");
      break;
    default:
      response = problem_response(501, "a " + std::string(member_kind_name(target.member->kind)) +
                                           " asks the client, which HTTP can't; use a WebSocket");
  }
  co_await request.writer().send(response);
}

}  // namespace rrgate
