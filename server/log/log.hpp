// Logging: one line an event, with named fields, as text or JSON. Layer: server/log. spdlog stays behind this header.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

namespace rrgate {

enum class LogLevel { trace, debug, info, warning, error };

/// A named value of one event. Untrusted text is safe here: values are quoted and shortened on output.
struct LogField {
  std::string_view name;
  std::string value;
  bool is_number = false;

  LogField(std::string_view field, std::string text) : name(field), value(std::move(text)) {}
  LogField(std::string_view field, std::string_view text) : name(field), value(text) {}
  LogField(std::string_view field, const char* text) : name(field), value(text) {}
  template <class T>
  requires std::is_integral_v<T> LogField(std::string_view field, T number)
      : name(field), value(std::to_string(number)), is_number(true) {}
};

/// `event` is a short fixed phrase ("device online"); what varies goes into the fields. Goes to stderr, by a thread of
/// its own: while nobody reads there, up to 1 MiB waits, and what comes then is dropped. At the end of the program the
/// last lines are waited for, for a second at most.
void log(LogLevel level, std::string_view event, std::initializer_list<LogField> fields = {});

/// `level` and `format` are the words of the configuration. Until called: level info, text.
void configure_log(const std::string& level, const std::string& format);

/// Lines that were dropped because nobody read those before them.
std::uint64_t lost_log_lines();

/// The line without time and level, for tests: `event name=value name="quoted text"`, or a JSON object's members.
std::string format_log_text(std::string_view event, std::initializer_list<LogField> fields);
std::string format_log_json(std::string_view event, std::initializer_list<LogField> fields);

}  // namespace rrgate
