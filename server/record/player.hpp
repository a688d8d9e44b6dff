// Plays a recording: hands out its messages when their time has come. Layer: server/record.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "server/record/recording.hpp"

namespace rrgate {

struct PlayerState {
  bool is_playing = false;
  double position = 0;  ///< in s since the first message
  double duration = 0;  ///< of the last message, likewise
  double speed = 1;
  bool loops = false;
};

/// For the thread of its io_context, which outlives it. Times are those of the recorder's clock.
class Player {
 public:
  static constexpr double min_speed = 0.001;
  static constexpr double max_speed = 1000;
  static constexpr std::uint32_t max_step = 10'000;

  struct Listener {
    /// `shift`  what is to be added to time stamps, in ns: they go on where the recording went back.
    std::function<void(const McapMessage&, McapTime shift)> play;
    /// It went to where a wire or property has no value yet.
    std::function<void(std::uint16_t channel)> forget;
    /// The player was started, stopped, moved or set; and ten times a second while it plays.
    std::function<void()> changed;
    /// The file can't be read any more: it is paused.
    std::function<void(const rr::Error&)> failed;
  };

  Player(boost::asio::io_context& io, Recording recording, Listener listener);

  void play();
  void pause();
  /// In s since the first message; what lies outside is the begin or the end.
  void seek(double position);
  /// `messages`  max_step at most, of more that many.
  void step(std::uint32_t messages);
  /// `speed`  min_speed to max_speed.
  void set_speed(double speed);
  void set_loops(bool loops);
  PlayerState state() const;
  const Recording& recording() const { return recording_; }

 private:
  using Clock = std::chrono::steady_clock;

  /// null: behind the last one.
  const McapMessage* next_message();
  bool load(std::size_t chunk);
  void deliver_next();
  void deliver(const McapMessage& message);
  void turn();
  void wait(Clock::duration time);
  void rebase();
  void go_to(McapTime time);
  void restore();
  bool has_state(std::uint16_t channel) const;
  void fail(const rr::Error& error);

  boost::asio::io_context& io_;
  Recording recording_;
  Listener listener_;
  boost::asio::steady_timer timer_;
  bool is_playing_ = false;
  bool loops_ = false;
  double speed_ = 1;
  McapTime position_;
  McapTime shift_ = 0;
  std::map<std::uint16_t, McapTime> newest_;  ///< time stamp of each channel that was handed out, shift_ included
  std::map<std::uint16_t, McapTime> floors_;  ///< the same when the replay last went back
  Clock::time_point base_;                    ///< when base_position_ was
  McapTime base_position_ = 0;
  std::size_t chunk_ = 0;    ///< that the next message is of
  std::size_t message_ = 0;  ///< in it
  std::optional<std::size_t> loaded_;
  Recording::Messages messages_;
};

}  // namespace rrgate
