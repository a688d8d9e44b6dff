#include "server/config/object_reader.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/support/error.hpp"

namespace rrgate {

namespace {

constexpr std::string_view any_type = "any";

const nlohmann::json& empty_object() {
  static const nlohmann::json value = nlohmann::json::object();
  return value;
}

std::string no_file_name(const std::string& text) {
  return text.empty() ? "empty; expected the name of a file" : "";
}

std::string type_of(const nlohmann::json& value) {
  if (value.is_number_integer()) return "integer";
  if (value.is_number()) return "number";
  return value.type_name();
}

/// The offending value itself, short.
std::string shown(const nlohmann::json& value) {
  if (value.is_string()) return "string " + rr::quote(value.get_ref<const std::string&>());
  if (value.is_structured()) return type_of(value);
  return type_of(value) + " " + value.dump();
}

std::string with_article(std::string_view type) {
  const bool vowel = std::string_view("aeiou").find(type.front()) != std::string_view::npos;
  return (vowel ? "an " : "a ") + std::string(type);
}

/// JSON pointer: '~' and '/' of a key are escaped.
std::string pointer_segment(std::string_view key) {
  std::string out = "/";
  for (const char c : key.substr(0, 60)) {
    if (c == '~') {
      out += "~0";
    } else if (c == '/') {
      out += "~1";
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += '?';
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

std::string wrong_text(std::string_view found, std::string_view expected) {
  return "found " + rr::quote(found) + ", expected " + std::string(expected);
}

std::string format_finding(const std::string& file, const Finding& finding) {
  return file + ": " + (finding.path.empty() ? std::string() : finding.path + ": ") + finding.text;
}

ObjectReader::ObjectReader(const nlohmann::json& value, std::string path, ReadLog& log)
    : value_(value.is_object() ? value : empty_object()), path_(std::move(path)), log_(log) {
  if (!value.is_object()) log_.findings.push_back({path_, "found " + shown(value) + ", expected an object"});
}

void ObjectReader::finding(std::string_view key, std::string text) {
  log_.findings.push_back({path_ + pointer_segment(key), std::move(text)});
}

const nlohmann::json* ObjectReader::find(std::string_view key, std::string_view type, OptionInfo description) {
  known_.emplace_back(key);
  if (describes()) {
    description.path = path_ + "/" + std::string(key);
    description.type = std::string(type);
    log_.options->push_back(std::move(description));
    return nullptr;
  }
  const auto found = value_.find(std::string(key));
  if (found == value_.end()) {
    if (description.is_required) finding(key, "missing; expected " + with_article(type));
    return nullptr;
  }
  if (type != any_type && type_of(*found) != type) {
    finding(key, "found " + shown(*found) + ", expected " + with_article(type));
    return nullptr;
  }
  return &*found;
}

void ObjectReader::integer(std::string_view key, IntegerRange range, std::int64_t current,
                           const std::function<void(std::int64_t)>& store) {
  const auto* value = find(key, "integer",
                           {.path = {},
                            .type = {},
                            .minimum = range.minimum,
                            .maximum = range.maximum,
                            .default_value = std::to_string(current)});
  if (!value) return;
  const bool is_huge = value->is_number_unsigned() && value->get<std::uint64_t>() > INT64_MAX;
  const auto number = is_huge ? INT64_MAX : value->get<std::int64_t>();
  if (number < range.minimum || number > range.maximum) {
    finding(key, "found " + value->dump() + ", expected " + std::to_string(range.minimum) + " to " +
                     std::to_string(range.maximum));
    return;
  }
  store(number);
}

void ObjectReader::size(std::string_view key, std::size_t& target, IntegerRange range) {
  integer(key, range, static_cast<std::int64_t>(target),
          [&](std::int64_t number) { target = static_cast<std::size_t>(number); });
}

void ObjectReader::duration(std::string_view key, std::chrono::milliseconds& target, IntegerRange range) {
  integer(key, range, target.count(), [&](std::int64_t number) { target = std::chrono::milliseconds(number); });
}

void ObjectReader::text(std::string_view key, std::string& target) {
  const auto* value = find(key, "string", {.path = {}, .type = {}, .default_value = nlohmann::json(target).dump()});
  if (value) target = value->get<std::string>();
}

void ObjectReader::flag(std::string_view key, bool& target) {
  const auto* value = find(key, "boolean", {.path = {}, .type = {}, .default_value = target ? "true" : "false"});
  if (value) target = value->get<bool>();
}

void ObjectReader::json(std::string_view key, std::string_view type, std::string& target) {
  const auto* value = find(key, type.empty() ? any_type : type, {});
  if (value) target = value->dump();
}

void ObjectReader::choice(std::string_view key, std::string& target, std::vector<std::string> choices) {
  const auto* value =
      find(key, "string", {.path = {}, .type = {}, .choices = choices, .default_value = nlohmann::json(target).dump()});
  if (!value) return;
  const auto& text = value->get_ref<const std::string&>();
  if (std::find(choices.begin(), choices.end(), text) != choices.end()) {
    target = text;
    return;
  }
  std::string expected;
  for (const auto& name : choices) expected += (expected.empty() ? "" : ", ") + name;
  finding(key, wrong_text(text, "one of: " + expected));
}

void ObjectReader::required_text(std::string_view key, const ReadText& read) {
  const auto* value = find(key, "string", {.path = {}, .type = {}, .is_required = true});
  if (value) item_text(*value, path_ + pointer_segment(key), read);
}

void ObjectReader::required_text(std::string_view key, std::string& target) {
  required_text(key, [&target](const std::string& text) -> std::string {
    target = text;
    return {};
  });
}

void ObjectReader::item_text(const nlohmann::json& value, const std::string& path, const ReadText& read) {
  auto problem = read(value.get_ref<const std::string&>());
  if (!problem.empty()) log_.findings.push_back({path, std::move(problem)});
}

void ObjectReader::texts(std::string_view key, bool is_required, const ReadText& read) {
  const auto* value = find(key, "array", {.path = {}, .type = {}, .is_required = is_required});
  const auto path = path_ + pointer_segment(key);
  if (describes()) log_.options->push_back({.path = path + "/*", .type = "string"});
  if (!value) return;
  for (std::size_t i = 0; i < value->size(); ++i) {
    const auto item_path = path + "/" + std::to_string(i);
    if ((*value)[i].is_string()) {
      item_text((*value)[i], item_path, read);
    } else {
      log_.findings.push_back({item_path, "found " + shown((*value)[i]) + ", expected a string"});
    }
  }
}

bool ObjectReader::node_id(std::string_view key, rr::NodeId& target) {
  std::string given;
  text(key, given);
  if (given.empty()) return false;
  const auto id = rr::parse_node_id(given);
  if (id && !id->is_any())
    target = *id;
  else
    finding(key, wrong_text(given, "a UUID that is not all zeros"));
  return true;
}

void ObjectReader::required_file(std::string_view key, std::string& target) {
  required_text(key, [&target](const std::string& text) {
    target = text;
    return no_file_name(text);
  });
}

void ObjectReader::files(std::string_view key, std::vector<std::string>& target) {
  texts(key, false, [&target](const std::string& text) {
    target.push_back(text);
    return no_file_name(text);
  });
}

void ObjectReader::ranges(std::string_view key, const ReadRange& read) {
  const auto* value = find(key, "object", {});
  if (!value) return;
  for (const auto& [name, range] : value->items()) {
    const bool is_range =
        range.is_array() && range.size() == 2 && range[0].is_number() && range[1].is_number() && range[0] <= range[1];
    if (is_range)
      read(name, range[0].get<double>(), range[1].get<double>());
    else
      log_.findings.push_back({path_ + pointer_segment(key) + pointer_segment(name),
                               "found " + shown(range) + ", expected [LEAST, MOST]: two numbers"});
  }
}

void ObjectReader::object(std::string_view key, const ReadObject& read) {
  const auto* value = find(key, "object", {});
  if (!value && !describes()) return;
  ObjectReader member(value ? *value : empty_object(), path_ + pointer_segment(key), log_);
  read(member);
  member.finish();
}

void ObjectReader::objects(std::string_view key, bool is_required, const ReadObject& read) {
  const auto* value = find(key, "array", {.path = {}, .type = {}, .is_required = is_required});
  const auto path = path_ + pointer_segment(key);
  if (describes()) {
    log_.options->push_back({.path = path + "/*", .type = "object"});
    ObjectReader item(empty_object(), path + "/*", log_);
    read(item);
    return;
  }
  if (!value) return;
  for (std::size_t i = 0; i < value->size(); ++i) {
    const auto before = log_.findings.size();
    ObjectReader item((*value)[i], path + "/" + std::to_string(i), log_);
    if (log_.findings.size() != before) continue;  // not an object: its missing members are not news
    read(item);
    item.finish();
  }
}

void ObjectReader::finish() {
  if (describes()) return;
  for (const auto& [key, unused] : value_.items()) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    std::string names;
    for (const auto& name : known_) names += (names.empty() ? "" : ", ") + name;
    finding(key, "unknown option; known here: " + names);
  }
}

}  // namespace rrgate
