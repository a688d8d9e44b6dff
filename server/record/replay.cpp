#include "server/record/replay.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <string_view>

#include "core/session/url.hpp"
#include "server/record/replay_robdef.hpp"

namespace rrgate {

namespace {

constexpr std::string_view in_process = "rr+intra:///";

rr::TimeSpec to_time_spec(McapTime time) {
  constexpr McapTime second = 1'000'000'000u;
  return {static_cast<std::int64_t>(time / second), static_cast<std::int32_t>(time % second)};
}

struct Address {
  std::string listen;  ///< without a service
  std::string reach;   ///< by which clients of this machine come: "rr+tcp://127.0.0.1"
};

/// For the node behind `number` others; port 0 stays.
Address address_of(const std::string& text, std::size_t number) {
  const auto begin = text.find("://");
  const auto scheme = text.substr(0, begin);
  auto rest = begin == std::string::npos ? std::string() : text.substr(begin + 3);
  if (rest.ends_with('/')) rest.pop_back();
  auto place = rr::parse_host_port(rest);
  if (scheme != "rr+tcp" || !place)
    throw std::invalid_argument("listen on " + rr::quote(text) + ": expected \"rr+tcp://HOST:PORT\"");
  if (place->port != 0) place->port = static_cast<std::uint16_t>(place->port + number);
  const bool is_any = place->host == "0.0.0.0" || place->host == "::";
  const auto host = is_any                                       ? "127.0.0.1"
                    : place->host.find(':') == std::string::npos ? place->host
                                                                 : "[" + place->host + "]";
  return {scheme + "://" + rr::format_host_port(place->host, place->port), scheme + "://" + host};
}

/// Behind all of that name, not the first free one: where replays were recorded, clients see by the number which
/// service controls this one.
std::string control_name_beside(const std::vector<RecordedService>& recorded) {
  const std::string name = "replay";
  std::uint32_t last = 0;
  for (const auto& each : recorded) {
    const std::string_view text = each.service;
    std::uint32_t number = text == name ? 1 : 0;
    if (text.starts_with(name + "_")) std::from_chars(text.data() + name.size() + 1, text.data() + text.size(), number);
    last = std::max(last, number);
  }
  return last == 0 ? name : name + "_" + std::to_string(last + 1);
}

rr::Exception out_of_range(std::string what) {
  return rr::Exception(rr::make_error(rr::ErrorCode::out_of_range, std::move(what)));
}

}  // namespace

Replay::Replay(boost::asio::io_context& io, Recording recording, ReplayOptions options)
    : io_(io),
      options_(std::move(options)),
      player_(io, std::move(recording),
              {[this](const McapMessage& message, McapTime shift) { play(message, shift); },
               [this](std::uint16_t channel) { service_of(channel).forget(channel); }, [this] { tell_state(); },
               [this](const rr::Error& error) { report(error.message); }}),
      control_name_(control_name_beside(player_.recording().services())) {
  for (const auto& recorded : player_.recording().services()) {
    auto service = ReplayedService::make(player_.recording(), recorded);
    if (!service) throw std::invalid_argument(service.error().message);
    auto& node = node_of(recorded);
    node.node->add(service->service());
    node.services.insert(recorded.service);
    urls_.push_back(node.address + "service=" + rr::percent_encode(recorded.service));
    services_.push_back(std::move(*service));
  }
  tell_state();
}

/// A node has one service of a name: a further one that was recorded, by another URL for instance, is at a further
/// node.
Replay::Node& Replay::node_of(const RecordedService& recorded) {
  bool is_further = false;
  for (auto& node : nodes_) {
    if (node.recorded != recorded.node) continue;
    if (!node.services.contains(recorded.service)) return node;
    is_further = true;
  }
  rr::NodeOptions how;
  if (options_.keeps_ids && !is_further) how.id = recorded.node.id;
  how.report = [this](const std::string& problem) { report(problem); };
  auto node = std::make_unique<rr::Node>(io_, recorded.node.name, how);
  add_control(*node);
  auto address = listen(*node);
  nodes_.push_back({recorded.node, std::move(node), std::move(address)});
  return nodes_.back();
}

std::string Replay::listen(rr::Node& node) const {
  if (options_.listen == in_process) {
    node.listen(in_process);
    return node.listen_urls().front() + "&";
  }
  const auto address = address_of(options_.listen, nodes_.size());
  return address.reach + ":" + std::to_string(node.listen(address.listen)) + "/?";
}

void Replay::add_control(rr::Node& node) {
  auto control = rr::Service::from_text({std::string(robdef_replay)}, control_name_, "Replay");
  control->property("file").get([this] { return player_.recording().name(); });
  control->property("speed").get([this] { return player_.state().speed; }).set([this](double speed) {
    if (!(speed >= Player::min_speed && speed <= Player::max_speed))
      throw out_of_range("speed " + std::to_string(speed) + ", expected 0.001 to 1000");
    player_.set_speed(speed);
  });
  control->property("loop").get([this] { return player_.state().loops; }).set([this](bool loops) {
    player_.set_loops(loops);
  });
  control->function("play", [this] { player_.play(); });
  control->function("pause", [this] { player_.pause(); });
  control->function("seek", [this](double position) {
    const auto duration = player_.state().duration;
    if (!(position >= 0 && position <= duration))
      throw out_of_range("position " + std::to_string(position) + ", expected 0 to " + std::to_string(duration));
    player_.seek(position);
  });
  control->function("step", [this](std::uint32_t messages) {
    if (messages > Player::max_step)
      throw out_of_range(std::to_string(messages) + " messages, expected " + std::to_string(Player::max_step) +
                         " at most");
    player_.step(messages);
  });
  node.add(control);
  controls_.push_back(std::move(control));
}

void Replay::tell_state() {
  const auto state = player_.state();
  const rr::Structure value{"org.rrgate.replay.State",
                            {{"playing", state.is_playing},
                             {"position", state.position},
                             {"duration", state.duration},
                             {"speed", state.speed},
                             {"loop", state.loops}}};
  for (const auto& control : controls_) control->set_wire("state", value);
}

ReplayedService& Replay::service_of(std::uint16_t channel) {
  return *std::find_if(services_.begin(), services_.end(),
                       [channel](const ReplayedService& each) { return each.has(channel); });
}

void Replay::play(const McapMessage& message, McapTime shift) {
  const auto document = player_.recording().read_document(message);
  const auto played =
      document
          ? service_of(message.channel).play(message.channel, *document, to_time_spec(message.publish_time + shift))
          : rr::Result<>(document.error());
  if (played) return;
  const auto& topic = player_.recording().members().at(message.channel).topic;
  auto what = document ? player_.recording().name() + ": " + topic + ", message " + std::to_string(message.sequence) +
                             ": " + played.error().message
                       : played.error().message;
  if (problems_.insert(message.channel).second) report(what);
}

void Replay::report(const std::string& problem) const {
  if (options_.report) options_.report(problem);
}

void Replay::stop() {
  player_.pause();
  for (const auto& node : nodes_) node.node->stop();
}

}  // namespace rrgate
