#include "examples/demo/v4l2_camera.hpp"

#include <boost/asio/post.hpp>
#include <catch2/catch.hpp>
#include <cerrno>

#include "test/examples/demo/simulated_v4l2.hpp"

using namespace rrgate::demo;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

const std::string video0 = "/dev/video0";
/// Four pixels by two, grey: luma 1, 2, ... 8.
const std::vector<std::uint8_t> small_frame{1, 128, 2, 128, 3, 128, 4, 128, 5, 128, 6, 128, 7, 128, 8, 128};

/// A camera in use.
struct Watched {
  boost::asio::io_context io;
  SimulatedV4l2 system;
  std::vector<std::vector<std::uint8_t>> frames;
  std::vector<std::string> losses;
  V4l2Camera camera;

  explicit Watched(SimulatedDevice device = {}, std::chrono::milliseconds deadline = 10s)
      : camera(io, system, deadline) {
    system.plug_in(video0, std::move(device));
  }
  std::string start() {
    return camera.start(video0,
                        {[this](const RawFrame& frame) { frames.emplace_back(frame.bytes.begin(), frame.bytes.end()); },
                         [this](const std::string& why) { losses.push_back(why); }});
  }
  bool gets(std::size_t count) {
    return run_until(io, [&] { return frames.size() >= count; });
  }
  std::string loss() {
    run_until(io, [&] { return !losses.empty(); });
    CHECK(losses.size() == 1);
    CHECK_FALSE(camera.is_on());
    CHECK(system.is_all_given_back());
    return losses.empty() ? "" : losses.front();
  }
};

/// Why a camera of this kind does not start. Nothing of it is kept.
std::string refusal_of(const SimulatedDevice& device) {
  Watched watched(device);
  auto why = watched.start();
  CHECK_FALSE(watched.camera.is_on());
  CHECK(watched.system.is_all_given_back());
  CHECK(watched.start() == why);
  return why;
}

}  // namespace

TEST_CASE("frames come as the driver gives them, in buffers that it gets back") {
  Watched watched;
  REQUIRE(watched.start().empty());
  CHECK(watched.system.at(video0).is_streaming);
  CHECK(watched.system.at(video0).asked_format == V4L2_PIX_FMT_YUYV);
  CHECK(watched.camera.layout().step == 8);
  for (int i = 0; i < 20; ++i) watched.system.give(video0, {small_frame});
  REQUIRE(watched.gets(20));
  CHECK(watched.frames.back() == small_frame);

  watched.camera.stop();
  CHECK_FALSE(watched.system.at(video0).is_streaming);
  CHECK(watched.system.is_all_given_back());
  watched.camera.stop();
  REQUIRE(watched.start().empty());
  watched.system.give(video0, {small_frame});
  CHECK(watched.gets(21));
  CHECK(watched.losses.empty());
}

TEST_CASE("a driver with ever more frames leaves the thread to others, and a handler may stop the camera") {
  boost::asio::io_context io;
  SimulatedV4l2 system;
  system.plug_in(video0).always = SimulatedFrame{small_frame};
  V4l2Camera camera(io, system);
  int frames = 0, others = 0;
  std::function<void()> other = [&] {
    ++others;
    if (camera.is_on()) boost::asio::post(io, other);
  };
  REQUIRE(camera
              .start(video0, {[&](const RawFrame&) {
                                if (++frames == 40) camera.stop();
                              },
                              [](const std::string&) {}})
              .empty());
  other();
  CHECK(run_until(io, [&] { return !camera.is_on(); }));
  CHECK(frames == 40);
  CHECK(others >= 10);
  CHECK(system.is_all_given_back());
}

TEST_CASE("frames that are not whole are left out") {
  Watched watched;
  REQUIRE(watched.start().empty());
  auto short_frame = small_frame;
  short_frame.pop_back();
  watched.system.give(video0, {short_frame});
  watched.system.give(video0, {{}});
  watched.system.give(video0, {small_frame, 17});  // more than its buffer holds
  watched.system.give(video0, {small_frame, 0xffffffff});
  watched.system.give(video0, {small_frame, {}, {}, V4L2_BUF_FLAG_ERROR});
  watched.system.give(video0, {small_frame});
  REQUIRE(watched.gets(1));
  CHECK(watched.frames.size() == 1);
  CHECK(watched.losses.empty());
}

TEST_CASE("a camera without whole frames is lost after a while, with what was wrong") {
  Watched silent({}, 30ms);
  REQUIRE(silent.start().empty());
  CHECK_THAT(silent.loss(), Equals("/dev/video0 has given no whole frame for 30 ms"));
  SimulatedDevice device;
  device.always = SimulatedFrame{{1, 2, 3}};
  Watched cut(device, 30ms);
  REQUIRE(cut.start().empty());
  CHECK_THAT(cut.loss(), Contains("no whole frame for 30 ms; the last one had 3 bytes, expected 16 to 16"));
  CHECK(cut.frames.empty());
}

TEST_CASE("a camera that is unplugged between two frames says so once, and is started again when it is back") {
  Watched watched;
  REQUIRE(watched.start().empty());
  watched.system.give(video0, {small_frame});
  REQUIRE(watched.gets(1));
  watched.system.unplug(video0);
  CHECK_THAT(watched.loss(), Equals("/dev/video0 was unplugged"));
  CHECK_THAT(watched.start(), Equals("/dev/video0 can't be opened: No such file or directory"));
  watched.system.plug_in(video0);
  REQUIRE(watched.start().empty());
  watched.system.give(video0, {small_frame});
  CHECK(watched.gets(2));
}

TEST_CASE("a driver that fails while frames flow ends them") {
  for (const auto& [request, error, sentence] :
       std::vector<std::tuple<unsigned long, int, std::string>>{{VIDIOC_DQBUF, EIO, "gives no frame: Input/output"},
                                                                {VIDIOC_QBUF, ENODEV, "was unplugged"},
                                                                {VIDIOC_QBUF, EINVAL, "takes no buffer: Invalid"}}) {
    Watched watched;
    REQUIRE(watched.start().empty());
    watched.system.at(video0).errors[request] = error;
    watched.system.give(video0, {small_frame});
    CHECK_THAT(watched.loss(), Contains(sentence));
  }
  Watched lying;
  REQUIRE(lying.start().empty());
  lying.system.give(video0, {small_frame, {}, 4});
  CHECK_THAT(lying.loss(), Contains("filled its buffer 4, expected 0 to 3"));
}

TEST_CASE("a driver that wakes its reader for nothing, again and again, is given up") {
  Watched watched;
  REQUIRE(watched.start().empty());
  std::function<void()> wake = [&] {
    watched.system.wake(video0);
    if (watched.camera.is_on()) boost::asio::post(watched.io, wake);
  };
  wake();
  CHECK_THAT(watched.loss(), Contains("says that it has a frame, and has none"));
}

TEST_CASE("what a driver says is checked before anything is allocated") {
  const auto with = [](const auto& change) {
    SimulatedDevice device;
    change(device);
    return refusal_of(device);
  };
  CHECK_THAT(with([](auto& device) { device.width = 0; }), Contains("0 x 2 pixels"));
  CHECK_THAT(with([](auto& device) { device.width = device.height = 0xfffffffe; }), Contains("expected 1 to 16384"));
  CHECK_THAT(with([](auto& device) { device.step = 7; }), Contains("7 bytes, expected at least 8"));
  CHECK_THAT(with([](auto& device) { device.step = 0x80000000; }), Contains("expected at most 67108864"));
  CHECK_THAT(with([](auto& device) { device.frame_bytes = 15; }), Contains("15 bytes, expected 16 to 67108864"));
  CHECK_THAT(with([](auto& device) { device.frame_bytes = 0x4000001; }), Contains("67108865 bytes, expected 16 to"));
  CHECK_THAT(with([](auto& device) { device.buffer_bytes = 15; }), Contains("a buffer of 15 bytes, expected 16 to"));
  CHECK_THAT(with([](auto& device) { device.buffer_bytes = 0xffffffff; }), Contains("buffer of 4294967295 bytes"));
  CHECK_THAT(with([](auto& device) { device.buffers = 0; }), Contains("out of memory"));
  CHECK_THAT(with([](auto& device) { device.format = V4L2_PIX_FMT_H264; }), Contains("not asked for"));
  CHECK_THAT(with([](auto& device) { device.formats = {V4L2_PIX_FMT_H264}; }), Contains("no format that is known"));
  CHECK_THAT(with([](auto& device) { device.capabilities = V4L2_CAP_VIDEO_CAPTURE; }), Contains("is no camera"));
  CHECK_THAT(with([](auto& device) { device.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING; }),
             Contains("is no camera"));
}

TEST_CASE("each step at which a driver can fail has a sentence, and gives everything back") {
  for (const auto& [request, sentence] : std::vector<std::pair<unsigned long, std::string>>{
           {VIDIOC_QUERYCAP, "is no video device: "},
           {VIDIOC_ENUM_FMT, "no format that is known"},
           {VIDIOC_S_FMT, "takes no format: another program uses it"},
           {VIDIOC_REQBUFS, "gives no buffers: another program uses it"},
           {VIDIOC_QUERYBUF, "does not show its buffer: "},
           {VIDIOC_QBUF, "takes no buffer: "},
           {VIDIOC_STREAMON, "does not start: another program uses it"}}) {
    SimulatedDevice device;
    device.errors[request] = EBUSY;
    CHECK_THAT(refusal_of(device), Contains("/dev/video0 ") && Contains(sentence));
  }
  SimulatedDevice forbidden;
  forbidden.open_error = EACCES;
  CHECK_THAT(refusal_of(forbidden), Contains("Permission denied; is this user in the group 'video'?"));
  Watched watched;
  watched.system.refuses_to_map = true;
  CHECK_THAT(watched.start(), Contains("can't be mapped"));
  CHECK(watched.system.is_all_given_back());
}

TEST_CASE("rows with padding, an odd width and another number of buffers are the driver's right") {
  SimulatedDevice device;
  device.width = 5;
  device.step = 13;
  device.frame_bytes = 30;
  for (const std::uint32_t buffers : {1, 2, 8}) {
    device.buffers = buffers;
    Watched watched(device);
    REQUIRE(watched.start().empty());
    CHECK(watched.camera.layout().width == 4);
    for (int i = 0; i < 10; ++i) watched.system.give(video0, {std::vector<std::uint8_t>(21, 100)});
    CHECK(watched.gets(10));
  }
}

TEST_CASE("the best format is chosen, in whatever order they are offered") {
  for (const auto& [formats, chosen] : std::vector<std::pair<std::vector<std::uint32_t>, RawFormat>>{
           {{V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_H264, V4L2_PIX_FMT_YUYV}, RawFormat::yuyv},
           {{V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_RGB24, V4L2_PIX_FMT_BGR24}, RawFormat::bgr24},
           {{V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_RGB24}, RawFormat::rgb24},
           {{V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_GREY}, RawFormat::grey},
           {{V4L2_PIX_FMT_MJPEG}, RawFormat::mjpeg}}) {
    SimulatedDevice device;
    device.formats = formats;
    device.step = 12;
    device.frame_bytes = 100;
    Watched watched(device);
    REQUIRE(watched.start().empty());
    CHECK(watched.camera.layout().format == chosen);
  }
}

TEST_CASE("cameras are found among the video devices, and none of them is switched on") {
  SimulatedV4l2 system;
  SimulatedDevice desk{"Desk \xffView", "usb-2"};
  SimulatedDevice of_its_metadata = desk, encoded = desk, forbidden = desk, silent = desk;
  of_its_metadata.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  encoded.formats = {V4L2_PIX_FMT_H264};
  forbidden.open_error = EACCES;
  silent.errors[VIDIOC_QUERYCAP] = EIO;
  system.plug_in("/dev/video0", desk);
  system.plug_in("/dev/video1", of_its_metadata);
  system.plug_in("/dev/video2", encoded);
  system.plug_in("/dev/video3", forbidden);
  system.plug_in("/dev/video4", silent);
  SimulatedDevice long_name;
  long_name.name = std::string(40, 'x');
  system.plug_in("/dev/video5", long_name);
  const auto found = find_cameras(system);
  CHECK(found.cameras == std::vector<CameraIdentity>{{"/dev/video0", "Desk ?View", "usb-2"},
                                                     {"/dev/video5", std::string(32, 'x'), "usb-1"}});
  CHECK(found.problems ==
        std::vector<std::string>{"/dev/video3 can't be opened: Permission denied; is this user in the group 'video'?"});
  CHECK(system.is_all_given_back());
  CHECK(system.at("/dev/video0").asked_format == 0);
  for (int i = 10; i < 50; ++i) system.plug_in("/dev/video" + std::to_string(i));
  CHECK(find_cameras(system).cameras.size() == 16);
}

TEST_CASE("the video devices of this machine can be asked") {
  LinuxV4l2 system;
  for (const auto& path : system.list()) CHECK(path.starts_with("/dev/video"));
  CHECK(system.open("/dev/no-camera") == -ENOENT);
  boost::asio::io_context io;
  V4l2Camera camera(io, system);
  CHECK_THAT(camera.start("/dev/null", {}), Contains("/dev/null is no video device: "));
}
