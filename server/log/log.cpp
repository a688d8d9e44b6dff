#include "server/log/log.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>

#include "core/support/error.hpp"

namespace rrgate {

namespace {

bool is_json = false;

constexpr std::size_t longest_value = 300;

bool is_plain_word(std::string_view text) {
  return !text.empty() && text.size() <= longest_value && std::all_of(text.begin(), text.end(), [](char c) {
    return c > 0x20 && c < 0x7f && c != '\'' && c != '"' && c != '=' && c != '\\';
  });
}

/// A JSON string. Bytes that are not ASCII pass only as a whole valid sequence can't be told here: escaped as \u00XX.
std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text.substr(0, longest_value)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte >= 0x7f) {
      char escape[8];
      std::snprintf(escape, sizeof(escape), "\\u%04x", byte);
      out += escape;
    } else {
      out += c;
    }
  }
  return out + '"';
}

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::trace:
      return spdlog::level::trace;
    case LogLevel::debug:
      return spdlog::level::debug;
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    case LogLevel::error:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

void set_pattern(spdlog::logger& logger) {
  if (is_json) {
    logger.set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})", spdlog::pattern_time_type::utc);
  } else {
    logger.set_pattern("%Y-%m-%d %H:%M:%S.%e %l %v");
  }
}

spdlog::logger& logger() {
  static const auto instance = [] {
    auto made = std::make_shared<spdlog::logger>("rrgate", std::make_shared<spdlog::sinks::stderr_sink_st>());
    set_pattern(*made);
    return made;
  }();
  return *instance;
}

template <class Fields>
std::string text_line(std::string_view event, const Fields& fields) {
  std::string out(event);
  for (const auto& field : fields) {
    out += ' ';
    out += field.name;
    out += '=';
    out += field.is_number || is_plain_word(field.value) ? field.value : rr::quote(field.value, longest_value);
  }
  return out;
}

template <class Fields>
std::string json_line(std::string_view event, const Fields& fields) {
  std::string out = "\"event\":" + json_string(event);
  for (const auto& field : fields) {
    out += ',' + json_string(field.name) + ':';
    out += field.is_number ? field.value : json_string(field.value);
  }
  return out;
}

}  // namespace

void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields) {
  const auto severity = to_spdlog(level);
  if (!logger().should_log(severity)) return;
  const auto line = is_json ? json_line(event, fields) : text_line(event, fields);
  logger().log(severity, spdlog::string_view_t(line.data(), line.size()));
}

void configure_log(const std::string& level, const std::string& format) {
  is_json = format == "json";
  set_pattern(logger());
  logger().set_level(spdlog::level::from_str(level));
}

std::string format_log_text(std::string_view event, std::initializer_list<LogField> fields) {
  return text_line(event, fields);
}

std::string format_log_json(std::string_view event, std::initializer_list<LogField> fields) {
  return json_line(event, fields);
}

}  // namespace rrgate
