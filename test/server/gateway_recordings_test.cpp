// What the gateway answers to those who play recordings.
#include <catch2/catch.hpp>
#include <chrono>
#include <future>
#include <nlohmann/json.hpp>

#include "server/recordings/recordings.hpp"
#include "test/server/support/no_threads.hpp"
#include "test/server/support/recorded_robot.hpp"
#include "test/server/support/test_gateway.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

const std::string name = "arm.Robot.20261121T083000123Z";
const std::string file = name + ".mcap";
const std::string play = "POST /api/v1/recordings/" + file + "/play";

struct Site {
  Folder folder;
  TestGateway gateway;

  explicit Site(std::size_t memory = 64'000'000)
      : gateway(0, [&](Config& config) {
          config.recordings.folder = folder.path("");
          config.limits.memory = memory;
        }) {}
  TestClient::HttpResponse ask(const std::string& first) const {
    TestClient client(gateway.port());
    client.send(first + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n");
    return client.receive_response();
  }
};

}  // namespace

TEST_CASE("a recording that takes more memory than is left is refused as limits.memory says, and counted so") {
  const Site site(1'000'000);
  write_recording(site.folder.path(file), 300'000);
  const auto refused = site.ask(play);
  CHECK(refused.status == 503);
  CHECK_THAT(refused.head, Catch::Contains("Retry-After: 60\r\n"));
  CHECK_THAT(refused.body, Catch::Contains("the gateway has no memory left to play"));
  CHECK_THAT(site.ask("GET /metrics").body, Catch::Contains("rrgate_rejected_total{reason=\"memory\"} 1\n"));
}

TEST_CASE("a recording for which there is no thread is refused with 500, which says so") {
  const Site site;
  write_recording(site.folder.path(file));
  {
    const NoThreads none;
    const auto refused = site.ask(play);
    CHECK(refused.status == 500);
    CHECK_THAT(refused.body, Catch::Contains("there is no thread to play "));
  }
  CHECK(site.ask(play).status == 201);
}

TEST_CASE("recordings that are played take nothing from what the gateway may hold of devices") {
  Site site;
  write_recording(site.folder.path(file));
  REQUIRE(site.ask(play).status == 201);
  std::size_t held = 0;
  bool has_share = false;
  site.gateway.visit([&](Gateway& gateway) {
    auto& memory = gateway.memory();
    held = memory.used();
    has_share = memory.charge("").resize((memory.total() - held) / 2);
  });
  CHECK(held > 0);
  CHECK(has_share);
}

TEST_CASE("a recording that is damaged is refused as it is now") {
  const Site site;
  site.folder.write(file, "no MCAP");
  const auto refused = site.ask(play);
  CHECK(refused.status == 409);
  CHECK_THAT(refused.body, Catch::Contains("is no MCAP file"));
}

TEST_CASE("a recording that is still read is ended by those who may, and who has asked for it hears so") {
  const Site site;
  write_endless_recording(site.folder.path(file));
  auto playing = std::async(std::launch::async, [&] { return site.ask(play); });
  while (playing.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    CHECK(site.ask("DELETE /api/v1/recordings/" + file + "/play").status == 204);
  const auto ended = playing.get();
  CHECK(ended.status == 409);
  CHECK_THAT(ended.body, Catch::Contains("the recording is not to be played any more"));
}

TEST_CASE("a recording that is still read has no device yet") {
  Site site;
  write_endless_recording(site.folder.path(file));
  auto playing = std::async(std::launch::async, [&] { return site.ask(play); });
  const auto is_over = [&] { return playing.wait_for(std::chrono::seconds(0)) == std::future_status::ready; };
  bool is_read = false;
  while (!is_read && !is_over())
    site.gateway.visit([&](Gateway& gateway) { is_read = !gateway.recordings().replays().list().empty(); });
  REQUIRE(is_read);
  const auto told = nlohmann::json::parse(site.ask("GET /api/v1/recordings/" + name).body);
  CHECK(told.at("files").at(0).at("replay").is_null());
  CHECK(site.ask("DELETE /api/v1/recordings/" + name + "/play").status == 204);
  CHECK(playing.get().status == 409);
}
