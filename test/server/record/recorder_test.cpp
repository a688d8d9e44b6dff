// What "rrgate record" follows while a device closes its members and replaces its objects.
#include "server/record/recorder.hpp"

#include <catch2/catch.hpp>

#include "node/service/node.hpp"
#include "server/record/recording.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace std::chrono_literals;

namespace {

constexpr const char* tower_definition = R"(service test.tower
stdver 0.10
object Floor
    pipe int32 news [readonly]
    wire int32 level [readonly]
end
object Tower
    objref Floor{int32} floors
end
)";

struct RecordedTower {
  boost::asio::io_context io{1};
  rr::Node node{io, "test.tower"};
  std::shared_ptr<rr::Service> service = rr::Service::from_text({tower_definition}, "tower", "test.tower.Tower");
  std::shared_ptr<rr::Object> floor;  ///< the newest that was found
  test::Folder folder;
  RecordingWriter writer = RecordingWriter::create(folder.path("a.mcap")).value();
  std::vector<std::string> problems = {};
  std::size_t solved = 0;
  std::shared_ptr<Recorder> recorder;

  explicit RecordedTower(const std::string& member) {
    service->objref("floors", [this](std::string_view) { return floor = service->make_object("test.tower.Floor"); });
    node.add(service);
    const auto port = node.listen("rr+tcp://127.0.0.1:0");
    RecordListener listener;
    listener.begun = [](const rr::Result<>& begun) { CHECK(begun.has_value()); };
    listener.problem = [this](const std::string& problem) { problems.push_back(problem); };
    listener.solved = [this](const std::string&) { ++solved; };
    listener.failed = [](const rr::Error& error) { FAIL(error.message); };
    const auto url = "rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=tower";
    recorder = std::make_shared<Recorder>(io, writer, url, RecorderOptions{{member}}, std::move(listener));
    recorder->start({});
  }
  ~RecordedTower() {
    recorder->close();
    node.stop();
    io.restart();
    io.run_for(2s);
  }
  RecordedTower(const RecordedTower&) = delete;
  RecordedTower& operator=(const RecordedTower&) = delete;

  bool run_until(const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + 10s;
    while (!is_so() && std::chrono::steady_clock::now() < end) {
      io.restart();
      io.run_one_for(10ms);
    }
    return is_so();
  }
};

}  // namespace

TEST_CASE("a wire or a pipe that the device has closed is recorded on once it is there again") {
  const std::string member = GENERATE("level", "news");
  RecordedTower tower("floors/1/" + member);
  const auto send = [&] {
    if (!tower.floor) return;
    if (member == "level") tower.floor->set_wire("level", 5);
    if (member == "news") tower.floor->pipe("news").broadcast(rr::Value(5));
  };
  const auto records_three = [&] {
    const auto wanted = tower.writer.message_count() + 3;
    return tower.run_until([&] {
      send();
      return tower.writer.message_count() >= wanted;
    });
  };
  REQUIRE(records_three());
  tower.service->root().release("floors", "1");
  CHECK(records_three());
  CHECK(tower.run_until([&] { return tower.solved > 0; }));
  REQUIRE(tower.problems.size() == 1);
  CHECK(tower.problems.front().find("floors/1/" + member + ": the device has closed it") != std::string::npos);
}
