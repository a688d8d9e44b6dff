#include "examples/demo/camera_source.hpp"

#include <catch2/catch.hpp>

#include "test/examples/demo/jpeg_writer.hpp"
#include "test/examples/demo/simulated_v4l2.hpp"

using namespace rrgate::demo;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

const CameraIdentity desk{"/dev/video0", "Simulated Camera", "usb-1"};
constexpr CameraSource::Times patient{10s, 10s, 0ms};

SimulatedDevice camera_with(std::vector<std::uint8_t> frame) {
  SimulatedDevice device;
  device.always = SimulatedFrame{std::move(frame)};
  return device;
}

SimulatedDevice white_camera() {
  SimulatedDevice device = camera_with({});
  for (int i = 0; i < 8; ++i) device.always->bytes.insert(device.always->bytes.end(), {235, 128});
  return device;
}

struct Served {
  boost::asio::io_context io;
  SimulatedV4l2 system;
  CameraSource source;

  explicit Served(SimulatedDevice device, FoundBy by = FoundBy::port, CameraSource::Times times = patient)
      : source(io, system, desk, by, times) {
    system.plug_in(desk.path, std::move(device));
  }
  FrameResult take() {
    std::optional<FrameResult> taken;
    source.take([&](FrameResult result) { taken = std::move(result); });
    run_until(io, [&] { return taken.has_value(); });
    return taken.value_or(FrameResult{{}, "no answer"});
  }
};

}  // namespace

TEST_CASE("a camera is off until somebody asks for a frame, and again when nobody does") {
  Served served(white_camera(), FoundBy::port, {10s, 20ms, 0ms});
  CHECK_FALSE(served.source.is_on());
  CHECK(served.system.at(desk.path).times_opened == 0);
  const auto [image, problem] = served.take();
  REQUIRE(problem.empty());
  CHECK((image.width == 4 && image.height == 2));
  CHECK(image.at(3, 1) == Color{255, 255, 255});
  CHECK(served.source.is_on());
  CHECK(run_until(served.io, [&] { return !served.source.is_on(); }));
  CHECK(served.system.is_all_given_back());
  CHECK(served.take().problem.empty());
}

TEST_CASE("all who wait get the same frame, which comes after they asked") {
  Served served({});
  std::vector<Color> seen;
  const auto look = [&](const FrameResult& result) { seen.push_back(result.image.at(0, 0)); };
  served.source.take(look);
  served.source.take(look);
  std::vector<std::uint8_t> frame(16, 128);
  frame[0] = 235;
  served.system.give(desk.path, {frame});
  REQUIRE(run_until(served.io, [&] { return seen.size() == 2; }));
  CHECK(seen == std::vector<Color>(2, Color{255, 255, 255}));
  frame[0] = 16;
  served.source.take(look);
  served.system.give(desk.path, {frame});
  REQUIRE(run_until(served.io, [&] { return seen.size() == 3; }));
  CHECK(seen.back() == Color{0, 0, 0});
}

TEST_CASE("requests that wait for a frame are counted") {
  Served served({});
  int answered = 0;
  for (int i = 0; i < 256; ++i) served.source.take([&](const FrameResult&) { ++answered; });
  CHECK_THAT(served.take().problem, Contains("256 requests wait for a frame already"));
  CHECK(answered == 0);
}

TEST_CASE("who waits for a camera that is unplugged gets a sentence, and a frame when it is back") {
  Served served({});
  std::vector<std::string> problems;
  for (int i = 0; i < 2; ++i)
    served.source.take([&](const FrameResult& result) { problems.push_back(result.problem); });
  served.system.unplug(desk.path);
  REQUIRE(run_until(served.io, [&] { return problems.size() == 2; }));
  CHECK_THAT(problems[0], Equals("camera 'Simulated Camera' is lost: /dev/video0 was unplugged"));
  CHECK(problems[1] == problems[0]);
  CHECK_THAT(served.take().problem, Equals("camera 'Simulated Camera' is not plugged in; it was /dev/video0"));
  served.system.plug_in("/dev/video3", white_camera());  // under another number
  CHECK(served.take().problem.empty());
}

TEST_CASE("a camera that has failed is left alone for a while") {
  Served served(white_camera(), FoundBy::path, {10s, 10s, 10s});
  served.system.at(desk.path).open_error = 16;
  const auto why = served.take().problem;
  CHECK_THAT(why, Equals("/dev/video0 can't be opened: another program uses it"));
  served.system.at(desk.path).open_error = 0;
  CHECK(served.take().problem == why);
  CHECK(served.system.at(desk.path).times_opened == 0);
}

TEST_CASE("a camera is found again by its path, by its port, or by its name") {
  const CameraIdentity same{"/dev/video5", desk.name, desk.port};
  const CameraIdentity elsewhere{"/dev/video6", desk.name, "usb-9"};
  const CameraIdentity other{"/dev/video0", "Other Camera", "usb-1"};
  using Cameras = std::vector<CameraIdentity>;
  CHECK(find_again(desk, FoundBy::path, {}) == "/dev/video0");
  CHECK(find_again(desk, FoundBy::port, Cameras{other, elsewhere, same}) == "/dev/video5");
  CHECK(find_again(desk, FoundBy::port, Cameras{other, elsewhere}).empty());
  CHECK(find_again(desk, FoundBy::name, Cameras{other, elsewhere}) == "/dev/video6");
  CHECK(find_again(desk, FoundBy::name, Cameras{other}).empty());
  CHECK(find_again(desk, FoundBy::port, Cameras{same, desk}) == "/dev/video0");
}

TEST_CASE("Motion JPEG is decoded, but for a few damaged frames at its start") {
  const auto jpeg = make_jpeg(8, 8, {10, 200, 30});
  SimulatedDevice device = camera_with(jpeg);
  device.formats = {V4L2_PIX_FMT_MJPEG};
  device.step = 0;
  device.frame_bytes = 100'000;
  auto cut = jpeg;
  cut.resize(cut.size() / 2);
  for (int i = 0; i < 5; ++i) device.frames.push_back({cut});
  Served served(device);
  const auto [image, problem] = served.take();
  REQUIRE(problem.empty());
  CHECK((image.width == 8 && image.at(4, 4).green > 190));
  served.system.at(desk.path).always = SimulatedFrame{cut};
  CHECK_THAT(served.take().problem, Contains("gave 10 unreadable frames; in the last, a JPEG can't be decoded"));
}
