#include "server/json/json.hpp"

#include <array>
#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/src.hpp>
#include <charconv>

#include "server/json/json_builder.hpp"

namespace rr {

namespace {

/// What boost::json::basic_parser calls. Numbers come with their digits: its own doubles are off by a bit at times.
struct TextHandler {  // NOLINT(bugprone-exception-escape): as JsonBuilder
  using error_code = boost::system::error_code;
  using string_view = boost::json::string_view;
  static constexpr std::size_t max_object_size = std::size_t(-1);
  static constexpr std::size_t max_array_size = std::size_t(-1);
  static constexpr std::size_t max_key_size = std::size_t(-1);
  static constexpr std::size_t max_string_size = std::size_t(-1);

  JsonBuilder builder;
  std::string part;

  bool done(bool ok, error_code& ec) {
    if (!ok) ec = boost::json::error::syntax;
    return ok;
  }
  std::string whole(string_view last) {
    std::string text = std::move(part);
    part.clear();
    return text.append(last.data(), last.size());
  }
  bool keep(string_view text) {
    part.append(text.data(), text.size());
    return true;
  }
  bool number(string_view last, error_code& ec) {
    const auto text = whole(last);
    const bool is_integer = text.find_first_of(".eE") == std::string::npos && text != "-0";
    const auto* end = text.data() + text.size();
    if (std::uint64_t value = 0; is_integer && std::from_chars(text.data(), end, value).ec == std::errc())
      return done(builder.add_value(value), ec);
    if (std::int64_t value = 0; is_integer && std::from_chars(text.data(), end, value).ec == std::errc())
      return done(builder.add_value(value), ec);
    double value = 0;
    // Out of range: too large, or so small that it is zero.
    if (std::from_chars(text.data(), end, value).ec == std::errc::result_out_of_range)
      value = std::strtod(text.c_str(), nullptr);
    return done(builder.add_number(value), ec);
  }

  bool on_document_begin(error_code&) { return true; }
  bool on_document_end(error_code&) { return true; }
  bool on_object_begin(error_code& ec) { return done(builder.begin(Json::object()), ec); }
  bool on_object_end(std::size_t, error_code&) { return builder.end(); }
  bool on_array_begin(error_code& ec) { return done(builder.begin(Json::array()), ec); }
  bool on_array_end(std::size_t, error_code&) { return builder.end(); }
  bool on_key_part(string_view text, std::size_t, error_code&) { return keep(text); }
  bool on_key(string_view text, std::size_t, error_code& ec) { return done(builder.set_key(whole(text)), ec); }
  bool on_string_part(string_view text, std::size_t, error_code&) { return keep(text); }
  bool on_string(string_view text, std::size_t, error_code& ec) { return done(builder.add_value(whole(text)), ec); }
  bool on_number_part(string_view text, error_code&) { return keep(text); }
  bool on_int64(std::int64_t, string_view text, error_code& ec) { return number(text, ec); }
  bool on_uint64(std::uint64_t, string_view text, error_code& ec) { return number(text, ec); }
  bool on_double(double, string_view text, error_code& ec) { return number(text, ec); }
  bool on_bool(bool value, error_code& ec) { return done(builder.add_value(value), ec); }
  bool on_null(error_code& ec) { return done(builder.add_value(nullptr), ec); }
  bool on_comment_part(string_view, error_code&) { return true; }
  bool on_comment(string_view, error_code&) { return true; }
};

}  // namespace

std::size_t memory_of_json(std::string_view text) {
  constexpr auto costs = [] {
    std::array<std::uint8_t, 256> of{};
    of.fill(heap::byte);
    of[','] = heap::item;
    of['['] = heap::array;
    of['{'] = heap::object;
    of[':'] = heap::pair;
    of['"'] = heap::text / 2 + heap::byte;
    return of;
  }();
  std::size_t bytes = heap::document;
  for (const auto c : text) bytes += costs[static_cast<std::uint8_t>(c)];
  return bytes;
}

Result<Json> read_json(std::string_view text) {
  boost::json::parse_options options;
  options.max_depth = JsonBuilder::max_depth;
  boost::json::basic_parser<TextHandler> parser(options);
  boost::system::error_code ec;
  const auto used = parser.write_some(false, text.data(), text.size(), ec);
  auto& builder = parser.handler().builder;
  if (!ec && used < text.size()) ec = boost::json::error::extra_data;
  if (!ec) return {boost::system::in_place_value, builder.take()};
  if (!builder.why().empty())
    return unreadable_document("JSON", builder.why() + " (byte " + std::to_string(used) + ")");
  return unreadable_document("JSON", "is malformed at byte " + std::to_string(used) + ": " + ec.message());
}

std::string write_json(const OrderedJson& json) {
  // Texts may come from others, as the names and roles that a proxy tells: no document fails for one of theirs.
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

Bytes write_cbor(const OrderedJson& json) {
  return OrderedJson::to_cbor(json);
}

}  // namespace rr
