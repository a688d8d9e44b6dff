// A hostile device against the gateway: what a device that behaves says is changed on its way, entry by entry and
// element by element, left out, said twice, in another order, or replaced; meanwhile clients of all faces use it.
// Nothing of that ends the gateway, makes it hold much memory, or keeps it busy for long.
//
// Input: choices of what clients do and of what becomes of each message.
#include <sys/socket.h>
#include <time.h>

#include <boost/asio/post.hpp>
#include <optional>

#include "core/wire/frame_scanner.hpp"
#include "node/service/memory.hpp"
#include "node/service/node.hpp"
#include "node/transport/socket_stream.hpp"
#include "node/transport/wrapped_stream.hpp"
#include "test/fuzz/inside_gateway.hpp"
#include "test/fuzz/memory_bound.hpp"
#include "test/fuzz/message_changes.hpp"

namespace {

using namespace rr::fuzz;
using rr::test::Choices;
using rr::test::require;

const std::string definition = R"(service test.hostile
stdver 0.10
struct Pose
  field double x
  field double[] joints
end
struct Image
  field uint32 width
  field uint32 height
  field string encoding
  field uint8[] data
end
object Tool
  property double speed
  function void stop()
  wire double torque
end
object Arm
  property double speed
  property Pose pose
  property varvalue any
  property Pose{string} poses
  function double add(double a, double b)
  function int32{generator} count()
  event bumped(int32 side, string what)
  objref Tool tool
  objref Tool{string} tools
  wire Pose state [readonly]
  wire Image live [readonly]
  wire double aim
  pipe double samples
  memory int16[*] grid
  callback double ask(string question)
end
)";

/// A device that behaves.
class Arm {
 public:
  Arm() {
    auto& root = service->root();
    pose_ = rr::Structure{"test.hostile.Pose", {{"x", 1.0}, {"joints", rr::Value(std::vector<double>{1, 2})}}};
    root.property("speed").get([] { return 1.0; }).set([](double) {});
    root.property("pose").get([this] { return pose_; }).set([](const rr::Value&) {});
    root.property("any").get([] { return rr::Value("text"); }).set([](const rr::Value&) {});
    root.property("poses")
        .get([this] {
          rr::MapString out;
          out.items.emplace_back("a", rr::Value(pose_));
          return rr::Value(out);
        })
        .set([](const rr::Value&) {});
    root.function("add", [this](double a, double b) {
      caller = service->current_client();
      return a + b;
    });
    root.generator(
        "count", [] { return [n = 0]() mutable { return n < 3 ? std::optional<std::int32_t>(++n) : std::nullopt; }; });
    tool_ = service->make_object("Tool");
    tool_->property("speed").get([] { return 2.0; }).set([](double) {});
    tool_->function("stop", [] {});
    tool_->on_wire("torque", [](double) {});
    root.objref("tool", tool_);
    root.objref("tools", [this](std::string_view) { return tool_; });
    root.on_wire("aim", [](double) {});
    root.pipe("samples").on_packet([](const rr::PipeEndpoint&, double) {});
    const auto grid = std::make_shared<rr::NumberMemory<std::int16_t>>();
    grid->dimensions = {2, 2};
    grid->items = {1, 2, 3, 4};
    root.memory("grid", grid);
    say();
  }
  /// What no client has asked for.
  void say() {
    auto& root = service->root();
    root.set_wire("state", pose_);
    root.set_wire("live", rr::Structure{"test.hostile.Image",
                                        {{"width", std::uint32_t{2}},
                                         {"height", std::uint32_t{1}},
                                         {"encoding", "mono8"},
                                         {"data", rr::Value(std::vector<std::uint8_t>{7, 8})}}});
    root.set_wire("aim", 0.5);
    root.fire("bumped", 1, "hard");
    for (const auto& endpoint : root.pipe("samples").endpoints()) static_cast<void>(endpoint.send(0.25));
  }
  std::shared_ptr<rr::Service> service = rr::Service::from_text({definition}, "arm", "Arm");
  rr::ClientId caller = 0;  ///< who has called add() last

 private:
  rr::Structure pose_;
  std::shared_ptr<rr::Object> tool_;
};

/// What becomes of the messages of one input's device, on all of its connections.
class Malice {
 public:
  explicit Malice(Choices& choices) : choices_(choices) {}
  bool is_over() const { return is_over_; }
  void end() { is_over_ = true; }

  /// What is said instead of `message`; nullopt: the connection is closed.
  std::optional<rr::Bytes> instead(rr::ByteSpan message) {
    const rr::Bytes as_it_was(message.begin(), message.end());
    if (is_over_ || choices_.empty()) return as_it_was;
    rr::Bytes out = std::exchange(held_back_, {});
    const auto add = [&out](const rr::Bytes& bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); };
    const auto what = choices_.byte();
    if (what >= 0xfe) return std::nullopt;
    if (what >= 0x40 && what < 0xb0) {
      add(changed(message, 1 + what % 3));
    } else if (what >= 0xb0 && what < 0xc0) {
      add(as_it_was);
      add(what % 2 ? as_it_was : changed(message, 1));
    } else if (what >= 0xc0 && what < 0xc4) {  // it is lost
    } else if (what >= 0xc4 && what < 0xcc) {
      held_back_ = as_it_was;
    } else if (what >= 0xcc && what < 0xe8) {
      add(forged(message));
      if (what % 2) add(as_it_was);
    } else if (what >= 0xe8 && what < 0xf8) {
      auto bytes = as_it_was;
      for (int left = 1 + what % 4; left > 0; --left) bend_number(bytes, pick());
      add(bytes);
    } else if (what >= 0xf8) {
      const auto raw = choices_.bytes(choices_.byte());
      out.insert(out.end(), raw.begin(), raw.end());
    } else {
      add(as_it_was);
    }
    return out;
  }

 private:
  Pick pick() {
    return [this](std::uint32_t below) {
      const auto low = choices_.byte();
      return (below > 256 ? low | choices_.byte() << 8 : low) % below;
    };
  }
  rr::Bytes changed(rr::ByteSpan message, int count) {
    rr::Message decoded;
    rr::Bytes bytes(message.begin(), message.end());
    if (!rr::decode(bytes, {.string_table = {true, true}}, decoded)) return bytes;
    MessageTree tree(decoded);
    for (; count > 0; --count) tree.change(pick());
    auto out = tree.encode();
    return out.empty() ? bytes : out;
  }
  /// Something else from the same sender.
  rr::Bytes forged(rr::ByteSpan message) {
    rr::Message decoded;
    const rr::Bytes bytes(message.begin(), message.end());
    if (!rr::decode(bytes, {.string_table = {true, true}}, decoded)) return bytes;
    rr::Message lie;
    lie.header = decoded.header;
    const auto type = choices_.byte();
    const auto number = type < 0x10 ? 100 + type : 1100 + (type % 64) * 8 + choices_.byte() % 8;
    constexpr std::string_view members[] = {"speed",   "pose", "any",   "poses",  "add",  "count",
                                            "bumped",  "tool", "tools", "state",  "live", "aim",
                                            "samples", "grid", "ask",   "torque", "stop"};
    constexpr std::string_view paths[] = {"arm", "arm.tool", "arm.tools[a]", "RobotRaconteurServiceIndex"};
    const auto same_request = decoded.entries.empty() ? 0 : decoded.entries[0].request_id;
    const auto path = choices_.word(paths);
    const auto member = choices_.word(members);
    auto& entry = lie.begin_entry(static_cast<rr::EntryType>(number), path, member,
                                  choices_.byte() < 0x80 ? same_request : choices_.byte());
    if (choices_.byte() > 0xe0) entry.error = static_cast<rr::ErrorCode>(choices_.byte());
    rr::test::add_elements(lie, choices_, choices_.byte() % 4);
    rr::EncodedMessage encoded;
    return rr::encode(lie, {}, encoded) ? encoded.to_bytes() : bytes;
  }

  Choices& choices_;
  rr::Bytes held_back_;
  bool is_over_ = false;
};

/// The gateway's end of a connection to the device, where messages of the device are changed.
class BentStream final : public rr::WrappedStream {
 public:
  BentStream(std::unique_ptr<rr::ByteStream> inner, std::shared_ptr<Malice> malice)
      : WrappedStream(std::move(inner)), malice_(std::move(malice)) {}

  rr::awaitable<rr::ReadResult> read_some(std::span<std::uint8_t> into) override {
    while (changed_.empty() && !is_cut_) {
      std::array<std::uint8_t, 16384> buffer;
      const auto read = co_await inner_->read_some(buffer);
      if (read.bytes == 0) co_return read;
      for (rr::ByteSpan rest = rr::ByteSpan(buffer).first(read.bytes); !rest.empty() && !is_cut_;) {
        const auto taken = scanner_.feed(rest);
        require(taken.has_value(), "the device behaves before its messages are changed");
        rest = rest.subspan(*taken);
        if (const auto message = scanner_.message()) bend(*message);
      }
    }
    if (changed_.empty()) {
      inner_->close();
      co_return rr::ReadResult{};
    }
    const auto count = std::min(into.size(), changed_.size());
    std::copy_n(changed_.begin(), count, into.begin());
    changed_.erase(changed_.begin(), changed_.begin() + static_cast<std::ptrdiff_t>(count));
    co_return rr::ReadResult{{}, count};
  }
  std::string peer() const override { return "the device"; }

 private:
  void bend(rr::ByteSpan message) {
    const auto instead = malice_->instead(message);
    if (!instead) {
      is_cut_ = true;
      return;
    }
    changed_.insert(changed_.end(), instead->begin(), instead->end());
  }

  std::shared_ptr<Malice> malice_;
  rr::FrameScanner scanner_;
  rr::Bytes changed_;
  bool is_cut_ = false;
};

constexpr std::chrono::milliseconds patience{20};
constexpr double most_cpu_seconds = 5;

class Site {
 public:
  Site() {
    rrgate::configure_log("error", "text");
    node_.add(arm.service);
    rrgate::Config config;
    config.mcp.is_enabled = true;
    config.mcp.longest_wait = patience;
    config.timeouts.connect = std::chrono::milliseconds(100);
    config.retry = {std::chrono::milliseconds(20), std::chrono::milliseconds(50), std::chrono::milliseconds(50)};
    gateway_.emplace(io, std::move(config));
    gateway_->start().value();
  }

  /// A device of the gateway that is reached by this malice.
  std::shared_ptr<rrgate::PageLink> connect(const std::string& name, std::shared_ptr<Malice> malice) {
    auto link = std::make_shared<std::weak_ptr<rrgate::PageLink>>();
    rrgate::PageLink::Page page{.ask =
                                    [this, link, malice](const std::string& key) {
                                      if (const auto here = link->lock()) here->take(key, dial(malice));
                                    },
                                .silent = [] {}};
    auto made = std::make_shared<rrgate::PageLink>(io.get_executor(), patience, std::move(page));
    *link = made;
    rrgate::DeviceConfig config;
    config.name = name;
    config.url.scheme = "page";
    config.url.host = name;
    config.is_served = true;
    config.mode = rrgate::DeviceMode::shared;
    gateway_->devices().add(std::move(config), nullptr, made);
    return made;
  }

  rrgate::Gateway& gateway() { return *gateway_; }
  boost::asio::io_context io{1};
  Arm arm;

 private:
  std::unique_ptr<rr::ByteStream> dial(std::shared_ptr<Malice> malice) {
    int pair[2];
    require(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) == 0, "there are sockets");
    const auto stream_of = [this](int socket) {
      return std::make_unique<rr::SocketStream>(rr::SocketStream::Socket(io, {AF_UNIX, 0}, socket), "inside",
                                                std::chrono::seconds(5));
    };
    node_.accept(stream_of(pair[0]), "rr+tcp://127.0.0.1:1/");
    return std::make_unique<BentStream>(stream_of(pair[1]), std::move(malice));
  }

  rr::Node node_{io, "test.hostile"};
  std::optional<rrgate::Gateway> gateway_;
};

constexpr std::string_view requests[] = {"GET ",
                                         "GET /arm",
                                         "GET /arm/speed",
                                         "PUT /arm/speed",
                                         "GET /arm/pose",
                                         "PUT /arm/pose",
                                         "GET /arm/any",
                                         "GET /arm/poses",
                                         "POST /arm/add",
                                         "POST /arm/count",
                                         "GET /arm/bumped",
                                         "GET /arm/state",
                                         "GET /arm/live?as=mjpeg",
                                         "GET /arm/samples",
                                         "GET /arm/grid",
                                         "GET /arm/grid/shape",
                                         "PUT /arm/grid?offset=0,0",
                                         "GET /arm/tool",
                                         "GET /arm/tools/a/speed",
                                         "POST /arm/tool/stop",
                                         "GET /openapi.json",
                                         "GET /asyncapi.json",
                                         "GET /thing-description.json",
                                         "GET /types.d.ts",
                                         "GET /test.hostile.robdef",
                                         "GET /subscriptions"};
constexpr std::string_view bodies[] = {"1.5", R"({"a": 1, "b": 2})", R"({"x": 1, "joints": [1]})", "{}", "[[1]]"};
constexpr std::string_view operations[] = {R"("op":"subscribe","path":"bumped")",
                                           R"("op":"subscribe","path":"state")",
                                           R"("op":"subscribe","path":"samples")",
                                           R"("op":"callback","path":"ask")",
                                           R"("op":"open","path":"count")",
                                           R"("op":"next","generator":1)",
                                           R"("op":"send","path":"aim","value":1)",
                                           R"("op":"send","path":"samples","value":1)",
                                           R"("op":"get","path":"pose")",
                                           R"("op":"set","path":"any","value":{"type":"string","value":"x"})",
                                           R"("op":"call","path":"add","args":{"a":1,"b":2})",
                                           R"("op":"describe","path":"")",
                                           R"("op":"lock","path":"")",
                                           R"("op":"lease","path":"tool")",
                                           R"("op":"read","path":"grid","offset":[0,0],"count":[1,1])",
                                           R"("op":"shape","path":"grid")",
                                           R"("op":"subscribe","path":"tool/torque")",
                                           R"("op":"subscribe","path":"live")"};
constexpr std::string_view tools[] = {R"("name":"describe","arguments":{"path":"arm",)",
                                      R"("name":"describe","arguments":{"path":"arm/pose",)",
                                      R"("name":"read","arguments":{"path":"arm/pose",)",
                                      R"("name":"read","arguments":{"path":"arm/live",)",
                                      R"("name":"wait_for_event","arguments":{"path":"arm/bumped","seconds":0.01,)",
                                      R"("name":"look","arguments":{"path":"arm/live",)"};

/// What clients do with the device.
class Using {
 public:
  Using(Site& site, Choices choices) : site_(site), choices_(choices) {
    static unsigned last = 0;
    name_ = "d" + std::to_string(++last);
    link_ = site_.connect(name_, malice_);
  }
  ~Using() {
    // On the loop, as all that is asked of a device is.
    boost::asio::post(site_.io, [this] {
      malice_->end();
      clients_.clear();
      link_->close();
      site_.gateway().devices().remove(*site_.gateway().devices().find(name_));
    });
    settle(site_.io);
  }
  Using(const Using&) = delete;
  Using& operator=(const Using&) = delete;

  void run() {
    const auto device = site_.gateway().devices().find(name_)->shared_from_this();
    const auto is_known = [&] { return device->state() != rrgate::DeviceState::connecting; };
    run_until(site_.io, patience * 5, is_known);
    for (int count = 0; count < 12 && !choices_.empty(); ++count) act();
  }

 private:
  void act() {
    const auto what = choices_.byte();
    if (what < 0x80) return ask();
    if (what < 0xa0) return open_socket();
    if (what < 0xd8) return talk();
    if (what < 0xe8) return ask_as_agent();
    site_.arm.say();
    if (what > 0xf0 && site_.arm.caller != 0)
      site_.arm.service->root().call_callback(site_.arm.caller, "ask", {"why"}, [](const rr::Result<rr::Value>&) {});
    settle(site_.io);
  }
  void ask() {
    const auto chosen = requests[choices_.byte() % std::size(requests)];
    const auto split = chosen.find(' ');
    const auto method = chosen.substr(0, split);
    const std::string body(method == "GET" ? "" : bodies[choices_.byte() % std::size(bodies)]);
    const bool is_stream = choices_.byte() > 0xc0;
    send(std::string(method) + " /api/v1/devices/" + name_ + std::string(chosen.substr(split + 1)) +
             " HTTP/1.1\r\nHost: localhost\r\n" + (is_stream ? "Accept: text/event-stream\r\n" : ""),
         body);
  }
  void ask_as_agent() {
    send("POST /mcp HTTP/1.1\r\nHost: localhost\r\n", R"({"jsonrpc":"2.0","id":1,"method":"tools/call","params":{)" +
                                                          std::string(tools[choices_.byte() % std::size(tools)]) +
                                                          "\"device\":\"" + name_ + "\"}}}");
  }
  void send(std::string head, const std::string& body) {
    if (!body.empty())
      head += "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
    InsideClient client(site_.io, site_.gateway());
    client.send(head + "\r\n" + body);
    const auto is_over = [&] {
      const auto answer = read_answer(client.received(), "GET");
      return client.has_ended() || answer.is_whole || answer.is_stream;
    };
    run_until(site_.io, patience, is_over);
    const auto answer = read_answer(client.received(), "GET");
    require(answer.status != 500, "no device makes the gateway fail within itself");
  }
  void open_socket() {
    if (clients_.size() >= 3) return;
    auto& client = *clients_.emplace_back(std::make_unique<InsideClient>(site_.io, site_.gateway()));
    client.send("GET /api/v1/devices/" + name_ +
                "/arm HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                "Sec-WebSocket-Protocol: rrgate.json.v1\r\n\r\n");
    run_until(site_.io, patience, [&] { return !client.received().empty(); });
  }
  void talk() {
    if (clients_.empty()) open_socket();
    auto& client = *clients_[choices_.byte() % clients_.size()];
    client.forget();
    client.send(text_frame("{\"id\":1," + std::string(operations[choices_.byte() % std::size(operations)]) + "}"));
    run_until(site_.io, patience / 4, [&] { return !client.received().empty() || client.has_ended(); });
  }

  Site& site_;
  Choices choices_;
  std::shared_ptr<Malice> malice_ = std::make_shared<Malice>(choices_);
  std::string name_;
  std::shared_ptr<rrgate::PageLink> link_;
  std::vector<std::unique_ptr<InsideClient>> clients_;
};

double cpu_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto& site = *new Site;  // it goes with the program
  const MemoryBound bound(size, 64u << 20, 256);
  const auto begun = cpu_seconds();
  Using(site, {data, size}).run();
  require(cpu_seconds() - begun < most_cpu_seconds, "no device keeps the gateway busy for long");
  return 0;
}
