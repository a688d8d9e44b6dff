#include "server/record/replay.hpp"

#include <boost/asio/executor_work_guard.hpp>
#include <catch2/catch.hpp>
#include <future>
#include <thread>

#include "server/json/schema.hpp"
#include "server/record/recorder.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/support/folder.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

constexpr const char* definition = R"(service com.dev
stdver 0.10
object Axis
    wire double angle [readonly]
end
object Dev
    wire int32 count [readonly]
    wire int32 wanted [writeonly]
    pipe string words [readonly]
    event said(string what)
    property int32 gain
    function void go()
    function double{generator} steps()
    objref Axis{string} axes
    memory double[] samples
end
)";

constexpr int values = 5;

/// A device that tells something of each of its members, each time it is asked to.
struct Device {
  std::shared_ptr<rr::Service> service = rr::Service::from_text({definition}, "Dev", "Dev");
  std::shared_ptr<rr::Object> axis = service->make_object("Axis");
  std::int32_t gain = 0;
  std::unique_ptr<rr::RunningNode> node;

  /// `port`  where it listens beside the free one; 0: nowhere.
  explicit Device(std::uint16_t port = 0, bool has_axis = true) {
    service->property("gain").get([this] { return gain; }).set([this](std::int32_t value) { gain = value; });
    service->function("go", [] {});
    service->generator("steps", [] { return rr::Generator{}; });
    service->objref("axes",
                    [this, has_axis](std::string_view index) { return has_axis && index == "x y" ? axis : nullptr; });
    const auto prepare = [this, port](rr::Node& added) {
      added.add(service);
      if (port != 0) added.listen("rr+tcp://127.0.0.1:" + std::to_string(port));
    };
    node = std::make_unique<rr::RunningNode>(prepare, rr::NodeOptions{}, "dev.node");
  }
  void tell(std::int32_t number) {
    node->ask([&](rr::Node&) {
      gain = number;
      service->set_wire("count", number);
      (void)service->pipe("words").broadcast("w" + std::to_string(number));
      service->fire("said", "s" + std::to_string(number));
      axis->set_wire("angle", number * 0.5);
      return 0;
    });
  }
};

/// Runs `io` until it is so, for five seconds at most.
template <class Is>
bool run_until(boost::asio::io_context& io, const Is& is) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (!is() && std::chrono::steady_clock::now() < until) {
    io.restart();
    io.run_one_for(std::chrono::milliseconds(20));
  }
  return is();
}

struct Recorded {
  std::string path;
  std::vector<std::string> problems = {};
  rr::Result<> begun = {};
};

/// `messages`  that there are of each value at least.
Recorded record(const test::Folder& folder, const std::vector<std::string>& members, std::uint64_t messages) {
  Device device;
  boost::asio::io_context io(1);
  auto writer = RecordingWriter::create(folder.path("dev.mcap")).value();
  Recorded out{writer.path()};
  bool has_begun = false;
  RecordListener listener;
  listener.begun = [&](const rr::Result<>& outcome) {
    out.begun = outcome;
    has_begun = true;
  };
  listener.problem = [&](const std::string& problem) { out.problems.push_back(problem); };
  listener.failed = [&](const rr::Error& error) { out.problems.push_back(error.message); };
  const RecorderOptions how{members, std::chrono::milliseconds(1)};
  const auto recorder = std::make_shared<Recorder>(io, writer, device.node->url("Dev"), how, listener);
  recorder->start({});
  REQUIRE(run_until(io, [&] { return has_begun; }));
  for (std::int32_t i = 1; out.begun && i <= values; ++i) {
    const auto before = writer.message_count();
    device.tell(i);
    REQUIRE(run_until(io, [&] { return writer.message_count() >= before + messages; }));
  }
  recorder->close();
  REQUIRE(run_until(io, [&] { return io.stopped(); }));
  REQUIRE(writer.close());
  return out;
}

/// A replay on a thread of its own.
class RunningReplay {
 public:
  explicit RunningReplay(const std::string& path, ReplayOptions options = {}) {
    options.report = [this](const std::string& problem) { problems_.push_back(problem); };
    replay_.emplace(io_, Recording::open(path).value(), options);
    thread_ = std::thread([this] { io_.run(); });
  }
  ~RunningReplay() {
    boost::asio::post(io_, [this] { replay_->stop(); });
    boost::asio::post(io_, [this] { work_.reset(); });
    thread_.join();
  }
  const std::string& url() const { return urls().at(0); }
  const std::vector<std::string>& urls() const { return replay_->urls(); }
  std::string control_url() const { return url().substr(0, url().find('?')) + "?service=" + replay_->control_name(); }
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  boost::asio::io_context io_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{io_.get_executor()};
  std::vector<std::string> problems_;
  std::optional<Replay> replay_;
  std::thread thread_;
};

/// A recording of a Dev that is written by hand.
struct DevFile {
  rr::TypeRegistry types;
  RecordingWriter writer;
  RecordedService service = {};

  explicit DevFile(const test::Folder& folder, const std::string& name = "by hand.mcap")
      : writer(RecordingWriter::create(folder.path(name)).value()) {
    REQUIRE(types.add({definition}, rr::RobdefMode::strict));
    add_service("Dev");
  }
  /// The members that follow are its.
  void add_service(const std::string& name) {
    service = {writer.free_label(name), "rr+tcp://h/?service=" + name, name, "com.dev.Dev"};
    service.node.name = "com.dev.node";
    service.node.id = rr::parse_node_id("{00112233-4455-6677-8899-aabbccddeeff}").value();
    service.definitions = {definition};
    service.objects = {{name, "com.dev.Dev"}};
    REQUIRE(writer.add_service(service));
  }
  std::uint16_t add(const char* name) {
    const auto* member = types.find_entity("com.dev.Dev")->find_member(name);
    return writer.add_member(service, service.service, "", *member, rr::named_type_schemas(types)).value();
  }
};

using Stamped = std::pair<rr::TimeSpec, double>;

/// Of a channel of the file.
std::vector<Stamped> recorded_values(const std::string& path, const std::string& topic) {
  auto recording = Recording::open(path).value();
  std::vector<Stamped> out;
  for (const auto& chunk : recording.chunks()) {
    const auto read = recording.read(chunk).value();
    for (const auto& message : read.messages)
      if (recording.members().at(message.channel).topic == topic)
        out.push_back({{static_cast<std::int64_t>(message.publish_time / 1'000'000'000u),
                        static_cast<std::int32_t>(message.publish_time % 1'000'000'000u)},
                       recording.read_document(message).value()["value"].get<double>()});
  }
  return out;
}

}  // namespace

TEST_CASE("what was recorded is replayed: the same values, in their order, with their time stamps") {
  const test::Folder folder;
  const auto recorded = record(folder, {"*", "axes/x%20y/*"}, 11);  // four, and readings of the property
  CHECK(recorded.problems.empty());
  const auto counts = recorded_values(recorded.path, "/Dev/count");
  const auto angles = recorded_values(recorded.path, "/Dev/axes/x y/angle");
  REQUIRE(counts.size() == values);
  REQUIRE(angles.size() == values);

  const RunningReplay replay(recorded.path);
  auto dev = rr::connect(replay.url());
  auto control = rr::connect(replay.control_url());
  CHECK(dev.type_name() == "com.dev.Dev");
  std::vector<Stamped> heard_counts;
  std::vector<Stamped> heard_angles;
  std::vector<std::string> words;
  std::vector<std::string> said;
  // Each value, not the newest alone: as a program that reads in time.
  auto& connection = dev.connection();
  const auto axis = dev.object("axes", "x y");
  const auto follow = [&](const rr::RemoteObject& object, const std::string& wire, std::vector<Stamped>& heard) {
    connection.wait_for([&](rr::ClientConnection& session, auto done) {
      session.connect_wire(
          object.path(), wire,
          [&heard](const rr::Value& value, rr::TimeSpec time) { heard.emplace_back(time, *value.to<double>()); },
          std::move(done));
    });
  };
  follow(dev, "count", heard_counts);
  follow(axis, "angle", heard_angles);
  dev.connect_pipe("words", [&](const rr::Value& word) { words.emplace_back(*word.to_text()); });
  dev.on_event("said", [&](std::span<const rr::Value> arguments) { said.emplace_back(*arguments.front().to_text()); });
  control.call("play");
  connection.run_until([&] { return heard_angles.size() == values && said.size() == values && words.size() == values; },
                       std::chrono::seconds(10));
  CHECK(heard_counts == counts);
  CHECK(heard_angles == angles);
  CHECK(words == std::vector<std::string>{"w1", "w2", "w3", "w4", "w5"});
  CHECK(said == std::vector<std::string>{"s1", "s2", "s3", "s4", "s5"});
  control.call("step", Player::max_step);  // what is left: readings of the property
  CHECK(dev.get("gain").to<double>().value() == recorded_values(recorded.path, "/Dev/gain").back().second);
  CHECK(replay.problems().empty());
}

TEST_CASE("members that were not recorded say that this is a replay") {
  const test::Folder folder;
  const auto recorded = record(folder, {"count", "gain"}, 11);
  const RunningReplay replay(recorded.path);
  auto dev = rr::connect(replay.url());
  const auto refusal = [&](const auto& ask) {
    const auto error = rr::error_of(ask);
    CHECK(error.code == rr::ErrorCode::not_implemented_error);
    CHECK_THAT(error.message, Catch::Contains("is not in the recording: this is a replay of " + recorded.path));
  };
  refusal([&] { dev.call("go"); });
  refusal([&] { dev.set("gain", 3); });
  refusal([&] { dev.object("axes", "x y"); });
  refusal([&] { dev.generator("steps"); });
  refusal([&] { (void)dev.memory("samples").dimensions(); });
  CHECK(rr::error_of([&] { dev.get("gain"); }).code == rr::ErrorCode::value_not_set);
  CHECK(rr::error_of([&] { dev.peek_in("count"); }).code == rr::ErrorCode::value_not_set);
}

TEST_CASE("a replay is moved, stepped, sped up and played again, and time stamps go on") {
  const test::Folder folder;
  const auto recorded = record(folder, {"count"}, 1);
  const auto counts = recorded_values(recorded.path, "/Dev/count");
  const RunningReplay replay(recorded.path);
  auto dev = rr::connect(replay.url());
  auto control = rr::connect(replay.control_url());
  std::vector<Stamped> heard;
  dev.connect_wire("count",
                   [&](const rr::Value& value, rr::TimeSpec time) { heard.emplace_back(time, *value.to<double>()); });
  const auto wait_for = [&](double value) {
    return dev.connection().run_until([&] { return !heard.empty() && heard.back().second == value; },
                                      std::chrono::seconds(5));
  };
  const auto field = [&](const char* name) {
    const auto state = control.peek_in("state");
    return *state.get_if<rr::Structure>()->find(name);
  };
  control.call("step", 1u);
  REQUIRE(wait_for(1));
  control.call("step", 1u);
  REQUIRE(wait_for(2));
  CHECK(heard == std::vector<Stamped>(counts.begin(), counts.begin() + 2));
  const auto duration = *field("duration").to<double>();
  control.call("seek", duration);
  REQUIRE(wait_for(4));  // what it was before the last message
  control.call("step", 10u);
  REQUIRE(wait_for(5));
  CHECK(*field("position").to<double>() == Approx(duration));
  CHECK(!*field("playing").to<bool>());

  control.call("seek", 0.0);
  control.set("speed", 100.0);
  const auto before = heard.back().first;
  heard.clear();
  control.call("play");
  REQUIRE(wait_for(5));
  CHECK(std::is_sorted(heard.begin(), heard.end()));
  CHECK(heard.front().first > before);

  control.set("loop", true);
  heard.clear();
  control.call("play");
  // Again: a value before the one that was the last. At this speed a wire may leave values out.
  const auto falls = [](const Stamped& one, const Stamped& next) { return next.second < one.second; };
  REQUIRE(dev.connection().run_until(
      [&] { return std::adjacent_find(heard.begin(), heard.end(), falls) != heard.end(); }, std::chrono::seconds(5)));
  control.call("pause");
  CHECK(!*field("playing").to<bool>());
  CHECK(*field("loop").to<bool>());

  CHECK_THAT(rr::error_of([&] { control.call("seek", -1.0); }).message, Catch::Contains("expected 0 to"));
  CHECK_THAT(rr::error_of([&] { control.set("speed", 0.0); }).message, Catch::Contains("expected 0.001 to 1000"));
  CHECK_THAT(rr::error_of([&] { control.call("step", 10'001u); }).message, Catch::Contains("expected 10000 at most"));
  CHECK(control.get("file").to_text().value() == recorded.path);
}

TEST_CASE("what a wire sends after the replay went back is newer than all before, whatever its time stamps are") {
  const test::Folder folder;
  DevFile file(folder);
  auto& writer = file.writer;
  const auto channel = file.add("count");
  // The values are a second apart, and reached the recorder at once.
  for (int i = 1; i <= 3; ++i) REQUIRE(writer.write(channel, {{"value", i}}, rr::TimeSpec{i, 0}, {5, i}));
  REQUIRE(writer.close());

  boost::asio::io_context io(1);
  std::vector<McapTime> stamps;
  Player::Listener listener;
  listener.play = [&](const McapMessage& message, McapTime shift) { stamps.push_back(message.publish_time + shift); };
  listener.forget = [](std::uint16_t) {};
  listener.changed = [] {};
  listener.failed = [](const rr::Error& error) { FAIL_CHECK(error.message); };
  Player player(io, Recording::open(writer.path()).value(), listener);
  player.set_loops(true);
  player.set_speed(0.001);  // a loop's end adds 100 us
  player.play();
  REQUIRE(run_until(io, [&] { return stamps.size() >= 9; }));
  player.pause();
  player.seek(2e-9);  // what it was then: the value before
  player.step(1);
  CHECK(stamps.size() >= 11);
  CHECK(std::is_sorted(stamps.begin(), stamps.end(), std::less_equal<>()));
  CHECK(std::adjacent_find(stamps.begin(), stamps.end()) == stamps.end());
}

TEST_CASE("a recording of several files plays, goes to any time and begins again as one") {
  const test::Folder folder;
  std::vector<std::string> files;
  for (const int begin : {5, 7}) {
    files.push_back("from " + std::to_string(begin) + ".mcap");
    DevFile file(folder, files.back());
    if (begin == 7) file.add("gain");  // the channels have other numbers
    const auto count = file.add("count");
    for (const int second : {begin, begin + 1})
      REQUIRE(file.writer.write(count, {{"value", second}}, rr::TimeSpec{second, 0}, {second, 0}));
    REQUIRE(file.writer.close());
  }
  boost::asio::io_context io(1);
  std::vector<int> heard;
  std::optional<Player> player;
  Player::Listener listener;
  listener.play = [&](const McapMessage& message, McapTime) {
    heard.push_back(player->recording().read_document(message).value()["value"].get<int>());
  };
  listener.forget = [](std::uint16_t) {};
  listener.changed = [] {};
  listener.failed = [](const rr::Error& error) { FAIL_CHECK(error.message); };
  player.emplace(io, Recording::open(files, {}, folder.path("")).value(), listener);
  CHECK(player->state().duration == Approx(3));
  player->step(4);
  CHECK(heard == std::vector<int>{5, 6, 7, 8});
  heard.clear();
  player->seek(1.5);
  player->step(1);
  CHECK(heard == std::vector<int>{6, 7});
  heard.clear();
  player->seek(2.5);
  CHECK(heard == std::vector<int>{7});
  player->seek(0);
  heard.clear();
  player->set_loops(true);
  player->set_speed(1000);
  player->play();
  REQUIRE(run_until(io, [&] { return heard.size() >= 6; }));
  CHECK(std::vector<int>(heard.begin(), heard.begin() + 6) == std::vector<int>{5, 6, 7, 8, 5, 6});
}

TEST_CASE("before its first value, a wire or property that a replay goes back to has none again") {
  const test::Folder folder;
  DevFile file(folder);
  const auto count = file.add("count");
  const auto gain = file.add("gain");
  for (int i = 1; i <= 2; ++i) REQUIRE(file.writer.write(count, {{"value", i}}, rr::TimeSpec{i, 0}, {5 + i, 0}));
  REQUIRE(file.writer.write(gain, {{"value", 7}}, {}, {8, 0}));
  REQUIRE(file.writer.write(gain, {{"value", 8}}, {}, {9, 0}));
  REQUIRE(file.writer.close());

  const RunningReplay replay(file.writer.path());
  auto dev = rr::connect(replay.url());
  auto control = rr::connect(replay.control_url());
  const auto count_now = [&] { return dev.peek_in("count").to<std::int32_t>().value(); };
  const auto gain_now = [&] { return dev.get("gain").to<std::int32_t>().value(); };
  const auto has_no_gain = [&] { return rr::error_of([&] { dev.get("gain"); }).code == rr::ErrorCode::value_not_set; };
  const auto has_no_count = [&] {
    return rr::error_of([&] { dev.peek_in("count"); }).code == rr::ErrorCode::value_not_set;
  };
  for (int round = 0; round < 2; ++round) {  // and each message comes once
    CHECK(has_no_count());
    control.call("step", 1u);
    CHECK(count_now() == 1);
    control.call("step", 1u);
    CHECK(count_now() == 2);
    CHECK(has_no_gain());
    control.call("step", 1u);
    CHECK(gain_now() == 7);
    control.call("step", 1u);
    CHECK(gain_now() == 8);
    control.call("seek", 1.5);
    CHECK(count_now() == 2);
    CHECK(has_no_gain());
    control.call("seek", 3.0);
    CHECK(gain_now() == 7);
    control.call("seek", 0.0);
    CHECK(has_no_gain());
  }
}

TEST_CASE("services of the name that controls replays, and of one name at one node, are replayed") {
  const test::Folder folder;
  DevFile file(folder);
  std::vector<std::uint16_t> gains{file.add("gain")};
  for (const auto* name : {"replay", "replay_2", "Dev"}) {
    file.add_service(name);
    gains.push_back(file.add("gain"));
  }
  for (std::size_t i = 0; i < gains.size(); ++i) REQUIRE(file.writer.write(gains[i], {{"value", i}}, {}, {5, 0}));
  REQUIRE(file.writer.close());
  ReplayOptions options;
  options.keeps_ids = GENERATE(false, true);
  const RunningReplay replay(file.writer.path(), options);
  REQUIRE(replay.urls().size() == gains.size());
  CHECK_THAT(replay.control_url(), Catch::EndsWith("?service=replay_3"));
  auto control = rr::connect(replay.control_url());
  control.call("step", 10u);
  const auto address = [&](std::size_t service) {
    return replay.urls()[service].substr(0, replay.urls()[service].find('?'));
  };
  for (std::size_t i = 0; i < gains.size(); ++i)
    CHECK(rr::connect(replay.urls()[i]).get("gain").to<std::size_t>().value() == i);
  CHECK(address(1) == address(0));
  CHECK(address(2) == address(0));
  CHECK(address(3) != address(0));
  CHECK(rr::connect(address(3) + "?service=replay_3").get("file").to_text().value() == file.writer.path());
}

TEST_CASE("what controls a replay has the number behind those of all recorded services of its name") {
  const test::Folder folder;
  const auto [recorded, expected] = GENERATE(table<std::vector<const char*>, const char*>(
      {{{"Arm"}, "replay"}, {{"replay_2"}, "replay_3"}, {{"replay_10", "replay_x", "replayed"}, "replay_11"}}));
  DevFile file(folder);
  for (const auto* name : recorded) file.add_service(name);
  REQUIRE(file.writer.close());
  const RunningReplay replay(file.writer.path(), {});
  CHECK_THAT(replay.control_url(), Catch::EndsWith("?service=" + std::string(expected)));
}

TEST_CASE("a property that is slow to answer holds up no other") {
  const test::Folder folder;
  const auto service = rr::Service::from_text({"service com.slow\nstdver 0.10\nobject Dev\nproperty int32 slow "
                                               "[readonly]\nproperty int32 gain [readonly]\nend\n"},
                                              "Dev", "Dev");
  std::vector<rr::Reply<std::int32_t>> unanswered;
  service->property("slow").get([&](rr::Reply<std::int32_t> reply) { unanswered.push_back(std::move(reply)); });
  service->property("gain").get([] { return 1; });
  rr::RunningNode node([&](rr::Node& added) { added.add(service); });
  boost::asio::io_context io(1);
  auto writer = RecordingWriter::create(folder.path("dev.mcap")).value();
  RecordListener listener;
  listener.begun = [](const rr::Result<>& outcome) { CHECK(outcome); };
  listener.problem = [](const std::string& problem) { FAIL_CHECK(problem); };
  const RecorderOptions how{{"slow", "gain"}, std::chrono::milliseconds(1)};
  const auto recorder = std::make_shared<Recorder>(io, writer, node.url("Dev"), how, listener);
  recorder->start({});
  CHECK(run_until(io, [&] { return writer.message_count() >= 3; }));
  recorder->close();
  io.restart();
  io.run_for(std::chrono::seconds(10));
  CHECK(io.stopped());  // the request that is not answered keeps nothing
  node.stop();
  node.join();
}

TEST_CASE("an object that is first there after a reconnection is recorded from then on") {
  const test::Folder folder;
  auto device = std::make_unique<Device>(std::uint16_t{0}, false);
  const auto url = device->node->url("Dev");
  const auto port = device->node->port();
  boost::asio::io_context io(1);
  auto writer = RecordingWriter::create(folder.path("dev.mcap")).value();
  RecordListener listener;
  listener.begun = [](const rr::Result<>& outcome) { CHECK(outcome); };
  std::vector<std::string> problems;
  listener.problem = [&](const std::string& problem) { problems.push_back(problem); };
  listener.failed = [](const rr::Error& error) { FAIL_CHECK(error.message); };
  const RecorderOptions how{{"count", "axes/x%20y/*"}, std::chrono::milliseconds(1)};
  const auto recorder = std::make_shared<Recorder>(io, writer, url, how, listener);
  recorder->start({});
  const auto records = [&](std::uint64_t messages, std::size_t members) {
    return run_until(io, [&] {
      device->tell(1);
      return writer.message_count() >= messages && writer.topics().size() == members;
    });
  };
  REQUIRE(records(1, 1));
  device.reset();
  REQUIRE(run_until(io, [&] { return !problems.empty() && problems.back().find("lost") != std::string::npos; }));
  device = std::make_unique<Device>(port);
  REQUIRE(records(writer.message_count() + 10, 2));
  recorder->close();
  REQUIRE(run_until(io, [&] { return io.stopped(); }));
  REQUIRE(writer.close());
  CHECK(!recorded_values(writer.path(), "/Dev/axes/x y/angle").empty());
  const auto recording = Recording::open(writer.path()).value();
  REQUIRE(recording.services().size() == 1);
  CHECK(recording.services()[0].objects.size() == 2);
  const RunningReplay replay(writer.path());  // serves it
  CHECK(replay.problems().empty());
}

TEST_CASE("what can't be recorded is told, and the rest recorded") {
  const test::Folder folder;
  const auto some = record(folder, {"count", "nonesuch", "axes/y/angle", "go"}, 1);
  REQUIRE(some.begun);
  REQUIRE(some.problems.size() == 3);
  CHECK_THAT(some.problems[0], Catch::Contains("'nonesuch': no member to record; com.dev.Dev has: count, words, said"));
  CHECK_THAT(some.problems[1], Catch::Contains("'axes/y/angle': "));
  const test::Folder other;
  const auto none = record(other, {"axes/x"}, 0);
  REQUIRE(!none.begun);
  CHECK_THAT(none.begun.error().message, Catch::Contains("'axes/x': objref 'axes' needs an index"));
}

TEST_CASE("a recording whose parts do not go together is not served") {
  const test::Folder folder;
  rr::TypeRegistry types;
  REQUIRE(types.add({definition}, rr::RobdefMode::strict));
  const auto refusal = [&](const std::function<void(RecordedService&)>& spoil) {
    auto writer = RecordingWriter::create(folder.path("bad.mcap")).value();
    RecordedService service{"Dev", "rr+tcp://h/?service=Dev", "Dev", "com.dev.Dev"};
    service.definitions = {definition};
    service.objects = {{"Dev", "com.dev.Dev"}, {"Dev.axes[x]", "com.dev.Axis"}};
    const auto* angle = types.find_entity("com.dev.Axis")->find_member("angle");
    const auto before = service;
    spoil(service);
    REQUIRE(writer.add_service(service));
    REQUIRE(writer.add_member(before, "Dev.axes[x]", "axes/x", *angle, rr::named_type_schemas(types)));
    REQUIRE(writer.close());
    boost::asio::io_context io;
    try {
      const Replay replay(io, Recording::open(writer.path()).value(), {});
    } catch (const std::exception& problem) {
      return std::string(problem.what());
    }
    return std::string("served");
  };
  CHECK(refusal([](auto&) {}) == "served");
  {
    boost::asio::io_context io;
    ReplayOptions options;
    for (const auto* listen : {"rr+tcp:/1", "rr+tcp://127.0.0.1", "rr+local:///", "tcp://127.0.0.1:1"}) {
      options.listen = listen;
      CHECK_THROWS_WITH(Replay(io, Recording::open(folder.path("bad.mcap")).value(), options),
                        Catch::Contains("expected \"rr+tcp://HOST:PORT\""));
    }
  }
  CHECK_THAT(refusal([](auto& service) { service.definitions = {"service com.dev\nobject Dev\n"}; }),
             Catch::Contains("bad.mcap: service \"Dev\"") || Catch::Contains("bad.mcap: service 'Dev'"));
  CHECK_THAT(refusal([](auto& service) { service.type = "com.dev.Other"; }), Catch::Contains("com.dev.Other"));
  CHECK_THAT(refusal([](auto& service) { service.objects.erase("Dev.axes[x]"); }),
             Catch::Contains("Dev.axes[x]") && Catch::Contains("is not in the recording"));
  CHECK_THAT(refusal([](auto& service) { service.objects["Dev.nonesuch[x]"] = "com.dev.Axis"; }),
             Catch::Contains("nonesuch"));
  CHECK_THAT(refusal([](auto& service) { service.objects["Dev.axes[x].axes[y]"] = "com.dev.Axis"; }),
             Catch::Contains("axes"));
  CHECK_THAT(refusal([](auto& service) { service.node.name = "not a name"; }), Catch::Contains("not a name"));
}
