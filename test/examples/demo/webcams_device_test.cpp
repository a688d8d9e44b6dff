#include "examples/demo/webcams_device.hpp"

#include <catch2/catch.hpp>

#include "examples/demo/create_device.hpp"
#include "examples/demo/pose_follower.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rrgate::demo;
using namespace std::chrono_literals;

namespace {

rr::Value field_of(const rr::Value& structure, std::string_view name) {
  return *structure.get_if<rr::Structure>()->find(name);
}

/// A camera that a test unplugs, and that can let its client wait.
struct TestCamera : FrameSource {
  std::string name() const override { return "Test"; }
  void take(Taken taken) override {
    if (is_slow) return waiting.push_back(std::move(taken));
    taken(problem.empty() ? FrameResult{{2, 1, 6, {1, 2, 3, 4, 5, 6}}, {}} : FrameResult{{}, problem});
  }

  std::string problem;
  bool is_slow = false;
  std::vector<Taken> waiting;
};

struct TestWebcam {
  TestCamera* camera = nullptr;
  std::unique_ptr<WebcamsDevice> webcams;
  rr::RunningNode node{[this](rr::Node& made) {
    auto owned = std::make_unique<TestCamera>();
    camera = owned.get();
    std::vector<std::unique_ptr<FrameSource>> sources;
    sources.push_back(std::move(owned));
    webcams = std::make_unique<WebcamsDevice>(made, std::move(sources));
  }};
};

}  // namespace

TEST_CASE("two cameras look out from the pose that they are given") {
  std::unique_ptr<WebcamsDevice> webcams;
  Pose pose{{300, -200}, 0.4};
  rr::RunningNode node([&](rr::Node& made) { webcams = std::make_unique<WebcamsDevice>(made, [&] { return pose; }); });
  const auto host = rr::connect(node.url("Webcam"));
  const auto names = host.get("WebcamNames");
  CHECK(names == rr::Value(rr::MapInt32{{{0, "Left"}, {1, "Right"}}}));

  const auto left = host.object("Webcams", "0");
  CHECK(left.get("Name") == rr::Value("Left"));
  const auto frame = left.call("CaptureFrame");
  CHECK(field_of(frame, "width") == rr::Value(std::int32_t{320}));
  CHECK(field_of(frame, "height") == rr::Value(std::int32_t{240}));
  CHECK(field_of(frame, "step") == rr::Value(std::int32_t{960}));
  CHECK(field_of(frame, "data").get_if<rr::Array>()->size() == 960u * 240u);
  CHECK(left.call("CaptureFrame") == frame);
  CHECK_FALSE(host.object("Webcams", "1").call("CaptureFrame") == frame);

  node.ask([&](rr::Node&) { return pose.heading = 1.0; });
  CHECK_FALSE(left.call("CaptureFrame") == frame);

  CHECK(rr::error_of([&] { host.object("Webcams", "2"); }).code == rr::ErrorCode::service_error);
}

TEST_CASE("a frame is taken into the camera's memories, which hold it until the next") {
  std::unique_ptr<WebcamsDevice> webcams;
  Pose pose{{300, -200}, 0.4};
  rr::RunningNode node([&](rr::Node& made) { webcams = std::make_unique<WebcamsDevice>(made, [&] { return pose; }); });
  const auto host = rr::connect(node.url("Webcam"));
  const auto left = host.object("Webcams", "0");
  const auto buffer = left.memory("buffer");
  const auto planes = left.memory("multidimbuffer");
  CHECK(buffer.dimensions() == rr::MemoryShape{0});
  CHECK(planes.dimensions() == rr::MemoryShape{0, 0, 3});
  CHECK(buffer.read().get_if<rr::Array>()->size() == 0);

  const auto frame = left.call("CaptureFrame");
  const auto size = left.call("CaptureFrameToBuffer");
  for (const char* field : {"width", "height", "step"}) CHECK(field_of(size, field) == field_of(frame, field));
  REQUIRE(buffer.dimensions() == rr::MemoryShape{960 * 240});
  REQUIRE(planes.dimensions() == rr::MemoryShape{240, 320, 3});
  CHECK(buffer.read() == field_of(frame, "data"));

  // Red, green and blue of the pixel in row 200, column 17; the frame has it the other way round.
  const auto pixel = planes.read({200, 17, 0}, {1, 1, 3});
  const auto bytes = field_of(frame, "data").get_if<rr::Array>()->bytes().subspan(200 * 960 + 17 * 3, 3);
  CHECK(pixel == rr::Value(rr::MultiDimArray{
                     {1, 1, 3}, rr::Array::take(std::vector<std::uint8_t>{bytes[2], bytes[1], bytes[0]})}));
  CHECK(planes.read().get_if<rr::MultiDimArray>()->array.size() == 240u * 320 * 3);

  const auto before = buffer.read();
  node.ask([&](rr::Node&) { return pose.heading = 1.0; });
  CHECK(buffer.read() == before);
  left.call("CaptureFrameToBuffer");
  CHECK_FALSE(buffer.read() == before);
  CHECK(host.object("Webcams", "1").memory("buffer").dimensions() == rr::MemoryShape{0});
  CHECK(rr::error_of([&] { buffer.write({0}, rr::Value(std::vector<std::uint8_t>{1})); }).code ==
        rr::ErrorCode::read_only_member);
}

TEST_CASE("frames flow to every endpoint of a camera's pipe while it streams") {
  std::unique_ptr<WebcamsDevice> webcams;
  rr::RunningNode node([&](rr::Node& made) { webcams = std::make_unique<WebcamsDevice>(made, [] { return Pose{}; }); });
  const auto host = rr::connect(node.url("Webcam"));
  const auto left = host.object("Webcams", "0");
  int first = 0, second = 0, of_right = 0;
  const auto still = left.call("CaptureFrame");
  const auto endpoint = left.connect_pipe("FrameStream", [&](const rr::Value& frame) {
    ++first;
    CHECK(frame == still);
  });
  left.connect_pipe("FrameStream", [&](const rr::Value&) { ++second; });
  host.object("Webcams", "1").connect_pipe("FrameStream", [&](const rr::Value&) { ++of_right; });
  left.call("StartStreaming");
  // More than may be under way without acknowledgement.
  REQUIRE(host.connection().run_until([&] { return first >= 4 && second >= 4; }, 20s));

  endpoint.close();
  const int closed_at = first;
  const int after = second + 2;
  REQUIRE(host.connection().run_until([&] { return second >= after; }, 20s));
  CHECK(first == closed_at);
  CHECK(of_right == 0);

  left.call("StopStreaming");
  const int stopped_at = second;
  host.object("Webcams", "1").call("StartStreaming");
  REQUIRE(host.connection().run_until([&] { return of_right >= 2; }, 20s));
  CHECK(second == stopped_at);
}

TEST_CASE("a camera that fails is an error to its clients, and its stream goes on when it is started again") {
  TestWebcam device;
  auto& node = device.node;
  auto& camera = *device.camera;
  const auto host = rr::connect(node.url("Webcam"));
  CHECK(host.get("WebcamNames") == rr::Value(rr::MapInt32{{{0, "Test"}}}));
  const auto webcam = host.object("Webcams", "0");
  CHECK(field_of(webcam.call("CaptureFrame"), "data") == rr::Value(std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6}));
  webcam.call("CaptureFrameToBuffer");
  CHECK(webcam.memory("multidimbuffer").read() ==
        rr::Value(rr::MultiDimArray{{1, 2, 3}, rr::Array::take(std::vector<std::uint8_t>{3, 6, 2, 5, 1, 4})}));

  int frames = 0;
  const auto take_frame = [&](const rr::Value&) { ++frames; };
  const auto stream = webcam.connect_pipe("FrameStream", take_frame);
  webcam.call("StartStreaming");
  REQUIRE(host.connection().run_until([&] { return frames >= 2; }, 20s));
  node.ask([&](rr::Node&) { return camera.problem = "camera 'Test' is lost: /dev/video0 was unplugged"; });
  REQUIRE(host.connection().run_until([&] { return !stream.is_open(); }, 20s));
  for (const char* function : {"CaptureFrame", "CaptureFrameToBuffer", "StartStreaming"})
    CHECK(rr::error_of([&] { webcam.call(function); }).message == "camera 'Test' is lost: /dev/video0 was unplugged");

  node.ask([&](rr::Node&) {
    camera.problem.clear();
    return 0;
  });
  webcam.connect_pipe("FrameStream", take_frame);
  webcam.call("StartStreaming");
  const int after = frames + 2;
  CHECK(host.connection().run_until([&] { return frames >= after; }, 20s));
}

TEST_CASE("a stream asks a slow camera for one frame at a time, and for none after it was stopped") {
  TestWebcam device;
  auto& node = device.node;
  auto& camera = *device.camera;
  const auto host = rr::connect(node.url("Webcam"));
  const auto webcam = host.object("Webcams", "0");
  int frames = 0;
  webcam.connect_pipe("FrameStream", [&](const rr::Value&) { ++frames; });
  webcam.call("StartStreaming");
  REQUIRE(host.connection().run_until([&] { return frames >= 1; }, 20s));
  node.ask([&](rr::Node&) { return camera.is_slow = true; });
  const auto waiting = [&] { return node.ask([&](rr::Node&) { return camera.waiting.size(); }); };
  while (waiting() == 0) webcam.get("Name");
  // The stream's period passes twice.
  const auto later = std::chrono::steady_clock::now() + 200ms;
  while (std::chrono::steady_clock::now() < later) webcam.get("Name");
  CHECK(waiting() == 1);
  webcam.call("StopStreaming");
  const int stopped_at = frames;
  node.ask([&](rr::Node&) {
    camera.waiting.front()({{2, 1, 6, std::vector<std::uint8_t>(6)}, {}});
    camera.waiting.clear();
    return 0;
  });
  for (int i = 0; i < 20; ++i) webcam.get("Name");
  CHECK(frames == stopped_at);
  CHECK(waiting() == 0);
}

TEST_CASE("the cameras follow the robot, and turn by themselves while there is none") {
  boost::asio::io_context io;
  const auto run_until = [&](const auto& is_done) {
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (!is_done() && std::chrono::steady_clock::now() < deadline) io.run_one_for(100ms);
    return is_done();
  };
  std::unique_ptr<CreateDevice> create;
  auto robot =
      std::make_unique<rr::RunningNode>([&](rr::Node& made) { create = std::make_unique<CreateDevice>(made); });
  PoseFollower follower(io, robot->url("Create"));
  const double before = follower.pose().heading;
  CHECK(run_until([&] { return follower.pose().heading > before; }));

  rr::connect(robot->url("Create")).call("Drive", 0, 0);
  CHECK(run_until([&] { return follower.pose().heading == 0; }));
  auto driver = std::make_unique<rr::RemoteObject>(rr::connect(robot->url("Create")));
  driver->call("Drive", -300, drive_straight);
  CHECK(run_until([&] { return follower.pose().position.x < -30; }));

  driver.reset();
  robot.reset();
  CHECK(run_until([&] { return follower.pose().heading > 0.01; }));
  CHECK(follower.pose().position.x < -30);
}
