// rr-test-service: offers experimental.interop as README.md describes it, on a free port of the loopback.
#include <unistd.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <functional>
#include <iostream>
#include <map>
#include <numeric>

#include "core/types/pack.hpp"
#include "node/service/node.hpp"
#include "node/service/password_file.hpp"
#include "node/tls/certificate_files.hpp"

namespace {

const std::string type_prefix = "experimental.interop.";

class Interop {
 public:
  explicit Interop(rr::Node& node) : service_(rr::Service::from_file(RR_INTEROP_ROBDEF, "interop", "Interop")) {
    add_stored_properties();
    add_other_properties();
    add_functions();
    add_objects();
    add_wires();
    add_pipes();
    add_generators();
    add_callbacks();
    add_memories();
    node.add(service_);
  }

 private:
  void add_stored_properties() {
    for (const auto& member : service_->types().find_entity(type_prefix + "Interop")->members) {
      if (member.name.rfind("p_", 0) != 0) continue;
      rr::Value& value = stored_[member.name];
      value = rr::default_value(member.type, service_->types());
      service_->property(member.name).get([&value] { return value; }).set([&value](rr::Value newer) {
        value = std::move(newer);
      });
    }
  }

  void add_other_properties() {
    service_->property("version").get([] { return "1"; });
    service_->property("secret").set([this](double value) { secret_ = value; });
    service_->property("seen_secret").get([this] { return secret_; });
    service_->property("seen_target").get([this] { return target_; });
  }

  void add_functions() {
    service_->function("nothing", [] {});
    service_->function("add", [](double left, double right) { return left + right; });
    service_->function("join", [](const rr::Value& words, const std::string& separator) {
      std::string joined;
      for (const auto& word : words.get_if<rr::List>()->items) {
        if (&word != words.get_if<rr::List>()->items.data()) joined += separator;
        joined += word.to_text().value();
      }
      return joined;
    });
    service_->function("shift", [](rr::Value pose, double dx, double dy) {
      for (auto& field : pose.get_if<rr::Structure>()->fields) {
        if (field.name == "px") field.value = field.value.to<double>().value() + dx;
        if (field.name == "py") field.value = field.value.to<double>().value() + dy;
      }
      return pose;
    });
    service_->function("ramp", [](std::uint32_t count) {
      std::vector<double> items(count);
      std::iota(items.begin(), items.end(), 0.0);
      return items;
    });
    service_->function("sum", [](const rr::Value& values) {  // as a value: the array is not copied
      const auto items = values.to_items<double>().value();
      return std::accumulate(items.begin(), items.end(), 0.0);
    });
    service_->function("echo", [](rr::Value value) { return value; });
    service_->function("fail", fail);
    service_->function("fire", [this](std::int32_t count) {
      for (std::int32_t i = 0; i < count; ++i)
        service_->fire("changed", static_cast<double>(i), "number " + std::to_string(i));
    });
    service_->function("clear", [this] { service_->fire("cleared"); });
  }

  static void fail(const std::string& kind, const std::string& text) {
    if (kind == "custom") throw rr::ServiceException(type_prefix + "InteropError", text);
    const std::map<std::string, rr::ErrorCode> codes{{"operation_failed", rr::ErrorCode::operation_failed},
                                                     {"invalid_argument", rr::ErrorCode::invalid_argument},
                                                     {"out_of_range", rr::ErrorCode::out_of_range},
                                                     {"not_implemented", rr::ErrorCode::not_implemented_error}};
    throw rr::ServiceException(text, codes.at(kind));
  }

  void add_objects() {
    service_->objref("head", make_part("Part", "head"));
    service_->objref("anything", make_part("SpecialPart", "special"));
    for (const std::string index : {"0", "1", "7"}) parts_[index] = make_part("Part", "number " + index);
    for (const std::string key : {"left", "right hand", "a.b"}) named_[key] = make_part("Part", "named " + key);
    service_->objref("parts", [this](std::string_view index) { return find(parts_, index); });
    service_->objref("named", [this](std::string_view key) { return find(named_, key); });
  }

  using Parts = std::map<std::string, std::shared_ptr<rr::Object>, std::less<>>;

  static std::shared_ptr<rr::Object> find(const Parts& parts, std::string_view index) {
    const auto found = parts.find(index);
    if (found == parts.end())
      throw rr::ServiceException("no part " + rr::quote(index), rr::ErrorCode::object_not_found);
    return found->second;
  }

  std::shared_ptr<rr::Object> make_part(const std::string& type, const std::string& name, bool has_inner = true) {
    auto part = service_->make_object(type);
    part->property("name").get([name] { return name; });
    const auto size = std::make_shared<double>(1);
    part->property("size").get([size] { return *size; }).set([size](double value) { *size = value; });
    part->function("identify", [name] { return "part " + name; });
    part->objref("inner", has_inner ? make_part("Part", name + ".inner", false) : nullptr);
    if (type == "SpecialPart") {
      const auto feature = std::make_shared<std::string>("none");
      part->property("feature").get([feature] { return *feature; }).set([feature](std::string value) {
        *feature = std::move(value);
      });
    }
    return part;
  }

  void add_wires() {
    service_->function("publish_state", [this](rr::Value value) { service_->set_wire("state", std::move(value)); });
    service_->function("publish_pose", [this](rr::Value value) { service_->set_wire("pose", std::move(value)); });
    service_->on_wire("target", [this](double value) { target_ = value; });
    service_->on_wire("both", [this](double value) { service_->set_wire("both", 2 * value); });
  }

  void add_callbacks() {
    service_->function("start_ask", [this](const std::string& question) {
      start("ask", question, [](const rr::Value& answer) { return answer.to<double>().value(); });
    });
    service_->function("start_notice", [this](std::int32_t number) {
      start("notice", number, [number](const rr::Value&) { return static_cast<double>(number); });
    });
    service_->property("answered").get([this] { return answered_; });
    service_->property("answer_error").get([this] { return answer_error_; });
  }

  template <class Read>
  void start(const char* callback, rr::Value argument, Read read) {
    answered_ = 0;
    answer_error_.clear();
    service_->call_callback(service_->current_client(), callback, {std::move(argument)},
                            [this, read](const rr::Result<rr::Value>& answer) {
                              if (answer)
                                answered_ = read(*answer);
                              else
                                answer_error_ = answer.error().qualified_name();
                            });
  }

  void add_pipes() {
    for (const char* pipe : {"doubled", "quick"})
      service_->pipe(pipe).on_packet([](const rr::PipeEndpoint& endpoint, double value) {
        if (value < 0) return endpoint.close();
        endpoint.send(rr::Value(2 * value)).value();
      });
    service_->pipe("greetings").on_connect([](const rr::PipeEndpoint& endpoint) {
      for (const char* word : {"hello", "world"}) endpoint.send(rr::Value(word)).value();
    });
    service_->pipe("taken")
        .on_connect([this](const rr::PipeEndpoint&) { sum_ = 0; })
        .on_packet([this](const rr::PipeEndpoint&, const rr::Value& packet) {
          const auto items = packet.to_items<double>().value();
          sum_ = std::accumulate(items.begin(), items.end(), sum_);
        });
    service_->property("seen_sum").get([this] { return sum_; });
    service_->function("publish_poses", [this](rr::Value pose, std::int32_t count) {
      for (std::int32_t i = 0; i < count; ++i) {
        for (auto& field : pose.get_if<rr::Structure>()->fields)
          if (field.name == "px") field.value = static_cast<double>(i);
        service_->pipe("poses").broadcast(pose, 3);
      }
    });
  }

  void add_generators() {
    service_->property("collected").get([this] { return collected_; });
    service_->property("generator_end").get([this] { return generator_end_; });
    service_->generator("count_up", [this](double first, std::int32_t count) {
      rr::Generator generator;
      generator.next = [first, count, i = 0](const rr::Value&) mutable -> rr::Result<std::optional<rr::Value>> {
        if (i < std::abs(count)) return std::optional<rr::Value>(first + i++);
        if (count < 0) throw rr::ServiceException("no more", rr::ErrorCode::out_of_range);
        return std::optional<rr::Value>();
      };
      generator.close = [this] { generator_end_ = "closed"; };
      generator.abort = [this] { generator_end_ = "aborted"; };
      return generator;
    });
    service_->generator("walk", [](rr::Value pose, std::int32_t count) {
      return [pose = std::move(pose), count]() mutable -> std::optional<rr::Value> {
        if (count-- == 0) return std::nullopt;
        rr::Value& px = pose.get_if<rr::Structure>()->fields[0].value;
        px = px.to<double>().value() + 1;
        return pose;
      };
    });
    service_->generator("scale", [](double factor) {
      return [factor](double value) -> std::optional<double> { return factor * value; };
    });
    service_->generator("collect", [this] {
      collected_.clear();
      return [this](const std::vector<double>& values) {
        collected_.insert(collected_.end(), values.begin(), values.end());
      };
    });
  }

  /// Numbers 0, 1, 2 ...; `each` in one item.
  template <class T>
  void add_numbers(const char* name, rr::MemoryShape dimensions, std::uint64_t each = 1) {
    auto memory = std::make_shared<rr::NumberMemory<T>>();
    memory->items.resize(std::accumulate(dimensions.begin(), dimensions.end(), each, std::multiplies<>()));
    std::iota(memory->items.begin(), memory->items.end(), T{});
    memory->dimensions = std::move(dimensions);
    service_->memory(name, std::move(memory));
  }

  void add_samples(const char* name, rr::MemoryShape dimensions) {
    const rr::NamedArray origin{type_prefix + "Vector3", rr::Array::take(std::vector<double>(3)), {}, true};
    const rr::Structure zero{{},
                             {{"id", rr::Value(std::int32_t{0})},
                              {"reading", rr::Value(std::vector<double>(3))},
                              {"tag", rr::Value(std::vector<std::uint8_t>())},
                              {"position", rr::Value(origin)}}};
    auto memory = std::make_shared<rr::PodMemory>();
    memory->items.assign(4, zero);
    memory->dimensions = std::move(dimensions);
    service_->memory(name, std::move(memory));
  }

  void add_memories() {
    add_numbers<double>("m_numbers", {100});
    add_numbers<std::int16_t>("m_grid", {4, 3, 2});
    add_numbers<double>("m_vectors", {5}, 3);
    add_numbers<double>("m_vector_grid", {2, 3}, 3);
    add_numbers<std::uint8_t>("m_fixed", {10});
    add_numbers<double>("m_large", {50'000});
    add_numbers<float>("m_volume", {60, 50, 40});
    add_samples("m_samples", {4});
    add_samples("m_sample_grid", {2, 2});
  }

  std::shared_ptr<rr::Service> service_;
  double sum_ = 0;
  double answered_ = 0;
  std::string answer_error_;
  std::map<std::string, rr::Value> stored_;
  double secret_ = 0;
  double target_ = 0;
  std::vector<double> collected_;
  std::string generator_end_;
  Parts parts_;
  Parts named_;
};

/// The services `guarded` and `open`.
class Guarded {
 public:
  Guarded(rr::Node& node, const std::string& name, rr::SecurityPolicy security)
      : service_(rr::Service::from_file(RR_INTEROP_ROBDEF, name, "Guarded")) {
    for (const auto& [member, begin] : {std::pair{"level", 1.5}, std::pair{"shown", 0.0}, std::pair{"quick", 0.0}}) {
      const auto value = std::make_shared<double>(begin);
      service_->property(member).get([value] { return *value; }).set([value](double newer) { *value = newer; });
    }
    service_->property("status").get([this] { return status_; }).set([this](std::int32_t value) { status_ = value; });
    service_->property("own").get([this] { return own_[service_->current_client()]; }).set([this](double value) {
      own_[service_->current_client()] = value;
    });
    service_->on_client_gone([this](rr::ClientId id) { own_.erase(id); });
    service_->function("who", [this] { return service_->current_caller().user; });
    service_->function("touch", [this] { return 1.5; });
    service_->set_wire("position", rr::Value(1.0));
    service_->set_wire("free_position", rr::Value(2.0));
    service_->objref("head", make_part("head"));
    service_->objref("parts",
                     [parts = std::map<std::string, std::shared_ptr<rr::Object>, std::less<>>{
                          {"1", make_part("number 1")}, {"10", make_part("number 10")}}](std::string_view index) {
                       return parts.at(std::string(index));
                     });
    service_->root().allow_monitor();
    service_->set_security(std::move(security));
    node.add(service_);
  }

 private:
  std::shared_ptr<rr::Object> make_part(const std::string& name) {
    auto part = service_->make_object("Part");
    part->property("name").get([name] { return name; });
    const auto size = std::make_shared<double>(1);
    part->property("size").get([size] { return *size; }).set([size](double value) { *size = value; });
    part->function("identify", [name] { return "part " + name; });
    part->objref("inner", std::shared_ptr<rr::Object>());
    return part;
  }

  std::shared_ptr<rr::Service> service_;
  std::int32_t status_ = 7;
  std::map<rr::ClientId, double> own_;
};

/// Name, hash of the password (secret, hunter2, toor, secret), privileges; bob's as our own files have it.
rr::SecurityPolicy make_security(bool require_valid_user, bool requires_verified_client = false) {
  const auto bob = rr::PasswordHash::make_scrypt("hunter2", {10, 8, 1}).value().text();
  const std::string users =
      "alice 5ebe2294ecd0e0f08eab7690d2a6ee69 objectlock\n"
      "bob " +
      bob +
      " objectlock\n"
      "root 7b24afc8bc80e548d66c4e7ff72171c5 objectlock,objectlockoverride\n"
      "guest 5ebe2294ecd0e0f08eab7690d2a6ee69 _\n";
  rr::SecurityPolicy policy;
  policy.authenticator = rr::PasswordFileAuthenticator::from_text(
                             users, {.accepts_md5 = true, .requires_verified_client = requires_verified_client})
                             .value();
  policy.require_valid_user = require_valid_user;
  policy.allow_object_lock = true;
  return policy;
}

constexpr std::string_view everywhere = "--robotraconteur-tcp-listen-localhost=false";
constexpr std::string_view enable_local = "--robotraconteur-local-enable=true";

rr::NodeOptions parse_options(int argc, char** argv) {
  rr::NodeOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    constexpr std::string_view allow_origin = "--allow-origin=";
    if (argument.starts_with(allow_origin)) options.allowed_origins.emplace_back(argument.substr(allow_origin.size()));
    constexpr std::string_view node_id = "--robotraconteur-nodeid=";
    if (argument.starts_with(node_id)) options.id = rr::parse_node_id(argument.substr(node_id.size())).value();
    if (argument == "--robotraconteur-load-tls=true") options.tls = rr::load_node_tls(options.id).value();
    if (argument == enable_local) options.keeps_id = true;
    if (argument == "--robotraconteur-require-tls=true") options.require_tls = true;
    if (argument == "--robotraconteur-disable-message4=true") options.features.v4 = false;
    if (argument == "--robotraconteur-disable-stringtable=true")
      options.features.string_table = {.local = false, .standard = false};
  }
  return options;
}

/// "0", any, unless an option names one.
std::string read_port(int argc, char** argv) {
  constexpr std::string_view port = "--robotraconteur-tcp-port=";
  for (int i = 1; i < argc; ++i)
    if (const std::string_view argument = argv[i]; argument.starts_with(port))
      return std::string(argument.substr(port.size()));
  return "0";
}

/// Stops the node when standard input ends.
void watch_input(rr::Node& node, boost::asio::posix::stream_descriptor& input, std::array<char, 64>& buffer) {
  input.async_read_some(boost::asio::buffer(buffer), [&](const boost::system::error_code& error, std::size_t) {
    if (error == boost::asio::error::operation_aborted) return;
    if (error)
      node.stop();
    else
      watch_input(node, input, buffer);
  });
}

}  // namespace

int main(int argc, char** argv) {
  try {
    rr::Node node("interop.service", parse_options(argc, argv));
    const Interop interop(node);
    const Guarded guarded(node, "guarded", make_security(true));
    const Guarded open(node, "open", make_security(false));
    const Guarded proven(node, "proven", make_security(true, true));
    const bool is_alone = std::find(argv + 1, argv + argc, everywhere) == argv + argc;
    const auto url = (is_alone ? "rr+tcp://127.0.0.1:" : "rr+tcp://0.0.0.0:") + read_port(argc, argv);
    const std::string port = std::to_string(node.listen(url));
    if (std::find(argv + 1, argv + argc, enable_local) != argv + argc) node.listen("rr+local:///");
    std::cout << R"({"port": )" << port << R"(, "url": "rr+tcp://127.0.0.1:)" << port << R"(/?service=interop"})"
              << std::endl;
    boost::asio::posix::stream_descriptor input(node.io_context());
    boost::system::error_code error;
    std::array<char, 64> buffer{};
    input.assign(::dup(STDIN_FILENO), error);
    if (!error) watch_input(node, input, buffer);  // a file or /dev/null cannot be watched: SIGTERM ends it then
    node.run();
  } catch (const std::exception& failure) {
    std::cerr << "rr-test-service: " << failure.what() << '\n';
    return 1;
  }
}
