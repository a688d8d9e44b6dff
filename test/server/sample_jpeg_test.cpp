// Frames of a camera that many look at.
#include "server/http/endpoints/sample_jpeg.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <vector>

using namespace rrgate;

namespace {

struct Camera {
  Camera() {
    types
        .add({"service test.cam\nstruct Image\nfield uint32 width\nfield uint32 height\nfield uint8[] data\nend\n"
              "object Cam\nwire Image live\nend\n"},
             rr::RobdefMode::strict)
        .value();
  }
  const rr::TypeDefinition& type() const { return types.find_entity("test.cam.Cam")->find_member("live")->type; }

  /// Of one colour.
  static SamplePtr frame(std::uint32_t width, std::size_t bytes) {
    Sample sample;
    sample.values.emplace_back(
        rr::Structure{"test.cam.Image",
                      {{"width", rr::Value(width)},
                       {"height", rr::Value(std::uint32_t{100})},
                       {"data", rr::Value(std::vector<std::uint8_t>(bytes, std::uint8_t{128}))}}});
    return std::make_shared<const Sample>(std::move(sample));
  }

  rr::TypeRegistry types;
  boost::asio::io_context io{1};
  MemoryBudget memory{1'000'000};
  Workers workers;
};

}  // namespace

TEST_CASE("a frame is encoded once for all who look at it, and counts until whoever still has it counts it himself") {
  Camera camera;
  std::vector<JpegImage> seen;
  const auto look = [&](SamplePtr sample) -> rr::awaitable<void> {
    seen.push_back(co_await jpeg_of(sample, camera.type(), camera.types, camera.memory, camera.workers));
  };
  auto first = Camera::frame(200, 60'000);
  const auto second = Camera::frame(200, 60'000);
  for (const auto& sample : {first, first, second, first})
    boost::asio::co_spawn(camera.io, look(sample), [](std::exception_ptr) {});
  camera.io.run();
  REQUIRE(seen.size() == 4);
  std::vector<const std::string*> all;
  for (const auto& jpeg : seen) {
    REQUIRE(jpeg.has_value());
    CHECK((*jpeg)->starts_with("\xff\xd8\xff"));
    all.push_back(jpeg->get());
  }
  CHECK(std::count(all.begin(), all.end(), first->jpeg->result->value().get()) == 3);
  CHECK(std::count(all.begin(), all.end(), second->jpeg->result->value().get()) == 1);
  const auto size = all.front()->size();
  CHECK(camera.memory.used() == 2 * size);
  const std::weak_ptr<const Sample> sample = first;
  first.reset();
  CHECK(sample.expired());  // nobody who has the image keeps the pixels
  CHECK(camera.memory.used() == size);
}

TEST_CASE("a frame that lies is refused to all who look at it") {
  Camera camera;
  int refused = 0;
  const auto look = [&](SamplePtr sample) -> rr::awaitable<void> {
    const auto jpeg = co_await jpeg_of(sample, camera.type(), camera.types, camera.memory, camera.workers);
    if (!jpeg) ++refused;
  };
  const auto lie = Camera::frame(200, 59'999);
  for (int i = 0; i < 2; ++i) boost::asio::co_spawn(camera.io, look(lie), [](std::exception_ptr) {});
  camera.io.run();
  CHECK(refused == 2);
  CHECK(camera.memory.used() == 0);
}
