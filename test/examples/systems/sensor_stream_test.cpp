#include "examples/create-minimal/sensor_stream.hpp"

#include <catch2/catch.hpp>

using namespace create_minimal;

namespace {

using Bytes = std::vector<std::uint8_t>;

// The Open Interface's own example has other packets; this one: right bumper, -5 mm, 3 degrees, play.
const Bytes content{7, 1, 19, 0xff, 0xfb, 20, 0, 3, 18, 1};

Bytes packed(const Bytes& data) {
  Bytes out{19, static_cast<std::uint8_t>(data.size())};
  out.insert(out.end(), data.begin(), data.end());
  unsigned sum = 0;
  for (const auto byte : out) sum += byte;
  out.push_back(static_cast<std::uint8_t>(256 - sum % 256));
  return out;
}

std::vector<Bytes> packets(StreamReader& reader) {
  std::vector<Bytes> out;
  while (auto packet = reader.next()) out.push_back(std::move(*packet));
  return out;
}

}  // namespace

TEST_CASE("packets are found however the line cuts them") {
  auto twice = packed(content);
  const auto one = packed(content);
  twice.insert(twice.end(), one.begin(), one.end());
  for (std::size_t cut = 0; cut <= twice.size(); ++cut) {
    StreamReader reader;
    reader.feed(std::span(twice).first(cut));
    auto found = packets(reader);
    reader.feed(std::span(twice).subspan(cut));
    for (auto& each : packets(reader)) found.push_back(each);
    CHECK(found == std::vector<Bytes>{content, content});
  }
}

TEST_CASE("what is no packet is left out, and the next one is found") {
  const auto good = packed(content);
  const auto found_after = [&](Bytes bytes) {
    StreamReader reader;
    bytes.insert(bytes.end(), good.begin(), good.end());
    reader.feed(bytes);
    return packets(reader);
  };
  auto spoilt = good;
  spoilt[4] ^= 1;
  const Bytes cut(good.begin(), good.end() - 3);
  for (const auto& before : {Bytes{}, Bytes{1, 2, 3}, Bytes{19}, Bytes{19, 10}, Bytes{19, 255}, spoilt, cut})
    CHECK(found_after(before) == std::vector<Bytes>{content});
}

TEST_CASE("sensors are read from packets, and packets of other kinds refused") {
  const auto sensors = read_sensors(content);
  REQUIRE(sensors);
  CHECK(sensors->bumps == 1);
  CHECK(sensors->distance == -5);
  CHECK(sensors->angle == 3);
  CHECK(sensors->buttons == 1);
  for (std::size_t size = 1; size < content.size(); ++size)
    CHECK(read_sensors(std::span(content).first(size)).has_value() == (size == 2 || size == 5 || size == 8));
  CHECK(!read_sensors(Bytes{8, 0}));
}
