#include "test/core/wire/message_tree.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "test/support/golden.hpp"

namespace rr::test {

namespace {

using nlohmann::json;

std::string text_of(const json& tree, const char* field) {
  const auto found = tree.find(field);
  if (found == tree.end()) return {};
  if (found->is_string()) return found->get<std::string>();
  if (found->contains("bytes_hex")) {
    const auto bytes = from_hex((*found)["bytes_hex"].get<std::string>());
    return std::string(bytes.begin(), bytes.end());
  }
  const auto& repeat = (*found)["repeat"];
  std::string out;
  for (std::size_t i = 0; i < repeat["count"]; ++i) out += repeat["value"].get<std::string>();
  return out + repeat.value("rest", "");
}

Bytes extended_of(const json& tree) {
  return from_hex(tree.value("extended_hex", ""));
}

DataType type_of(const json& element) {
  for (std::uint16_t type = 0; type < 128; ++type)
    if (element["type"] == data_type_name(static_cast<DataType>(type))) return static_cast<DataType>(type);
  throw std::runtime_error("unknown type " + element["type"].dump());
}

template <class T>
void append_number(Bytes& out, T value) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof(T));
}

double real_of(const json& item) {
  if (item == "NaN") return std::numeric_limits<double>::quiet_NaN();
  if (item == "Infinity") return std::numeric_limits<double>::infinity();
  if (item == "-Infinity") return -std::numeric_limits<double>::infinity();
  return item.get<double>();
}

std::int64_t signed_of(const json& item) {
  return item.is_string() ? std::stoll(item.get<std::string>()) : item.get<std::int64_t>();
}

std::uint64_t unsigned_of(const json& item) {
  return item.is_string() ? std::stoull(item.get<std::string>()) : item.get<std::uint64_t>();
}

void append_item(Bytes& out, DataType type, const json& item) {
  switch (type) {
    case DataType::double_t:
      return append_number(out, real_of(item));
    case DataType::single_t:
      return append_number(out, static_cast<float>(real_of(item)));
    case DataType::int8_t:
      return append_number(out, static_cast<std::int8_t>(signed_of(item)));
    case DataType::uint8_t:
      return append_number(out, static_cast<std::uint8_t>(unsigned_of(item)));
    case DataType::int16_t:
      return append_number(out, static_cast<std::int16_t>(signed_of(item)));
    case DataType::uint16_t:
      return append_number(out, static_cast<std::uint16_t>(unsigned_of(item)));
    case DataType::int32_t:
      return append_number(out, static_cast<std::int32_t>(signed_of(item)));
    case DataType::uint32_t:
      return append_number(out, static_cast<std::uint32_t>(unsigned_of(item)));
    case DataType::int64_t:
      return append_number(out, signed_of(item));
    case DataType::uint64_t:
      return append_number(out, unsigned_of(item));
    case DataType::cdouble_t:
      append_number(out, real_of(item[0]));
      return append_number(out, real_of(item[1]));
    case DataType::csingle_t:
      append_number(out, static_cast<float>(real_of(item[0])));
      return append_number(out, static_cast<float>(real_of(item[1])));
    case DataType::bool_t:
      return append_number(out, static_cast<std::uint8_t>(item.get<bool>()));
    default:
      throw std::runtime_error("no items of this type");
  }
}

void build_elements(const json& trees, Message& message) {
  for (const auto& tree : trees) {
    const auto type = type_of(tree);
    const auto type_name = message.store(std::string_view(text_of(tree, "type_name")));
    const bool is_numbered = tree.contains("number");
    const std::int32_t number = tree.value("number", 0);
    const auto name = message.store(std::string_view(text_of(tree, "name")));
    const auto finish = [&](MessageElement& element) {
      element.type_name = type_name;
      element.metadata = message.store(std::string_view(text_of(tree, "metadata")));
      element.extended = message.store(ByteSpan(extended_of(tree)));
      if (!is_numbered && !tree.contains("name")) element.key_kind = KeyKind::none;
    };
    if (is_nested(type)) {
      finish(is_numbered ? message.begin_nested_numbered(number, type) : message.begin_nested(name, type));
      build_elements(tree["elements"], message);
      message.end_nested();
    } else {
      const auto data = message.store(ByteSpan(value_bytes(tree)));
      const auto count = tree["count"].get<std::uint32_t>();
      finish(is_numbered ? message.add_numbered(number, type, count, data) : message.add(name, type, count, data));
    }
  }
}

/// Collects the first difference with the path to it.
class Comparison {
 public:
  template <class A, class B>
  void check(const std::string& path, const A& found, const B& expected) {
    if (difference_.empty() && !(found == expected))
      difference_ = path + ": found " + show(found) + ", expected " + show(expected);
  }
  const std::string& difference() const { return difference_; }

 private:
  template <class T>
  static std::string show(const T& value) {
    if constexpr (std::is_same_v<T, Bytes>)
      return to_hex(ByteSpan(value).first(std::min<std::size_t>(value.size(), 64)));
    else if constexpr (std::is_convertible_v<T, std::string_view>)
      return rr::quote(value);
    else
      return std::to_string(value);
  }
  std::string difference_;
};

Bytes to_vector(ByteSpan bytes) {
  return Bytes(bytes.begin(), bytes.end());
}

void compare_elements(Comparison& comparison, const std::string& path, const Message& message,
                      const ElementRange& elements, const json& trees) {
  comparison.check(path + ".size", elements.size(), trees.size());
  std::size_t index = 0;
  for (const auto& element : elements) {
    if (!comparison.difference().empty()) return;
    const auto here = path + "[" + std::to_string(index) + "]";
    const auto& tree = trees[index++];
    const auto kind = tree.contains("number") ? KeyKind::number : tree.contains("name") ? KeyKind::name : KeyKind::none;
    comparison.check(here + ".key_kind", static_cast<int>(element.key_kind), static_cast<int>(kind));
    comparison.check(here + ".name", element.name, text_of(tree, "name"));
    comparison.check(here + ".number", element.number, tree.value("number", 0));
    comparison.check(here + ".type", data_type_name(element.type), tree["type"].get<std::string>());
    comparison.check(here + ".type_name", element.type_name, text_of(tree, "type_name"));
    comparison.check(here + ".metadata", element.metadata, text_of(tree, "metadata"));
    comparison.check(here + ".extended", to_vector(element.extended), extended_of(tree));
    comparison.check(here + ".count", element.count, tree["count"].get<std::uint32_t>());
    if (!comparison.difference().empty()) return;
    if (is_nested(element.type)) {
      comparison.check(here + ".data", to_vector(element.data), Bytes{});
      compare_elements(comparison, here + ".elements", message, message.children_of(element), tree["elements"]);
    } else {
      comparison.check(here + ".value", to_vector(element.data), value_bytes(tree));
      comparison.check(here + ".children", message.children_of(element).size(), 0u);
    }
  }
  comparison.check(path + " reached", index, trees.size());
}

}  // namespace

Bytes value_bytes(const json& element) {
  const auto type = type_of(element);
  if (type == DataType::void_t) return {};
  if (element.contains("data_hex")) return from_hex(element["data_hex"].get<std::string>());
  Bytes out;
  if (type == DataType::string_t) {
    const auto text = text_of(element, "value");
    out.assign(text.begin(), text.end());
    return out;
  }
  const auto& value = element["value"];
  if (value.is_array()) {
    for (const auto& item : value) append_item(out, type, item);
    return out;
  }
  const auto& repeat = value["repeat"];
  for (std::size_t i = 0; i < repeat["count"]; ++i) append_item(out, type, repeat["value"]);
  if (repeat.contains("rest"))
    for (const auto& item : repeat["rest"]) append_item(out, type, item);
  return out;
}

void build_message(const json& tree, Message& message) {
  message.clear();
  const auto& from = tree["header"];
  auto& header = message.header;
  header.version = from["version"];
  header.has_routing = from.contains("sender_node_id");
  header.has_endpoints = from.contains("sender_endpoint");
  if (header.has_routing) {
    header.sender_node_id = parse_node_id(from["sender_node_id"].get<std::string>()).value();
    header.receiver_node_id = parse_node_id(from["receiver_node_id"].get<std::string>()).value();
    header.sender_node_name = message.store(std::string_view(text_of(from, "sender_node_name")));
    header.receiver_node_name = message.store(std::string_view(text_of(from, "receiver_node_name")));
  }
  if (header.has_endpoints) {
    header.sender_endpoint = from["sender_endpoint"];
    header.receiver_endpoint = from["receiver_endpoint"];
  }
  if (from.contains("priority")) header.priority = from["priority"].get<std::uint16_t>();
  header.is_unreliable = (from.value("message_flags", 0) & 0x08) != 0;
  header.metadata = message.store(std::string_view(text_of(from, "metadata")));
  header.message_id = from.value("message_id", std::uint16_t{0});
  header.message_res_id = from.value("message_res_id", std::uint16_t{0});
  header.extended = message.store(ByteSpan(extended_of(from)));
  for (const auto& entry_tree : tree["entries"]) {
    auto& entry = message.begin_entry(static_cast<EntryType>(entry_tree["entry_type"].get<std::uint16_t>()),
                                      message.store(std::string_view(text_of(entry_tree, "service_path"))),
                                      message.store(std::string_view(text_of(entry_tree, "member_name"))),
                                      entry_tree.value("request_id", 0u));
    entry.error = static_cast<ErrorCode>(entry_tree.value("error", std::uint16_t{0}));
    entry.metadata = message.store(std::string_view(text_of(entry_tree, "metadata")));
    entry.extended = message.store(ByteSpan(extended_of(entry_tree)));
    build_elements(entry_tree["elements"], message);
  }
}

std::string compare_message(const Message& message, const json& tree) {
  Comparison comparison;
  const auto& from = tree["header"];
  const auto& header = message.header;
  const bool is_v4 = header.version == 4;
  comparison.check("header.version", header.version, from["version"].get<int>());
  comparison.check("header.has_routing", header.has_routing, from.contains("sender_node_id"));
  comparison.check("header.has_endpoints", header.has_endpoints, from.contains("sender_endpoint"));
  if (header.has_routing) {
    comparison.check("header.sender_node_id", format_node_id(header.sender_node_id), text_of(from, "sender_node_id"));
    comparison.check("header.receiver_node_id", format_node_id(header.receiver_node_id),
                     text_of(from, "receiver_node_id"));
  }
  comparison.check("header.sender_node_name", header.sender_node_name, text_of(from, "sender_node_name"));
  comparison.check("header.receiver_node_name", header.receiver_node_name, text_of(from, "receiver_node_name"));
  comparison.check("header.sender_endpoint", header.sender_endpoint, from.value("sender_endpoint", 0u));
  comparison.check("header.receiver_endpoint", header.receiver_endpoint, from.value("receiver_endpoint", 0u));
  comparison.check("header.has priority", header.priority.has_value(), from.contains("priority"));
  comparison.check("header.priority", header.priority.value_or(0), from.value("priority", 0));
  comparison.check("header.is_unreliable", header.is_unreliable, is_v4 && (from["message_flags"].get<int>() & 8) != 0);
  comparison.check("header.metadata", header.metadata, text_of(from, "metadata"));
  comparison.check("header.message_id", header.message_id, from.value("message_id", 0));
  comparison.check("header.message_res_id", header.message_res_id, from.value("message_res_id", 0));
  comparison.check("header.extended", to_vector(header.extended), extended_of(from));

  const auto& trees = tree["entries"];
  comparison.check("entries.size", message.entries.size(), trees.size());
  for (std::size_t index = 0; comparison.difference().empty() && index < trees.size(); ++index) {
    const auto here = "entries[" + std::to_string(index) + "]";
    const auto& entry = message.entries[index];
    const auto& entry_tree = trees[index];
    comparison.check(here + ".entry_type", static_cast<int>(entry.type), entry_tree["entry_type"].get<int>());
    comparison.check(here + ".service_path", entry.service_path, text_of(entry_tree, "service_path"));
    comparison.check(here + ".member_name", entry.member_name, text_of(entry_tree, "member_name"));
    comparison.check(here + ".request_id", entry.request_id, entry_tree.value("request_id", 0u));
    comparison.check(here + ".error", static_cast<int>(entry.error), entry_tree.value("error", 0));
    comparison.check(here + ".metadata", entry.metadata, text_of(entry_tree, "metadata"));
    comparison.check(here + ".extended", to_vector(entry.extended), extended_of(entry_tree));
    compare_elements(comparison, here + ".elements", message, message.elements_of(entry), entry_tree["elements"]);
  }
  return comparison.difference();
}

std::string compare_messages(const Message& a, const Message& b) {
  Comparison comparison;
  const auto& h = a.header;
  const auto& i = b.header;
  comparison.check("version", h.version, i.version);
  comparison.check("has_routing", h.has_routing, i.has_routing);
  comparison.check("has_endpoints", h.has_endpoints, i.has_endpoints);
  comparison.check("sender_node_id", format_node_id(h.sender_node_id), format_node_id(i.sender_node_id));
  comparison.check("receiver_node_id", format_node_id(h.receiver_node_id), format_node_id(i.receiver_node_id));
  comparison.check("sender_node_name", h.sender_node_name, i.sender_node_name);
  comparison.check("receiver_node_name", h.receiver_node_name, i.receiver_node_name);
  comparison.check("sender_endpoint", h.sender_endpoint, i.sender_endpoint);
  comparison.check("receiver_endpoint", h.receiver_endpoint, i.receiver_endpoint);
  comparison.check("priority", h.priority.value_or(0) + 65536 * h.priority.has_value(),
                   i.priority.value_or(0) + 65536 * i.priority.has_value());
  comparison.check("is_unreliable", h.is_unreliable, i.is_unreliable);
  comparison.check("metadata", h.metadata, i.metadata);
  comparison.check("message_id", h.message_id, i.message_id);
  comparison.check("message_res_id", h.message_res_id, i.message_res_id);
  comparison.check("extended", to_vector(h.extended), to_vector(i.extended));
  comparison.check("entries.size", a.entries.size(), b.entries.size());
  comparison.check("elements.size", a.elements.size(), b.elements.size());
  for (std::size_t n = 0; comparison.difference().empty() && n < a.entries.size(); ++n) {
    const auto here = "entries[" + std::to_string(n) + "].";
    const auto& x = a.entries[n];
    const auto& y = b.entries[n];
    comparison.check(here + "type", static_cast<int>(x.type), static_cast<int>(y.type));
    comparison.check(here + "error", static_cast<int>(x.error), static_cast<int>(y.error));
    comparison.check(here + "request_id", x.request_id, y.request_id);
    comparison.check(here + "service_path", x.service_path, y.service_path);
    comparison.check(here + "member_name", x.member_name, y.member_name);
    comparison.check(here + "metadata", x.metadata, y.metadata);
    comparison.check(here + "extended", to_vector(x.extended), to_vector(y.extended));
    comparison.check(here + "first_element", x.first_element, y.first_element);
    comparison.check(here + "end_element", x.end_element, y.end_element);
    comparison.check(here + "element_count", x.element_count, y.element_count);
  }
  for (std::size_t n = 0; comparison.difference().empty() && n < a.elements.size(); ++n) {
    const auto here = "elements[" + std::to_string(n) + "].";
    const auto& x = a.elements[n];
    const auto& y = b.elements[n];
    comparison.check(here + "key_kind", static_cast<int>(x.key_kind), static_cast<int>(y.key_kind));
    comparison.check(here + "type", static_cast<int>(x.type), static_cast<int>(y.type));
    comparison.check(here + "number", x.number, y.number);
    comparison.check(here + "name", x.name, y.name);
    comparison.check(here + "type_name", x.type_name, y.type_name);
    comparison.check(here + "metadata", x.metadata, y.metadata);
    comparison.check(here + "extended", to_vector(x.extended), to_vector(y.extended));
    comparison.check(here + "count", x.count, y.count);
    comparison.check(here + "end", x.end, y.end);
    comparison.check(here + "data", as_text(x.data), as_text(y.data));
  }
  return comparison.difference();
}

}  // namespace rr::test
