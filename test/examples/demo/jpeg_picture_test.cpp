#include "examples/demo/jpeg_picture.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>

#include "test/examples/demo/jpeg_writer.hpp"

using namespace rrgate::demo;

namespace {

bool is_near(Color found, Color wanted) {
  const auto near = [](int a, int b) { return std::abs(a - b) <= 3; };
  return near(found.red, wanted.red) && near(found.green, wanted.green) && near(found.blue, wanted.blue);
}

/// Segments between the start of the image and its first scan, without those of `marker`.
std::vector<std::uint8_t> without_segments(const std::vector<std::uint8_t>& jpeg, std::uint8_t marker) {
  std::vector<std::uint8_t> left(jpeg.begin(), jpeg.begin() + 2);
  std::size_t at = 2;
  while (jpeg.at(at + 1) != 0xda) {
    const std::size_t size = 2u + jpeg.at(at + 2) * 256u + jpeg.at(at + 3);
    const auto begin = jpeg.begin() + static_cast<std::ptrdiff_t>(at);
    if (jpeg[at + 1] != marker) left.insert(left.end(), begin, begin + static_cast<std::ptrdiff_t>(size));
    at += size;
  }
  left.insert(left.end(), jpeg.begin() + static_cast<std::ptrdiff_t>(at), jpeg.end());
  return left;
}

constexpr Color orange{240, 140, 20};

}  // namespace

TEST_CASE("a JPEG becomes an image, also one in several scans") {
  for (const bool is_progressive : {false, true}) {
    auto jpeg = make_jpeg(33, 17, orange, is_progressive);
    const auto size = jpeg.size();
    jpeg.insert(jpeg.end(), {1, 2, 3});
    std::size_t used = 0;
    const auto [image, problem] = decode_jpeg(jpeg, &used);
    REQUIRE(problem.empty());
    CHECK(used == size);
    CHECK((image.width == 33 && image.height == 17 && image.step == 99 && image.data.size() == 99 * 17));
    CHECK(is_near(image.at(0, 0), orange));
    CHECK(is_near(image.at(32, 16), orange));
  }
}

TEST_CASE("a frame of Motion JPEG has the standard's Huffman tables where it brings none") {
  const auto jpeg = make_jpeg(16, 16, orange);
  const auto bare = without_segments(jpeg, 0xc4);
  REQUIRE(bare.size() < jpeg.size());
  const auto [image, problem] = decode_jpeg(bare);
  REQUIRE(problem.empty());
  CHECK(is_near(image.at(8, 8), orange));
}

TEST_CASE("a JPEG that ends early is refused, wherever it ends") {
  const auto jpeg = make_jpeg(40, 40, orange);
  for (std::size_t size = 0; size + 2 < jpeg.size(); ++size)
    CHECK_FALSE(decode_jpeg(std::span(jpeg).first(size)).problem.empty());
}

TEST_CASE("damaged bytes give a problem or an image of their size, and nothing else") {
  const auto jpeg = make_jpeg(24, 24, orange, true);
  for (std::size_t at = 0; at < jpeg.size(); ++at) {
    for (const int change : {0x01, 0x80, 0xff}) {
      auto damaged = jpeg;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ change);
      const auto [image, problem] = decode_jpeg(damaged);
      if (problem.empty())
        CHECK(image.data.size() == static_cast<std::size_t>(image.step) * static_cast<std::size_t>(image.height));
      else
        CHECK(image.data.empty());
    }
  }
  CHECK(decode_jpeg(std::vector<std::uint8_t>{'P', '6'}).problem.find("FF D8") != std::string::npos);
}

TEST_CASE("a JPEG that says that it is huge is refused before anything is allocated") {
  auto jpeg = make_jpeg(16, 16, orange);
  constexpr std::uint8_t start_of_frame[] = {0xff, 0xc0};
  const auto found = std::search(jpeg.begin(), jpeg.end(), std::begin(start_of_frame), std::end(start_of_frame));
  REQUIRE(found != jpeg.end());
  std::fill(found + 5, found + 9, std::uint8_t{0x7f});  // height and width
  CHECK(decode_jpeg(jpeg).problem.find("32639 x 32639 pixels") != std::string::npos);
  std::fill(found + 5, found + 9, std::uint8_t{0x1f});
  CHECK(decode_jpeg(jpeg).problem.find("expected at most") != std::string::npos);
}

TEST_CASE("a JPEG of thousands of scans is given up") {
  auto jpeg = make_jpeg(16, 16, orange, true);
  // The last scan once more, again and again.
  std::size_t last = 0;
  for (std::size_t at = 0; at + 1 < jpeg.size(); ++at)
    if (jpeg[at] == 0xff && jpeg[at + 1] == 0xda) last = at;
  REQUIRE(last != 0);
  const std::vector<std::uint8_t> scan(jpeg.begin() + static_cast<std::ptrdiff_t>(last), jpeg.end() - 2);
  jpeg.resize(jpeg.size() - 2);
  for (int i = 0; i < 500; ++i) jpeg.insert(jpeg.end(), scan.begin(), scan.end());
  jpeg.insert(jpeg.end(), {0xff, 0xd9});
  CHECK(decode_jpeg(jpeg).problem.find("more than 100 scans") != std::string::npos);
}
