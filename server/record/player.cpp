#include "server/record/player.hpp"

#include <algorithm>
#include <set>

namespace rrgate {

namespace {

constexpr int messages_a_turn = 1000;  // others have a turn between
constexpr std::chrono::milliseconds playing_look_period{100};

double to_seconds(McapTime time) {
  return static_cast<double>(time) * 1e-9;
}

}  // namespace

Player::Player(boost::asio::io_context& io, Recording recording, Listener listener)
    : io_(io),
      recording_(std::move(recording)),
      listener_(std::move(listener)),
      timer_(io),
      position_(recording_.begin()) {}

PlayerState Player::state() const {
  return {is_playing_, to_seconds(position_ - recording_.begin()), to_seconds(recording_.end() - recording_.begin()),
          speed_, loops_};
}

void Player::play() {
  if (is_playing_) return;
  if (!next_message()) go_to(recording_.begin());
  is_playing_ = true;
  rebase();
  listener_.changed();
  wait({});
}

void Player::pause() {
  timer_.cancel();
  is_playing_ = false;
  listener_.changed();
}

void Player::seek(double position) {
  const bool is_within = position < state().duration;
  const auto from_begin = position > 0 && is_within ? static_cast<McapTime>(position * 1e9) : 0;
  go_to(is_within ? recording_.begin() + from_begin : recording_.end());
  rebase();
  listener_.changed();
  if (is_playing_) wait({});
}

void Player::step(std::uint32_t messages) {
  is_playing_ = false;
  timer_.cancel();
  for (std::uint32_t i = 0; i < std::min(messages, max_step) && next_message(); ++i) deliver_next();
  listener_.changed();
}

void Player::set_speed(double speed) {
  speed_ = std::clamp(speed, min_speed, max_speed);
  rebase();
  listener_.changed();
  if (is_playing_) wait({});
}

void Player::set_loops(bool loops) {
  loops_ = loops;
  listener_.changed();
}

void Player::rebase() {
  base_ = Clock::now();
  base_position_ = position_;
}

void Player::wait(Clock::duration time) {
  timer_.expires_after(time);
  timer_.async_wait([this](const auto& error) {
    if (!error) turn();
  });
}

void Player::turn() {
  if (!is_playing_) return;
  const std::chrono::duration<double, std::nano> since(Clock::now() - base_);
  const auto left = recording_.end() - std::min(base_position_, recording_.end());
  const auto due = base_position_ + static_cast<McapTime>(std::min(since.count() * speed_, static_cast<double>(left)));
  int count = 0;
  const McapMessage* next = next_message();
  for (; next && next->log_time <= due && count < messages_a_turn; next = next_message(), ++count) deliver_next();
  position_ = next ? std::max(position_, std::min(due, next->log_time)) : recording_.end();
  if (!next && !loops_) is_playing_ = false;
  listener_.changed();
  if (!is_playing_) return;
  if (!next) {  // a recording of one message does not take all the time
    shift_ +=
        static_cast<McapTime>(static_cast<double>(std::chrono::nanoseconds(playing_look_period).count()) * speed_);
    go_to(recording_.begin());
    rebase();
    return wait(playing_look_period);
  }
  if (count == messages_a_turn) return wait({});
  const std::chrono::duration<double, std::nano> until(
      static_cast<double>(next->log_time - std::min(due, next->log_time)) / speed_);
  wait(until < playing_look_period ? std::chrono::duration_cast<Clock::duration>(until)
                                   : Clock::duration(playing_look_period));
}

const McapMessage* Player::next_message() {
  while (chunk_ < recording_.chunks().size()) {
    if (!load(chunk_)) return nullptr;
    if (message_ < messages_.messages.size()) return &messages_.messages[message_];
    ++chunk_;
    message_ = 0;
  }
  return nullptr;
}

bool Player::load(std::size_t chunk) {
  if (loaded_ == chunk) return true;
  auto read = recording_.read(recording_.chunks()[chunk]);
  if (!read) {
    fail(read.error());
    return false;
  }
  messages_ = std::move(*read);
  loaded_ = chunk;
  return true;
}

void Player::fail(const rr::Error& error) {
  is_playing_ = false;
  chunk_ = recording_.chunks().size();
  listener_.failed(error);
}

void Player::deliver_next() {
  const auto& message = messages_.messages[message_++];
  position_ = std::max(position_, message.log_time);
  deliver(message);
}

/// The first value of a wire after the replay went back may have been sent long before it was recorded, or before the
/// one that came last: all that follows is shifted so far that it is newer.
void Player::deliver(const McapMessage& message) {
  const auto floor = floors_.find(message.channel);
  const auto stamp = message.publish_time + shift_;
  if (floor != floors_.end() && stamp <= floor->second) shift_ += floor->second - stamp + 1;
  auto& newest = newest_[message.channel];
  newest = std::max(newest, message.publish_time + shift_);
  listener_.play(message, shift_);
}

void Player::go_to(McapTime time) {
  if (time < position_) {
    shift_ += position_ - time;
    floors_ = newest_;
  }
  position_ = time;
  const auto& chunks = recording_.chunks();
  const auto found =
      std::find_if(chunks.begin(), chunks.end(), [time](const RecordedChunk& chunk) { return chunk.last >= time; });
  chunk_ = static_cast<std::size_t>(found - chunks.begin());
  message_ = 0;
  if (const auto* first = next_message(); !first) return;
  const auto& messages = messages_.messages;
  message_ = static_cast<std::size_t>(
      std::find_if(messages.begin(), messages.end(), [time](const auto& each) { return each.log_time >= time; }) -
      messages.begin());
  restore();
}

bool Player::has_state(std::uint16_t channel) const {
  const auto kind = recording_.members().at(channel).kind;
  return kind == rr::MemberKind::wire || kind == rr::MemberKind::property;
}

/// Hands out the newest value before the next message of each wire and property; those without one have none again.
void Player::restore() {
  const auto chunk = chunk_;
  const auto end = message_;
  std::set<std::uint16_t> found;
  for (auto i = chunk + 1; i-- > 0;) {
    const auto& counts = recording_.chunks()[i].message_counts;
    const auto is_wanted = [&](const auto& each) { return has_state(each.first) && !found.contains(each.first); };
    if (std::none_of(counts.begin(), counts.end(), is_wanted)) continue;
    if (!load(i)) return;
    for (auto at = i == chunk ? end : messages_.messages.size(); at-- > 0;) {
      const auto& message = messages_.messages[at];
      if (has_state(message.channel) && found.insert(message.channel).second) deliver(message);
    }
  }
  for (const auto& [channel, member] : recording_.members())
    if (has_state(channel) && !found.contains(channel)) listener_.forget(channel);
}

}  // namespace rrgate
