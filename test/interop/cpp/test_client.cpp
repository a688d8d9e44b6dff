// rr-test-client URL: carries out the steps of one scenario (README.md, "The client").
#include <iostream>
#include <map>

#include "node/client/client.hpp"
#include "node/tls/certificate_files.hpp"
#include "test/interop/cpp/plain_value.hpp"
#include "test/interop/cpp/scenario_value.hpp"

namespace {

/// For all connections; set by the command line.
rr::ConnectOptions connect_options;
bool tells_when_connected = false;

using nlohmann::json;

constexpr std::chrono::seconds patience{10};

class Client {
 public:
  explicit Client(const std::string& url) : url_(url), root_(rr::connect(url, connect_options)) {}

  json carry_out(const json& step) {
    const rr::RemoteObject target = find(step);
    for (const auto& [verb, carry_out] : verbs())
      if (step.contains(verb)) return (this->*carry_out)(target, step.at(verb).get<std::string>(), step);
    throw std::invalid_argument("unknown step " + step.dump());
  }

 private:
  using Verb = json (Client::*)(const rr::RemoteObject&, const std::string&, const json&);

  static const std::map<std::string, Verb>& verbs() {
    static const std::map<std::string, Verb> table{{"get", &Client::get},
                                                   {"set", &Client::set},
                                                   {"call", &Client::call},
                                                   {"get_until", &Client::get_until},
                                                   {"listen", &Client::listen},
                                                   {"events", &Client::events},
                                                   {"connect", &Client::connect},
                                                   {"close", &Client::close},
                                                   {"in_value", &Client::in_value},
                                                   {"out_value", &Client::out_value},
                                                   {"peek_in", &Client::peek_in},
                                                   {"peek_out", &Client::peek_out},
                                                   {"poke_out", &Client::poke_out},
                                                   {"open", &Client::open},
                                                   {"leave", &Client::leave},
                                                   {"login", &Client::login},
                                                   {"logout", &Client::logout},
                                                   {"lock", &Client::lock},
                                                   {"unlock", &Client::unlock},
                                                   {"enter", &Client::enter},
                                                   {"exit", &Client::exit},
                                                   {"open_pipe", &Client::open_pipe},
                                                   {"send", &Client::send},
                                                   {"packets", &Client::packets},
                                                   {"close_pipe", &Client::close_pipe},
                                                   {"closed", &Client::closed},
                                                   {"generate", &Client::generate},
                                                   {"next", &Client::next},
                                                   {"close_generator", &Client::close_generator},
                                                   {"abort_generator", &Client::abort_generator},
                                                   {"answer", &Client::answer},
                                                   {"asked", &Client::asked},
                                                   {"dimensions", &Client::dimensions},
                                                   {"read_memory", &Client::read_memory},
                                                   {"write_memory", &Client::write_memory}};
    return table;
  }

  rr::RemoteObject find(const json& step) const {
    rr::RemoteObject object = step.contains("by") ? others_.at(step.at("by").get<std::string>()) : root_;
    for (const auto& part : step.value("on", json::array())) {
      if (part.is_string())
        object = object.object(part.get<std::string>());
      else if (part.at(1).is_string())
        object = object.object(part.at(0).get<std::string>(), part.at(1).get<std::string>());
      else
        object = object.object(part.at(0).get<std::string>(), std::to_string(part.at(1).get<int>()));
    }
    return object;
  }

  bool wait(const std::function<bool()>& is_done) { return root_.connection().run_until(is_done, patience); }

  // properties and functions

  json get(const rr::RemoteObject& target, const std::string& member, const json&) {
    return to_plain(target.get(member));
  }

  json set(const rr::RemoteObject& target, const std::string& member, const json& step) {
    target.set(member, from_scenario(step.at("value")));
    return nullptr;
  }

  static std::vector<rr::Value> arguments_of(const json& step) {
    std::vector<rr::Value> arguments;
    for (const auto& argument : step.value("args", json::array())) arguments.push_back(from_scenario(argument));
    return arguments;
  }

  json call(const rr::RemoteObject& target, const std::string& member, const json& step) {
    const rr::Value result = target.call_values(member, arguments_of(step));
    return step.value("digest", false) ? to_digest(result) : to_plain(result);
  }

  json get_until(const rr::RemoteObject& target, const std::string& member, const json& step) {
    json value;
    const auto deadline = std::chrono::steady_clock::now() + patience;
    do value = to_plain(target.get(member));
    while (value != step.at("until") && std::chrono::steady_clock::now() < deadline);
    return value;
  }

  // generators

  json generate(const rr::RemoteObject& target, const std::string& member, const json& step) {
    generators_.insert_or_assign(step.at("as").get<std::string>(), target.generator_values(member, arguments_of(step)));
    return nullptr;
  }

  json next(const rr::RemoteObject&, const std::string& name, const json& step) {
    rr::RemoteGenerator& generator = generators_.at(name);
    const auto value = step.contains("value") ? generator.next(from_scenario(step.at("value"))) : generator.next();
    if (!value) throw rr::ClientException({rr::ErrorCode::stop_iteration, {}});
    return to_plain(*value);
  }

  json close_generator(const rr::RemoteObject&, const std::string& name, const json&) {
    generators_.at(name).close();
    return nullptr;
  }

  json abort_generator(const rr::RemoteObject&, const std::string& name, const json&) {
    generators_.at(name).abort();
    return nullptr;
  }

  // memories

  json dimensions(const rr::RemoteObject& target, const std::string& member, const json&) {
    return target.memory(member).dimensions();
  }

  json read_memory(const rr::RemoteObject& target, const std::string& member, const json& step) {
    const rr::Value items =
        target.memory(member).read(step.at("position").get<rr::MemoryShape>(), step.at("size").get<rr::MemoryShape>());
    return step.value("digest", false) ? to_digest(items) : to_plain(items);
  }

  json write_memory(const rr::RemoteObject& target, const std::string& member, const json& step) {
    target.memory(member).write(step.at("position").get<rr::MemoryShape>(), from_scenario(step.at("value")));
    return nullptr;
  }

  // events

  json listen(const rr::RemoteObject& target, const std::string& member, const json&) {
    json& seen = events_[member] = json::array();
    target.on_event(member, [&seen](std::span<const rr::Value> arguments) {
      json happened = json::array();
      for (const auto& argument : arguments) happened.push_back(to_plain(argument));
      seen.push_back(std::move(happened));
    });
    return nullptr;
  }

  json events(const rr::RemoteObject&, const std::string& member, const json& step) {
    const json& seen = events_.at(member);
    wait([&] { return seen.size() >= step.at("count").get<std::size_t>(); });
    return {{"list", seen}};
  }

  // wires

  json connect(const rr::RemoteObject& target, const std::string& member, const json&) {
    json& newest = in_values_[member] = nullptr;
    target.connect_wire(member, [&newest](const rr::Value& value, rr::TimeSpec) { newest = to_plain(value); });
    return nullptr;
  }

  json close(const rr::RemoteObject& target, const std::string& member, const json&) {
    target.disconnect_wire(member);
    return nullptr;
  }

  json in_value(const rr::RemoteObject&, const std::string& member, const json& step) {
    const json& newest = in_values_.at(member);
    wait([&] { return newest == step.at("until"); });
    return newest;
  }

  json out_value(const rr::RemoteObject& target, const std::string& member, const json& step) {
    target.send_wire(member, from_scenario(step.at("value")));
    return nullptr;
  }

  json peek_in(const rr::RemoteObject& target, const std::string& member, const json&) {
    return to_plain(target.peek_in(member));
  }

  json peek_out(const rr::RemoteObject& target, const std::string& member, const json&) {
    return to_plain(target.peek_out(member));
  }

  json poke_out(const rr::RemoteObject& target, const std::string& member, const json& step) {
    target.poke_out(member, from_scenario(step.at("value")));
    return nullptr;
  }

  // callbacks

  json answer(const rr::RemoteObject& target, const std::string& member, const json& step) {
    json& seen = callbacks_.try_emplace(member, json::array()).first->second;
    target.on_callback_values(member, [&seen, step](std::span<const rr::Value> arguments) -> rr::Result<rr::Value> {
      json called = json::array();
      for (const auto& argument : arguments) called.push_back(to_plain(argument));
      seen.push_back(std::move(called));
      if (step.contains("fail"))
        return rr::make_error(rr::ErrorCode::operation_failed, step.at("fail").get<std::string>());
      return from_scenario(step.at("value"));
    });
    return nullptr;
  }

  json asked(const rr::RemoteObject&, const std::string& member, const json& step) {
    const json& seen = callbacks_.at(member);
    wait([&] { return seen.size() >= step.at("count").get<std::size_t>(); });
    return {{"list", seen}};
  }

  // pipes

  json open_pipe(const rr::RemoteObject& target, const std::string& member, const json& step) {
    Pipe& pipe = pipes_[step.at("as").get<std::string>()];
    pipe.packets = json::array();
    pipe.endpoint = target.connect_pipe(
        member, [&pipe](const rr::Value& packet) { pipe.packets.push_back(to_plain(packet)); },
        step.value("index", rr::any_pipe_index));
    return pipe.endpoint->index();
  }

  json send(const rr::RemoteObject&, const std::string& name, const json& step) {
    for (const auto& value : step.at("values")) pipes_.at(name).endpoint->send(from_scenario(value));
    return nullptr;
  }

  json packets(const rr::RemoteObject&, const std::string& name, const json& step) {
    const json& seen = pipes_.at(name).packets;
    wait([&] { return seen.size() >= step.at("count").get<std::size_t>(); });
    return {{"list", seen}};
  }

  json close_pipe(const rr::RemoteObject&, const std::string& name, const json&) {
    pipes_.at(name).endpoint->close();
    return nullptr;
  }

  json closed(const rr::RemoteObject&, const std::string& name, const json&) {
    return wait([&] { return !pipes_.at(name).endpoint->is_open(); });
  }

  struct Pipe {
    std::optional<rr::RemotePipe> endpoint;
    json packets;
  };

  // further clients, logins, locks

  json open(const rr::RemoteObject&, const std::string& name, const json& step) {
    std::string url = url_;
    url.replace(url.find("service=interop"), std::string::npos, "service=" + step.at("service").get<std::string>());
    const auto text = [&step](const char* key) { return step.at(key).get<std::string>(); };
    others_.insert_or_assign(name, step.contains("username")
                                       ? rr::connect(url, text("username"), text("password"), connect_options)
                                       : rr::connect(url, connect_options));
    return nullptr;
  }

  json leave(const rr::RemoteObject&, const std::string& name, const json&) {
    others_.at(name).connection().close();
    others_.erase(name);
    return nullptr;
  }

  json login(const rr::RemoteObject& target, const std::string& username, const json& step) {
    target.connection().authenticate(username, step.at("password").get<std::string>());
    return nullptr;
  }

  json logout(const rr::RemoteObject& target, const std::string&, const json&) {
    target.connection().logout();
    return nullptr;
  }

  json lock(const rr::RemoteObject& target, const std::string& kind, const json&) {
    target.lock(kind == "user" ? rr::LockKind::user : rr::LockKind::client);
    return nullptr;
  }

  json unlock(const rr::RemoteObject& target, const std::string&, const json&) {
    target.unlock();
    return nullptr;
  }

  json enter(const rr::RemoteObject& target, const std::string& name, const json& step) {
    monitors_.emplace(name, target.enter_monitor(std::chrono::milliseconds(step.at("timeout").get<int>())));
    return nullptr;
  }

  json exit(const rr::RemoteObject&, const std::string& name, const json&) {
    auto monitor = std::move(monitors_.extract(name).mapped());
    monitor.exit();
    return nullptr;
  }

  std::string url_;
  // What handlers write to outlives the connections, whose ends may still call them.
  std::map<std::string, json> callbacks_;  ///< calls, by callback
  std::map<std::string, json> events_;     ///< by event
  std::map<std::string, json> in_values_;  ///< by wire
  rr::RemoteObject root_;
  std::map<std::string, rr::RemoteObject> others_;    ///< roots of further clients
  std::map<std::string, rr::MonitorGuard> monitors_;  ///< by the name that the scenario gives
  std::map<std::string, Pipe> pipes_;                 ///< by the name that the scenario gives
  std::map<std::string, rr::RemoteGenerator> generators_;
};

json error_of(const rr::ClientException& exception) {
  return {{"name", exception.error().qualified_name()}, {"message", exception.error().message}};
}

json run_scenario(const std::string& url, const json& steps) {
  json results = json::array();
  try {
    Client client(url);
    if (tells_when_connected) std::cout << R"({"connected": true})" << std::endl;
    for (const auto& step : steps) {
      try {
        results.push_back({{"value", client.carry_out(step)}});
      } catch (const rr::ClientException& failure) {
        results.push_back({{"error", error_of(failure)}});
      }
    }
  } catch (const rr::ClientException& failure) {
    return {{"connect_error", error_of(failure)}};
  }
  return {{"results", results}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: rr-test-client URL [--robotraconteur-nodeid=ID --robotraconteur-load-tls=true]\n"
                 "                      [--heartbeat-ms=N] [--tell] < scenario.json\n";
    return 2;
  }
  try {
    for (int i = 2; i < argc; ++i) {
      const std::string_view argument = argv[i];
      constexpr std::string_view node_id = "--robotraconteur-nodeid=";
      if (argument.substr(0, node_id.size()) == node_id)
        connect_options.connection.self.id = rr::parse_node_id(argument.substr(node_id.size())).value();
      constexpr std::string_view heartbeat = "--heartbeat-ms=";
      if (argument.substr(0, heartbeat.size()) == heartbeat) {
        const std::chrono::milliseconds period(std::stoi(std::string(argument.substr(heartbeat.size()))));
        connect_options.heartbeat = rr::Heartbeat{period, period * 3 / 2};  // as of the protocol's own figures
      }
      if (argument == "--robotraconteur-load-tls=true")
        connect_options.dial.tls = rr::load_node_tls(connect_options.connection.self.id).value();
      if (argument == "--tell") tells_when_connected = true;
    }
    std::cout << run_scenario(argv[1], json::parse(std::cin).at("steps")) << std::endl;
  } catch (const std::exception& failure) {
    std::cerr << "rr-test-client: " << failure.what() << '\n';
    return 1;
  }
}
