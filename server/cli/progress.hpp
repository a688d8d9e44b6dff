// How far something is that takes long, for whoever waits at a terminal. Layer: server/cli.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace rrgate {

/// A line on standard error, from a while after its making until its end; nothing where that is no terminal.
class Progress {
 public:
  /// `total`  of what show() tells; 0: not known, it tells bytes.
  explicit Progress(std::string what, std::uint64_t total = 0);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  void show(std::uint64_t done);

 private:
  std::string what_;
  std::uint64_t total_;
  bool is_seen_;  ///< somebody sits at a terminal
  bool is_drawn_ = false;
  std::chrono::steady_clock::time_point next_;
};

/// "receiving [##########..........]  50 %", or without a total "receiving 1.5 MB".
std::string progress_text(const std::string& what, std::uint64_t done, std::uint64_t total);

}  // namespace rrgate
