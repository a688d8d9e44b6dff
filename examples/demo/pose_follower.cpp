#include "examples/demo/pose_follower.hpp"

#include <numbers>

namespace rrgate::demo {

namespace {

constexpr std::chrono::milliseconds retry_period{1000};
constexpr double turns_per_second = 0.05;
constexpr double millimetres = 1000;  // per metre

double number_in(const rr::Structure& structure, std::string_view field) {
  const rr::Value* value = structure.find(field);
  const auto number = value ? value->to<double>() : rr::Result<double>(0.0);
  return number ? *number : 0;
}

}  // namespace

PoseFollower::PoseFollower(boost::asio::io_context& io, std::string url)
    : io_(io), url_(std::move(url)), retry_(io), alive_(std::make_shared<PoseFollower*>(this)) {
  connect();
}

PoseFollower::~PoseFollower() {
  stop();
}

Pose PoseFollower::pose() const {
  if (is_following_) return pose_;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - lost_).count();
  return {pose_.position, pose_.heading + seconds * turns_per_second * 2 * std::numbers::pi};
}

void PoseFollower::stop() {
  *alive_ = nullptr;
  retry_.cancel();
  if (connection_) connection_->disconnect();
}

void PoseFollower::connect() {
  rr::ClientOptions options;
  options.connect_timeout = std::chrono::seconds(5);
  rr::ClientConnection::open(io_, url_, options, [alive = alive_](auto opened) {
    PoseFollower* const self = *alive;
    if (!self) {
      if (opened) (*opened)->disconnect();
    } else if (opened) {
      self->connection_ = *opened;
      self->follow(**opened);
    } else {
      self->retry_later();
    }
  });
}

void PoseFollower::retry_later() {
  connection_.reset();
  if (is_following_) lost_ = std::chrono::steady_clock::now();
  is_following_ = false;
  retry_.expires_after(retry_period);
  retry_.async_wait([alive = alive_](const auto& error) {
    if (!error && *alive) (*alive)->connect();
  });
}

void PoseFollower::follow(rr::ClientConnection& connection) {
  connection.on_closed([alive = alive_](const rr::Error&) {
    if (*alive) (*alive)->retry_later();
  });
  const auto take = [alive = alive_](const rr::Value& value, rr::TimeSpec) {
    const auto* state = value.get_if<rr::Structure>();
    if (!*alive || !state) return;
    (*alive)->pose_ = {Point{number_in(*state, "x"), number_in(*state, "y")} * millimetres,
                       number_in(*state, "heading")};
    (*alive)->is_following_ = true;
  };
  // A robot that does not tell where it is stays unknown; the connection is kept all the same.
  connection.connect_wire(connection.root_path(), "state", take, [](const rr::Result<rr::Value>&) {});
}

}  // namespace rrgate::demo
