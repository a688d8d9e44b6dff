#include "create_serial.hpp"

#include <boost/asio/write.hpp>

#include "definition.hpp"

namespace create_minimal {

namespace asio = boost::asio;

namespace {

// Commands of the Open Interface.
constexpr std::uint8_t start = 128, full_mode = 132, drive_command = 137, song = 140, play = 141, stream = 148,
                       pause_stream = 150;
constexpr int baud_rate = 57'600;
constexpr std::size_t max_waiting_bytes = 1024;
constexpr std::size_t max_notes = 16;
constexpr std::int16_t straight = 32767, also_straight = -32768;

std::uint8_t high(std::int16_t value) {
  return static_cast<std::uint8_t>(static_cast<std::uint16_t>(value) >> 8);
}
std::uint8_t low(std::int16_t value) {
  return static_cast<std::uint8_t>(value);
}

[[noreturn]] void refuse(const std::string& what, int value, int limit) {
  throw rr::ServiceException(
      what + " " + std::to_string(value) + " mm, expected -" + std::to_string(limit) + " to " + std::to_string(limit),
      rr::ErrorCode::invalid_argument);
}

}  // namespace

CreateSerial::CreateSerial(rr::Node& node, const std::string& device, std::function<void(const std::string&)> on_lost)
    : line_(node.io_context(), device),
      on_lost_(std::move(on_lost)),
      service_(rr::Service::from_text({definition}, service_name, "Create", rr::RobdefMode::compat)) {
  line_.set_option(asio::serial_port::baud_rate(baud_rate));
  line_.set_option(asio::serial_port::character_size(8));
  add_members();
  node.add(service_);
  send({start, full_mode, pause_stream, 0});
  read();
}

void CreateSerial::add_members() {
  service_->function("Drive", [this](std::int16_t velocity, std::int16_t radius) { drive(velocity, radius); });
  service_->function("StartStreaming", [this] { start_streaming(service_->current_client()); });
  service_->function("StopStreaming", [this] { stop_streaming(service_->current_client()); });
  service_->on_client_gone([this](rr::ClientId client) {
    if (!lost_.empty()) return;
    stop_streaming(client);
    if (client == driver_) drive(0, straight);  // a robot that nobody drives any more runs into things
  });
  // The paper's definition does not say that they are read only.
  const auto refuse_to_set = [](const rr::Value&) {
    throw rr::ServiceException("the robot says this; it can't be set", rr::ErrorCode::read_only_member);
  };
  service_->property("DistanceTraveled").get([this] { return distance_; }).set(refuse_to_set);
  service_->property("AngleTraveled").get([this] { return angle_; }).set(refuse_to_set);
  service_->property("Bumpers").get([this] { return sensors_.bumps; }).set(refuse_to_set);
}

void CreateSerial::drive(std::int16_t velocity, std::int16_t radius) {
  if (velocity < -500 || velocity > 500) refuse("velocity", velocity, 500);
  if ((radius < -2000 || radius > 2000) && radius != straight && radius != also_straight)
    refuse("radius", radius, 2000);
  send({drive_command, high(velocity), low(velocity), high(radius), low(radius)});
  driver_ = velocity == 0 ? 0 : service_->current_client();
}

void CreateSerial::start_streaming(rr::ClientId client) {
  if (listeners_.empty()) send({stream, 4, bumps_id, distance_id, angle_id, buttons_id});
  listeners_.insert(client);
}

void CreateSerial::stop_streaming(rr::ClientId client) {
  if (listeners_.erase(client) != 0 && listeners_.empty()) send({pause_stream, 0});
}

/// Asks who drives for a song, or else who listens.
void CreateSerial::press_play() {
  const auto asked = driver_ != 0 || listeners_.empty() ? driver_ : *listeners_.begin();
  service_->call_callback(asked, "play_callback", {distance_, angle_}, [this](const rr::Result<rr::Value>& answer) {
    if (!answer || !lost_.empty()) return;  // a client that knows no song
    const auto notes = answer->to_items<std::uint8_t>().value();
    const auto count = std::min(notes.size() / 2, max_notes);
    std::vector<std::uint8_t> command{song, 0, static_cast<std::uint8_t>(count)};
    command.insert(command.end(), notes.begin(), notes.begin() + static_cast<std::ptrdiff_t>(2 * count));
    command.insert(command.end(), {play, 0});
    send(std::move(command));
  });
}

void CreateSerial::send(std::vector<std::uint8_t> command) {
  if (!lost_.empty()) throw rr::ServiceException("the robot's serial line is gone: " + lost_);
  if (waiting_.size() + command.size() > max_waiting_bytes)
    throw rr::ServiceException("the robot takes no more commands: " + std::to_string(waiting_.size()) + " bytes wait");
  waiting_.insert(waiting_.end(), command.begin(), command.end());
  if (written_.empty()) write_what_waits();
}

void CreateSerial::write_what_waits() {
  written_ = std::exchange(waiting_, {});
  if (written_.empty()) return;
  asio::async_write(line_, asio::buffer(written_), [this](const boost::system::error_code& error, std::size_t) {
    if (error) return lose(error);
    write_what_waits();
  });
}

void CreateSerial::read() {
  line_.async_read_some(asio::buffer(received_), [this](const boost::system::error_code& error, std::size_t count) {
    if (error) return lose(error);
    stream_.feed(std::span(received_).first(count));
    while (const auto packet = stream_.next()) take(*packet);
    read();
  });
}

void CreateSerial::take(const std::vector<std::uint8_t>& packet) {
  const auto now = read_sensors(packet);
  if (!now) return;
  distance_ += now->distance;
  angle_ += now->angle;
  const auto before = std::exchange(sensors_, *now);
  service_->set_wire("packets", rr::Structure{"experimental.create.SensorPacket",
                                              {{"ID", std::uint8_t{stream_header}}, {"Data", packet}}});
  if ((before.bumps & 3) == 0 && (now->bumps & 3) != 0) service_->fire("Bump");
  if ((before.buttons & 1) == 0 && (now->buttons & 1) != 0) press_play();
}

void CreateSerial::lose(const boost::system::error_code& why) {
  if (why == asio::error::operation_aborted || !lost_.empty()) return;
  lost_ = why.message();
  line_.close();
  on_lost_(lost_);
}

}  // namespace create_minimal
