#include "server/json/json.hpp"

#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/src.hpp>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

namespace rr {

namespace {

constexpr std::size_t max_depth = 64;

/// Puts a document together from what a parser meets; refuses keys that are there already.
class Builder {
 public:
  bool begin(Json container) {
    if (open_.size() >= max_depth) return fail("is nested deeper than " + std::to_string(max_depth) + " levels");
    auto* added = add(std::move(container));
    if (added) open_.push_back(added);
    return added;
  }
  bool end() {
    open_.pop_back();
    return true;
  }
  bool set_key(std::string key) {
    if (open_.back()->contains(key)) return fail("has the key " + rr::quoted(key) + " twice");
    key_ = std::move(key);
    return true;
  }
  bool add_value(Json value) { return add(std::move(value)); }
  bool add_number(double number) { return std::isfinite(number) ? add_value(number) : fail("has a number too large"); }
  bool fail(std::string why) {
    why_ = std::move(why);
    return false;
  }

  const std::string& why() const { return why_; }
  Json take() { return std::move(root_); }

 private:
  Json* add(Json value) {
    if (open_.empty()) return &(root_ = std::move(value));
    auto& parent = *open_.back();
    if (!parent.is_array()) return &(parent[key_] = std::move(value));
    parent.push_back(std::move(value));
    return &parent.back();
  }

  Json root_;
  std::vector<Json*> open_;  ///< a container stays where it is while it is open: nothing is added beside it
  std::string key_;
  std::string why_;
};

/// What boost::json::basic_parser calls. Numbers come with their digits: its own doubles are off by a bit at times.
struct TextHandler {
  using error_code = boost::json::error_code;
  using string_view = boost::json::string_view;
  static constexpr std::size_t max_object_size = std::size_t(-1);
  static constexpr std::size_t max_array_size = std::size_t(-1);
  static constexpr std::size_t max_key_size = std::size_t(-1);
  static constexpr std::size_t max_string_size = std::size_t(-1);

  Builder builder;
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

/// What nlohmann's CBOR reader calls.
struct CborHandler final : nlohmann::json_sax<Json> {
  Builder builder;

  bool null() override { return builder.add_value(nullptr); }
  bool boolean(bool value) override { return builder.add_value(value); }
  bool number_integer(number_integer_t value) override { return builder.add_value(value); }
  bool number_unsigned(number_unsigned_t value) override { return builder.add_value(value); }
  bool number_float(number_float_t value, const string_t&) override { return builder.add_value(value); }
  bool string(string_t& text) override { return builder.add_value(std::move(text)); }
  bool binary(binary_t& bytes) override {
    const auto tag = bytes.has_subtype() ? std::optional(bytes.subtype()) : std::nullopt;
    return builder.add_value(tag ? Json::binary(std::move(bytes), *tag) : Json::binary(std::move(bytes)));
  }
  bool start_object(std::size_t) override { return builder.begin(Json::object()); }
  bool key(string_t& text) override { return builder.set_key(std::move(text)); }
  bool end_object() override { return builder.end(); }
  bool start_array(std::size_t) override { return builder.begin(Json::array()); }
  bool end_array() override { return builder.end(); }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception&) override {
    return builder.fail("is no CBOR at byte " + std::to_string(position));
  }
};

Error unreadable(std::string_view kind, std::string why) {
  return make_error(ErrorCode::data_serialization_error, std::string(kind) + " " + std::move(why));
}

}  // namespace

Result<Json> read_json(std::string_view text) {
  boost::json::parse_options options;
  options.max_depth = max_depth;
  boost::json::basic_parser<TextHandler> parser(options);
  boost::json::error_code ec;
  const auto used = parser.write_some(false, text.data(), text.size(), ec);
  auto& builder = parser.handler().builder;
  if (!ec && used < text.size()) ec = boost::json::error::extra_data;
  if (!ec) return {boost::system::in_place_value, builder.take()};
  if (!builder.why().empty()) return unreadable("JSON", builder.why() + " (byte " + std::to_string(used) + ")");
  return unreadable("JSON", "is malformed at byte " + std::to_string(used) + ": " + ec.message());
}

Result<Json> read_cbor(ByteSpan bytes) {
  CborHandler handler;
  nlohmann::detail::binary_reader<Json, decltype(nlohmann::detail::input_adapter(bytes.begin(), bytes.end())),
                                  CborHandler>
      reader(nlohmann::detail::input_adapter(bytes.begin(), bytes.end()), Json::input_format_t::cbor);
  if (reader.sax_parse(Json::input_format_t::cbor, &handler, true, Json::cbor_tag_handler_t::store))
    return {boost::system::in_place_value, handler.builder.take()};
  return unreadable("CBOR", handler.builder.why());
}

std::string write_json(const OrderedJson& json) {
  return json.dump();
}

Bytes write_cbor(const OrderedJson& json) {
  return OrderedJson::to_cbor(json);
}

}  // namespace rr
