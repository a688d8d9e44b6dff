#include "test/support/format_message.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <vector>

namespace rr::test {

namespace {

/// Shortest decimal that reads back as the same number, with ".0" when it would look like an integer.
template <class Float>
std::string format_float(Float value, int max_digits) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  char text[40];
  int digits = 1;
  for (; digits <= max_digits; ++digits) {
    std::snprintf(text, sizeof(text), "%.*e", digits - 1, static_cast<double>(value));
    if (static_cast<Float>(std::strtod(text, nullptr)) == value) break;
  }
  const std::string scientific = text;
  const int exponent = std::atoi(scientific.c_str() + scientific.find('e') + 1);
  if (exponent < -5 || exponent > 15) return scientific;
  std::snprintf(text, sizeof(text), "%.*f", std::max(1, digits - 1 - exponent), static_cast<double>(value));
  return text;
}

std::string format_item(DataType type, const std::uint8_t* item) {
  const auto real = [](double value) { return format_float(value, 17); };
  const auto single = [](float value) { return format_float(value, 9); };
  switch (type) {
    case DataType::double_t:
      return real(load<double>(item));
    case DataType::single_t:
      return single(load<float>(item));
    case DataType::int8_t:
      return std::to_string(load<std::int8_t>(item));
    case DataType::uint8_t:
      return std::to_string(load<std::uint8_t>(item));
    case DataType::int16_t:
      return std::to_string(load<std::int16_t>(item));
    case DataType::uint16_t:
      return std::to_string(load<std::uint16_t>(item));
    case DataType::int32_t:
      return std::to_string(load<std::int32_t>(item));
    case DataType::uint32_t:
      return std::to_string(load<std::uint32_t>(item));
    case DataType::int64_t:
      return std::to_string(load<std::int64_t>(item));
    case DataType::uint64_t:
      return std::to_string(load<std::uint64_t>(item));
    case DataType::cdouble_t:
      return "[" + real(load<double>(item)) + ", " + real(load<double>(item + 8)) + "]";
    case DataType::csingle_t:
      return "[" + single(load<float>(item)) + ", " + single(load<float>(item + 4)) + "]";
    case DataType::bool_t:
      return *item != 0 ? "true" : "false";
    default:
      return "?";
  }
}

class Formatter {
 public:
  Formatter(const Message& message, const FormatOptions& options) : message_(message), options_(options) {}

  void add_message();
  /// Writes the elements [first, end), siblings and descendants, without recursion.
  void add_elements(std::uint32_t first, std::uint32_t end);
  std::string take();

 private:
  bool is_full() const { return out_.size() > options_.max_size; }
  void add_entry(const MessageEntry& entry);
  void add_key(const MessageElement& element);
  void add_leaf(const MessageElement& element);
  std::string cut(std::string_view text) const;

  const Message& message_;
  const FormatOptions& options_;
  std::string out_;
};

void Formatter::add_message() {
  const auto& header = message_.header;
  out_ += "v" + std::to_string(header.version);
  if (header.has_endpoints)
    out_ += " | ep " + std::to_string(header.sender_endpoint) + ">" + std::to_string(header.receiver_endpoint);
  else
    out_ += " | (no routing)";
  for (const auto& entry : message_.entries) {
    if (is_full()) return;
    add_entry(entry);
  }
}

void Formatter::add_entry(const MessageEntry& entry) {
  out_ += " | ";
  const auto type_name = entry_type_name(entry.type);
  if (type_name == "unknown")
    out_ += std::to_string(static_cast<std::uint16_t>(entry.type));
  else
    out_ += type_name;
  if (!entry.service_path.empty()) out_ += " path=" + cut(entry.service_path);
  if (!entry.member_name.empty()) out_ += " member=" + cut(entry.member_name);
  if (entry.request_id != 0) out_ += " req=" + std::to_string(entry.request_id);
  if (entry.error != ErrorCode::none) {
    out_ += " ERROR " + std::to_string(static_cast<std::uint16_t>(entry.error));
    if (const auto name = error_code_name(entry.error); !name.empty()) out_ += " " + std::string(name);
  }
  if (!entry.metadata.empty()) {
    out_ += " meta=\"" + cut(entry.metadata) + "\"";
  }
  if (entry.first_element != entry.end_element) {
    out_ += " {";
    add_elements(entry.first_element, entry.end_element);
    out_ += "}";
  }
}

void Formatter::add_elements(std::uint32_t first, std::uint32_t end) {
  struct Level {
    std::uint32_t end;
    std::size_t shown;
    bool is_secret;
  };
  std::vector<Level> levels{{end, 0, false}};
  for (std::uint32_t index = first; !levels.empty();) {
    auto& level = levels.back();
    const bool is_cut = level.shown == options_.max_items || is_full();
    if (index == level.end || is_cut) {
      if (index != level.end) out_ += "...";
      index = level.end;
      levels.pop_back();
      if (!levels.empty()) out_ += "}";
      continue;
    }
    if (level.shown++ != 0) out_ += ", ";
    const auto& element = message_.elements[index];
    const bool is_secret = level.is_secret || element.name == "credentials" || element.name == "password";
    add_key(element);
    if (is_nested(element.type)) {
      if (!element.type_name.empty()) out_ += "<" + cut(element.type_name) + ">";
      out_ += "{";
      levels.push_back({element.end, 0, is_secret});
    } else if (is_secret) {
      out_ += "=***";
    } else {
      add_leaf(element);
    }
    ++index;
  }
}

void Formatter::add_key(const MessageElement& element) {
  if (element.key_kind == KeyKind::number)
    out_ += "#" + std::to_string(element.number);
  else
    out_ += cut(element.name);
  out_ += ":";
  out_ += data_type_name(element.type);
}

void Formatter::add_leaf(const MessageElement& element) {
  out_ += "=";
  if (element.type == DataType::void_t) {
    out_ += "null";
  } else if (element.type == DataType::string_t) {
    out_ += "\"" + cut(element.text()) + "\"";
  } else {
    const auto size = item_size(element.type);
    out_ += "[";
    for (std::size_t item = 0; item < element.count; ++item) {
      if (item != 0) out_ += ", ";
      if (item == options_.max_items) {
        out_ += "...";
        break;
      }
      out_ += format_item(element.type, element.data.data() + item * size);
    }
    out_ += "]";
  }
}

/// Untrusted text, shortened, and such that it cannot break the line.
std::string Formatter::cut(std::string_view text) const {
  std::string out;
  for (const char c : text.substr(0, options_.max_text)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\n') {
      out += "\\n";
    } else if (byte < 0x20 || byte == 0x7f) {
      char escape[8];
      std::snprintf(escape, sizeof(escape), "\\u%04x", byte);
      out += escape;
    } else {
      if (c == '"' || c == '\\') out += '\\';
      out += c;
    }
  }
  if (text.size() > options_.max_text) out += "...";
  return out;
}

std::string Formatter::take() {
  if (is_full()) {
    out_.resize(options_.max_size);
    out_ += "...";
  }
  return std::move(out_);
}

}  // namespace

std::string format_message(const Message& message, const FormatOptions& options) {
  Formatter formatter(message, options);
  formatter.add_message();
  return formatter.take();
}

std::string format_element(const Message& message, const MessageElement& element, const FormatOptions& options) {
  Formatter formatter(message, options);
  const auto index = static_cast<std::uint32_t>(&element - message.elements.data());
  formatter.add_elements(index, element.end);
  return formatter.take();
}

}  // namespace rr::test
