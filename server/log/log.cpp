#include "server/log/log.hpp"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <mutex>

#include "core/support/error.hpp"
#include "server/log/log_writer.hpp"

namespace rrgate {

namespace {

std::atomic<bool> is_json = false;

/// Lines that wait for a slow reader of stderr.
constexpr std::size_t max_unread_log = 1024 * 1024;

/// How long a program that ends waits for its last lines to be read.
constexpr std::chrono::milliseconds last_lines_wait{1000};

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

/// Never destroyed: its thread outlives what a program has in static objects.
LogWriter& log_writer() {
  static auto& instance = *[] {
    const auto tell = [](std::uint64_t count) {
      log(LogLevel::warning, "lines of the log were lost: they were read too slowly", {{"lines", count}});
    };
    auto* made = new LogWriter(STDERR_FILENO, max_unread_log, tell);
    std::atexit([] { (void)log_writer().flush(last_lines_wait); });
    return made;
  }();
  return instance;
}

class WriterSink final : public spdlog::sinks::base_sink<std::mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    log_writer().add({line.data(), line.size()});
  }
  void flush_() override {}
};

spdlog::logger& logger() {
  static auto& instance = *[] {
    auto* made = new spdlog::logger("rrgate", std::make_shared<WriterSink>());
    set_pattern(*made);
    return made;
  }();
  return instance;
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

std::uint64_t lost_log_lines() {
  return log_writer().lost();
}

std::string format_log_text(std::string_view event, std::initializer_list<LogField> fields) {
  return text_line(event, fields);
}

std::string format_log_json(std::string_view event, std::initializer_list<LogField> fields) {
  return json_line(event, fields);
}

}  // namespace rrgate
