#include "examples/demo/raw_frame.hpp"

#include <catch2/catch.hpp>
#include <vector>

using namespace rrgate::demo;

namespace {

FrameResult convert(const RawLayout& layout, const std::vector<std::uint8_t>& bytes) {
  return to_image({layout, bytes});
}

}  // namespace

TEST_CASE("the pixels of a YUYV frame are those of BT.601") {
  // Black and white; then red, whose colour two pixels share.
  const auto [image, problem] = convert({RawFormat::yuyv, 4, 1, 8}, {16, 128, 235, 128, 81, 90, 81, 240});
  REQUIRE(problem.empty());
  CHECK((image.width == 4 && image.height == 1 && image.step == 12));
  CHECK(image.at(0, 0) == Color{0, 0, 0});
  CHECK(image.at(1, 0) == Color{255, 255, 255});
  CHECK(image.at(2, 0) == Color{255, 0, 0});
  CHECK(image.at(3, 0) == Color{255, 0, 0});
  const auto colors = convert({RawFormat::yuyv, 4, 1, 8}, {145, 54, 145, 34, 41, 240, 41, 110}).image;
  CHECK(colors.at(0, 0) == Color{0, 255, 1});
  CHECK(colors.at(2, 0) == Color{0, 0, 255});
  // Beyond what a camera should send.
  const auto extreme = convert({RawFormat::yuyv, 4, 1, 8}, {0, 0, 255, 0, 0, 255, 255, 255}).image;
  CHECK(extreme.at(0, 0) == Color{0, 135, 0});
  CHECK(extreme.at(3, 0) == Color{255, 125, 255});
}

TEST_CASE("frames of three bytes a pixel and of one are taken as they are") {
  const std::vector<std::uint8_t> bytes{1, 2, 3, 4, 5, 6};
  CHECK(convert({RawFormat::bgr24, 2, 1, 6}, bytes).image.at(1, 0) == Color{6, 5, 4});
  CHECK(convert({RawFormat::rgb24, 2, 1, 6}, bytes).image.at(1, 0) == Color{4, 5, 6});
  const auto grey = convert({RawFormat::grey, 3, 2, 3}, bytes).image;
  CHECK(grey.at(2, 0) == Color{3, 3, 3});
  CHECK(grey.at(0, 1) == Color{4, 4, 4});
}

TEST_CASE("rows may be longer than their pixels, and the last one may not be") {
  const RawLayout layout{RawFormat::yuyv, 2, 2, 7};
  REQUIRE(needed_bytes(layout) == 11);
  const std::vector<std::uint8_t> bytes{16, 128, 235, 128, 9, 9, 9, 235, 128, 16, 128};
  const auto [image, problem] = convert(layout, bytes);
  REQUIRE(problem.empty());
  CHECK(image.step == 6);
  CHECK(image.at(0, 0) == Color{0, 0, 0});
  CHECK(image.at(1, 0) == Color{255, 255, 255});
  CHECK(image.at(0, 1) == Color{255, 255, 255});
  CHECK(image.at(1, 1) == Color{0, 0, 0});
}

TEST_CASE("a frame with too few bytes is refused at every length") {
  for (const auto format : {RawFormat::yuyv, RawFormat::bgr24, RawFormat::rgb24, RawFormat::grey}) {
    const RawLayout layout{format, 4, 3, 13};
    const std::vector<std::uint8_t> whole(needed_bytes(layout), 50);
    CHECK(convert(layout, whole).problem.empty());
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const std::vector<std::uint8_t> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      CHECK(convert(layout, part).problem.find("expected " + std::to_string(whole.size())) != std::string::npos);
    }
  }
}

TEST_CASE("sizes that can't be are refused, with what was found and expected") {
  using Catch::Matchers::Contains;
  constexpr std::uint32_t huge = 0xffffffff;
  CHECK_THAT(check_layout({RawFormat::grey, 0, 480, 640}), Contains("0 x 480 pixels, expected 1 to 16384"));
  CHECK_THAT(check_layout({RawFormat::grey, huge, huge, huge}), Contains("expected 1 to 16384"));
  CHECK_THAT(check_layout({RawFormat::mjpeg, 4000, 3000, 0}), Contains("36000000 bytes, expected at most"));
  CHECK_THAT(check_layout({RawFormat::yuyv, 3, 2, 8}), Contains("expected an even width"));
  CHECK_THAT(check_layout({RawFormat::yuyv, 640, 480, 1279}), Contains("1279 bytes, expected at least 1280"));
  CHECK_THAT(check_layout({RawFormat::yuyv, 640, 480, huge}), Contains("expected at most 67108864"));
  CHECK(check_layout({RawFormat::yuyv, 1920, 1080, 3840}).empty());
  CHECK_FALSE(convert({RawFormat::grey, huge, huge, huge}, {}).problem.empty());
  CHECK_FALSE(convert({RawFormat::mjpeg, 2, 2, 0}, {1}).problem.empty());
}
