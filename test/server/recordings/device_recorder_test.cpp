// What is recorded of a device whose members and objects come and go.
#include "server/recordings/device_recorder.hpp"

#include "server/record/recording.hpp"
#include "test/server/upstream/upstream_bench.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

constexpr const char* definition = R"(service test.rack
stdver 0.10
object Part
    pipe int32 news [readonly]
    wire int32 level [readonly]
    event moved(int32 by)
    property int32 size
end
object OtherPart
    wire string level [readonly]
end
object Rack
    wire int32 load [readonly]
    objref varobject{int32} parts
    objref varobject extra
end
)";

constexpr const char* later_definition = R"(service test.later
stdver 0.10
object Extra
    property int32 size
end
)";

struct RecordedRack {
  std::shared_ptr<rr::Service> service = rr::Service::from_text({definition}, "rack", "test.rack.Rack");
  std::shared_ptr<rr::Object> part;          ///< the newest that was found
  std::string part_type = "test.rack.Part";  ///< empty: there is none
  UpstreamBench bench;
  std::shared_ptr<Device> device;
  ValueClients clients;
  Folder folder;
  RecordingWriter writer;
  std::vector<std::string> problems = {};
  std::vector<std::string> left = {};  ///< of problems, each time that one was solved
  std::optional<rr::Error> failure = {};
  std::shared_ptr<DeviceRecorder> recorder;

  explicit RecordedRack(std::vector<std::string> members)
      : bench(prepared()),
        device(relayed(bench)),
        clients(bench.io.get_executor(), MemoryBudget(1'000'000).charge("")),
        writer(RecordingWriter::create(folder.path("a.mcap")).value()) {
    RecordListener listener;
    listener.begun = [](const rr::Result<>&) {};
    listener.problem = [this](const std::string& problem) { problems.push_back(problem); };
    listener.solved = [this](const std::string& rest) { left.push_back(rest); };
    listener.failed = [this](const rr::Error& error) { failure = error; };
    const RecorderOptions options{std::move(members), std::chrono::milliseconds(3'600'000)};
    recorder = std::make_shared<DeviceRecorder>(device, "rack", clients, writer, options, std::move(listener));
    recorder->start();
  }
  ~RecordedRack() {
    recorder->close();
    clients.stop();
    device->stop();
  }
  std::shared_ptr<rr::Service> prepared() {
    service->objref("parts", [this](std::string_view) {
      part = part_type.empty() ? nullptr : service->make_object(part_type);
      if (part && part_type == "test.rack.Part") part->property("size").get([] { return 3; });
      return part;
    });
    service->objref("extra", [this] {
      auto out = service->make_object("test.later.Extra");
      out->property("size").get([] { return 3; });
      return out;
    });
    return service;
  }
  static std::shared_ptr<Device> relayed(UpstreamBench& bench) {
    auto config = bench.device->config();
    config.mode = DeviceMode::relay;
    return std::make_shared<Device>(bench.io.get_executor(), std::move(config), bench.config);
  }
  std::shared_ptr<ValueClient> client() {
    SessionKey key{"rack"};
    return bench.wait_for(clients.open(device, std::move(key))).value();
  }
  void cut() {
    client()->upstream()->connection()->close(rr::make_error(rr::ErrorCode::connection_error, "the line was cut"));
  }
  /// Until so many more messages of a member are recorded, while the device goes on to send.
  bool records(std::uint64_t more, const std::string& place, const std::function<void()>& send) {
    const auto wanted = count(place) + more;
    return bench.run_until([&] {
      send();
      return count(place) >= wanted;
    });
  }
  bool has_problem(const std::string& text) const {
    return std::any_of(problems.begin(), problems.end(),
                       [&](const auto& each) { return each.find(text) != std::string::npos; });
  }
  std::uint64_t count(const std::string& place) {
    REQUIRE(writer.flush().has_value());
    auto recording = Recording::open(writer.path());
    if (!recording) return 0;  // it has no service yet
    for (const auto& [channel, member] : recording->members())
      if (member.topic == "/rack/" + place) return member.message_count;
    return 0;
  }
};

}  // namespace

TEST_CASE("a member whose object the device replaces is recorded on, and the problem is solved") {
  const std::string member = GENERATE("level", "news", "moved");
  RecordedRack rack({"load", "parts/1/" + member});
  const auto send = [&] {
    if (!rack.part) return;
    if (member == "level") rack.part->set_wire("level", 5);
    if (member == "news") rack.part->pipe("news").broadcast(rr::Value(5));
    if (member == "moved") rack.part->fire("moved", 5);
  };
  const auto place = "parts/1/" + member;
  REQUIRE(rack.records(3, place, send));
  rack.service->root().release("parts", "1");
  REQUIRE(rack.bench.run_until([&] { return rack.has_problem(place + ": the device "); }));
  REQUIRE(rack.bench.run_until([&] { return !rack.left.empty(); }));
  CHECK(rack.left.back().empty());
  CHECK(rack.records(3, place, send));
  CHECK_FALSE(rack.failure);
}

TEST_CASE("what is not there when a recording begins is recorded once it is") {
  RecordedRack rack({"load", "parts/1/*"});
  rack.part_type.clear();
  const auto send = [&] {
    rack.service->root().set_wire("load", 1);
    if (rack.part) rack.part->set_wire("level", 5);
  };
  REQUIRE(rack.records(3, "load", send));
  CHECK(rack.has_problem("'parts/1/*': "));
  rack.part_type = "test.rack.Part";
  REQUIRE(rack.bench.run_until([&] {
    send();
    return !rack.left.empty();
  }));
  CHECK(rack.left.back().empty());
  CHECK(rack.records(3, "parts/1/level", send));
  CHECK(rack.bench.run_until([&] { return rack.count("parts/1/size") == 1; }));
}

TEST_CASE("what goes on after an outage is read no more often") {
  RecordedRack rack({"load", "parts/1/size"});
  const auto send = [&] { rack.service->root().set_wire("load", 1); };
  REQUIRE(rack.records(3, "load", send));
  REQUIRE(rack.bench.run_until([&] { return rack.count("parts/1/size") == 1; }));
  REQUIRE(rack.bench.run_until([&] { return rack.recorder->is_following(); }));
  rack.cut();
  REQUIRE(rack.bench.run_until([&] { return !rack.recorder->is_following(); }));
  REQUIRE(rack.bench.run_until([&] { return rack.recorder->is_following() && rack.left.size() >= 1; }));
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1500);
  CHECK(rack.records(3, "load", send));
  REQUIRE(rack.bench.run_until([&] { return std::chrono::steady_clock::now() >= end; }));
  CHECK(rack.count("parts/1/size") == 1);
}

TEST_CASE("after an outage the members are chosen anew") {
  RecordedRack rack({"load", "parts/1/level"});
  REQUIRE(rack.records(3, "parts/1/level", [&] {
    if (rack.part) rack.part->set_wire("level", 5);
  }));
  REQUIRE(rack.bench.run_until([&] { return rack.recorder->is_following(); }));
  rack.part_type = "test.rack.OtherPart";
  rack.cut();
  rack.service->root().release("parts", "1");  // which nobody is there to hear
  REQUIRE(rack.bench.run_until([&] { return rack.has_problem("is of type test.rack.OtherPart now"); }));
  CHECK_FALSE(rack.failure);
}

TEST_CASE("an object that comes back as one of another type is not recorded as what it was") {
  RecordedRack rack({"load", "parts/1/level"});
  REQUIRE(rack.records(3, "parts/1/level", [&] {
    if (rack.part) rack.part->set_wire("level", 5);
  }));
  rack.part_type = "test.rack.OtherPart";
  rack.service->root().release("parts", "1");
  REQUIRE(rack.bench.run_until([&] { return rack.has_problem("is of type test.rack.OtherPart now"); }));
  CHECK(rack.has_problem("and was recorded as test.rack.Part"));
  CHECK(rack.records(3, "load", [&] { rack.service->root().set_wire("load", 1); }));
  CHECK_FALSE(rack.failure);
  rack.part_type = "test.rack.Part";
  rack.service->root().release("parts", "1");
  REQUIRE(rack.bench.run_until([&] { return !rack.left.empty() && rack.left.back().empty(); }));
  CHECK(rack.records(3, "parts/1/level", [&] { rack.part->set_wire("level", 5); }));
}

TEST_CASE("definitions that other clients of the session find do not end a recording") {
  RecordedRack rack({"load", "parts/1/level"});
  const auto send = [&] {
    if (rack.part) rack.part->set_wire("level", 5);
  };
  REQUIRE(rack.records(3, "parts/1/level", send));
  const auto client = rack.client();
  const auto before = client->upstream()->types()->definitions().size();
  // Like a device that does not tell of all its definitions at once: its clients learn of this one with an object.
  auto& types = const_cast<rr::TypeRegistry&>(rack.service->types());
  REQUIRE(types.add({later_definition}, rr::RobdefMode::strict).has_value());
  const auto found = rack.bench.begin(client->find_object("rack.extra"));
  REQUIRE(rack.bench.run_until([&] { return found->has_value(); }));
  REQUIRE(client->upstream()->types()->definitions().size() == before + 1);
  rack.service->root().release("parts", "1");
  REQUIRE(rack.bench.run_until([&] { return !rack.left.empty(); }));
  CHECK(rack.records(3, "parts/1/level", send));
  CHECK_FALSE(rack.failure);
}
