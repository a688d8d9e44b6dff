// The line that the log has of what was asked of a device, with the W3C trace that it belongs to. Layer:
// server/http/endpoints. Source: W3C Trace Context, section 3.2.
#pragma once

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>

#include "server/log/log.hpp"

namespace rrgate {

/// The trace id of a traceparent, "00-<32 hex digits>-<16>-<2>"; empty where it is none.
inline std::string trace_id_of(std::string_view traceparent) {
  constexpr std::size_t length = 55;
  const auto is_lower_hex = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (traceparent.size() != length || traceparent.substr(0, 3) != "00-") return {};
  for (std::size_t i = 3; i < length; ++i)
    if (i == 35 || i == 52 ? traceparent[i] != '-' : !is_lower_hex(traceparent[i])) return {};
  const auto id = traceparent.substr(3, 32);
  if (std::all_of(id.begin(), id.end(), [](char c) { return c == '0'; })) return {};
  return std::string(id);
}

/// Logs when it is over: debug, or info where somebody traces.
class CallLog {
 public:
  CallLog(std::string trace, std::string device, std::string_view operation, std::string member)
      : trace_(std::move(trace)), device_(std::move(device)), operation_(operation), member_(std::move(member)) {}
  CallLog(const CallLog&) = delete;
  CallLog& operator=(const CallLog&) = delete;
  ~CallLog() {
    const auto took = std::chrono::steady_clock::now() - begin_;
    const auto us = std::chrono::duration_cast<std::chrono::microseconds>(took).count();
    log(trace_.empty() ? LogLevel::debug : LogLevel::info, "call",
        {{"trace", trace_}, {"device", device_}, {"op", operation_}, {"member", member_}, {"us", us}});
  }

 private:
  std::string trace_;
  std::string device_;
  std::string operation_;
  std::string member_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace rrgate
