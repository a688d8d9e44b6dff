#include "server/cli/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <sstream>

namespace rrgate {

namespace {

constexpr std::chrono::milliseconds first_look{300};  // what is over sooner is not worth a line
constexpr std::chrono::milliseconds redraw_period{100};

}  // namespace

std::string progress_text(const std::string& what, std::uint64_t done, std::uint64_t total) {
  std::ostringstream out;
  out << what << " ";
  if (total == 0) {
    out << std::fixed << std::setprecision(1) << static_cast<double>(done) / 1e6 << " MB";
    return out.str();
  }
  constexpr std::uint64_t width = 20;
  done = std::min(done, total);
  const auto filled = done * width / total;
  out << "[" << std::string(filled, '#') << std::string(width - filled, '.') << "] " << std::setw(3)
      << done * 100 / total << " %";
  return out.str();
}

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)),
      total_(total),
      is_seen_(::isatty(STDERR_FILENO) == 1),
      next_(std::chrono::steady_clock::now() + first_look) {}

Progress::~Progress() {
  if (is_drawn_) std::cerr << "\r\x1b[K" << std::flush;
}

void Progress::show(std::uint64_t done) {
  if (!is_seen_ || std::chrono::steady_clock::now() < next_) return;
  next_ = std::chrono::steady_clock::now() + redraw_period;
  is_drawn_ = true;
  std::cerr << "\r" << progress_text(what_, done, total_) << "\x1b[K" << std::flush;
}

}  // namespace rrgate
