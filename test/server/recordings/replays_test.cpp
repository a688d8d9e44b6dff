// Recordings that are played as devices: which there are, how many, and what ends them.
#include "server/recordings/replays.hpp"

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <filesystem>

#include "core/session/service/service_index.hpp"
#include "server/recordings/recording_files.hpp"
#include "test/server/support/no_threads.hpp"
#include "test/server/support/recorded_robot.hpp"
#include "test/support/folder.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

struct Played {
  boost::asio::io_context io{1};
  test::Folder folder;
  Config config = {};
  DeviceRegistry devices{io.get_executor(), config};
  MemoryBudget budget;
  std::unique_ptr<Replays> replays;

  explicit Played(std::size_t memory = 10'000'000)
      : budget(memory), replays(std::make_unique<Replays>(io.get_executor(), devices, budget.charge(""))) {}
  ~Played() {
    if (replays) replays->stop();
    devices.stop();
    io.restart();
    io.run_for(std::chrono::milliseconds(50));
  }
  static std::string name_of(int number) { return "arm.Robot.2026112" + std::to_string(number) + "T083000123Z.mcap"; }
  std::string write(int number) {
    test::write_recording(folder.path(name_of(number)));
    return name_of(number);
  }
  static std::string device_of(const std::string& file) { return replay_of(recording_of_file(file)); }
  std::string write_endless(int number) {
    test::write_endless_recording(folder.path(name_of(number)));
    return name_of(number);
  }
  /// What becomes of it; nullopt: nothing yet.
  std::shared_ptr<std::optional<rr::Result<>>> begin(const std::string& file) {
    return begin(device_of(file), std::vector<std::string>{file});
  }
  std::shared_ptr<std::optional<rr::Result<>>> begin(const std::string& device, std::vector<std::string> files) {
    auto out = std::make_shared<std::optional<rr::Result<>>>();
    boost::asio::co_spawn(io, replays->play(device, folder.path(""), std::move(files)),
                          [out](const std::exception_ptr&, const rr::Result<>& result) { *out = result; });
    return out;
  }
  bool until(const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!is_so() && std::chrono::steady_clock::now() < end) {
      io.restart();
      io.run_one_for(std::chrono::milliseconds(20));
    }
    return is_so();
  }
  rr::Result<> play(const std::string& file) {
    const auto outcome = begin(file);
    REQUIRE(until([&] { return outcome->has_value(); }));
    return **outcome;
  }
  bool has_gone(const std::string& name) {
    return until([&] { return !replays->is_playing(name) && !devices.find(name); });
  }
};

}  // namespace

TEST_CASE("replays: a file is a shared device of the recorded service and of one that controls it, until it is ended") {
  Played made;
  const auto file = made.write(1);
  REQUIRE(made.play(file));
  const auto name = Played::device_of(file);
  CHECK(name == "replay~arm.Robot.20261121T083000123Z");
  CHECK(recording_of_replay(name) == "arm.Robot.20261121T083000123Z");
  const auto* device = made.devices.find(name);
  REQUIRE(device);
  CHECK(device->is_shared());
  REQUIRE(made.until([&] { return device->state() == DeviceState::online; }));
  std::set<std::string> services;
  for (const auto& service : device->identity()->services) services.insert(service.name);
  services.erase(std::string(rr::service_index_name));
  CHECK(services == std::set<std::string>{"Robot", "replay"});
  CHECK(made.play(file));  // goes on
  CHECK(made.devices.find(name) == device);
  CHECK(made.replays->list() == std::vector<std::string>{name});
  made.replays->end(name);
  CHECK_FALSE(made.devices.find(name));
  REQUIRE(made.play(file));  // anew
  CHECK(made.devices.find(name));
}

TEST_CASE("replays: there are four at a time, and who has ended one begins another at once") {
  Played made;
  for (int i = 1; i <= 4; ++i) REQUIRE(made.play(made.write(i)));
  const auto fifth = made.write(5);
  const auto refused = made.play(fifth);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == rr::ErrorCode::invalid_state);
  CHECK(refused.error().message == "as many recordings are played as may be (4)");
  made.replays->end(made.replays->list().front());
  CHECK(made.play(fifth));
}

TEST_CASE("replays: those whose files are still read when they end go at once, and leave room for others") {
  Played made;
  std::vector<std::shared_ptr<std::optional<rr::Result<>>>> outcomes;
  for (int i = 1; i <= 4; ++i) outcomes.push_back(made.begin(made.write_endless(i)));
  REQUIRE(made.until([&] { return made.replays->list().size() == 4; }));
  const auto fifth = made.write(5);
  outcomes.push_back(made.begin(fifth));  // before what their threads say
  for (const auto& name : made.replays->list()) made.replays->end(name);
  CHECK(made.replays->list().empty());
  const auto has_all = [&] {
    return std::all_of(outcomes.begin(), outcomes.end(), [](const auto& each) { return each->has_value(); });
  };
  REQUIRE(made.until(has_all));
  for (int i = 0; i < 4; ++i) {
    const auto& ended = **outcomes[static_cast<std::size_t>(i)];
    REQUIRE_FALSE(ended);
    CHECK(ended.error().code == rr::ErrorCode::operation_cancelled);
  }
  const auto& refused = **outcomes.back();
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == rr::ErrorCode::member_busy);
  CHECK(refused.error().message == "as many recordings as may be played (4) are still ending");
  CHECK(made.until([&] { return made.play(fifth).has_value(); }));
}

TEST_CASE("replays: a file that is still read holds up nobody who stops") {
  Played made;
  const auto outcome = made.begin(made.write_endless(1));
  REQUIRE(made.until([&] { return !made.replays->list().empty(); }));
  made.replays->stop();
  made.replays.reset();  // waits for its thread
  REQUIRE(made.until([&] { return outcome->has_value(); }));
  const auto& ended = **outcome;
  REQUIRE_FALSE(ended);
  CHECK(ended.error().code == rr::ErrorCode::operation_cancelled);
}

TEST_CASE("replays: one whose file has gone, or whose folder is none any more, ends") {
  Played made;
  const auto file = made.write(1);
  const auto other = made.write(2);
  REQUIRE(made.play(file));
  REQUIRE(made.play(other));
  std::filesystem::remove(made.folder.path(file));
  CHECK(made.has_gone(Played::device_of(file)));
  made.replays->keep_folder(made.folder.path(""));
  CHECK(made.replays->is_playing(Played::device_of(other)));
  made.replays->keep_folder("/elsewhere");
  CHECK(made.has_gone(Played::device_of(other)));
}

TEST_CASE("replays: several files of a recording are one device, which ends when one of them has gone") {
  Played made;
  const auto first = made.write(1);
  const auto recording = recording_of_file(first);
  const auto second = recording + "-2.mcap";
  test::write_recording(made.folder.path(second), 0, 200);
  const auto outcome = made.begin(replay_of(recording), {first, second});
  REQUIRE(made.until([&] { return outcome->has_value(); }));
  REQUIRE(**outcome);
  for (const auto& each : {first, second}) {
    const auto alone = made.begin(replay_of_file(each), {each});
    REQUIRE(made.until([&] { return alone->has_value(); }));
    REQUIRE(**alone);
    CHECK(recording_of_replay(replay_of_file(each)) == recording);
  }
  CHECK(made.replays->list() ==
        std::vector<std::string>{"replay~" + recording, "replay~" + recording + "-1", "replay~" + recording + "-2"});
  std::filesystem::remove(made.folder.path(second));
  CHECK(made.has_gone(replay_of(recording)));
  CHECK(made.has_gone(replay_of_file(second)));
  CHECK(made.replays->is_playing(replay_of_file(first)));
  made.replays->end_all_of(recording);
  CHECK(made.replays->list().empty());
}

TEST_CASE("replays: a file that was cut before its first service is not played, and may go") {
  Played made;
  const auto first = made.write(1);
  const auto recording = recording_of_file(first);
  const auto cut = recording + "-2.mcap";
  made.folder.write(cut, "");
  const auto outcome = made.begin(replay_of(recording), {first, cut});
  REQUIRE(made.until([&] { return outcome->has_value(); }));
  REQUIRE(**outcome);
  std::filesystem::remove(made.folder.path(cut));
  const auto later = std::chrono::steady_clock::now() + std::chrono::seconds(2);  // than the next look at the files
  made.until([&] { return std::chrono::steady_clock::now() > later; });
  CHECK(made.replays->is_playing(replay_of(recording)));
}

TEST_CASE("replays: a file that can't be played says why, and is no device") {
  Played made;
  const std::string damaged = "arm.Robot.20261121T083000123Z.mcap";
  made.folder.write(damaged, "no MCAP");
  const auto refused = made.play(damaged);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == rr::ErrorCode::data_serialization_error);
  CHECK(refused.error().message.starts_with(damaged + ": is no MCAP file"));  // and no folder
  const std::string gone = "arm.Robot.20261122T083000123Z.mcap";
  const auto missing = made.play(gone);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == rr::ErrorCode::resource_not_found);
  CHECK(missing.error().message.starts_with(gone + ": can't be read: No such file"));
  CHECK(made.devices.all().empty());
  CHECK(made.replays->list().empty());
}

TEST_CASE("replays: one that takes more memory than is left is refused") {
  Played made(100);
  const auto file = made.write(1);
  const auto refused = made.play(file);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == rr::ErrorCode::out_of_system_resource);
  CHECK(refused.error().message.find(" memory left to play " + file) != std::string::npos);
  CHECK(made.budget.refusals() == 1);
  const auto several = made.begin("replay~several", {file, "none.mcap"});  // which is not read any more
  REQUIRE(made.until([&] { return several->has_value(); }));
  REQUIRE_FALSE(several->value());
  CHECK(several->value().error().code == rr::ErrorCode::out_of_system_resource);
  CHECK(made.devices.all().empty());
}

TEST_CASE("replays: one for which there is no thread is refused, and can be played when there is one") {
  Played made;
  const auto file = made.write(1);
  {
    const test::NoThreads none;
    const auto refused = made.play(file);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == rr::ErrorCode::system_resource_error);
    CHECK(refused.error().message.find("there is no thread to play " + file) != std::string::npos);
  }
  CHECK(made.replays->list().empty());
  CHECK(made.play(file));
}

TEST_CASE("replays: one whose file is still read is not played yet, but is one of those that can be ended") {
  Played made;
  const auto file = made.write_endless(1);
  const auto name = Played::device_of(file);
  const auto outcome = made.begin(file);
  REQUIRE(made.until([&] { return made.replays->list() == std::vector<std::string>{name}; }));
  CHECK_FALSE(made.replays->is_playing(name));
  const auto other = made.write(2);
  REQUIRE(made.play(other));
  CHECK(made.replays->is_playing(Played::device_of(other)));
  made.replays->end(name);
  CHECK(made.replays->list() == std::vector<std::string>{Played::device_of(other)});
}

TEST_CASE("replays: who waits for one to begin hears of its end, and of that of the gateway") {
  Played made;
  const auto file = made.write(1);
  const auto outcome = made.begin(file);
  REQUIRE(made.until([&] { return !made.replays->list().empty(); }));
  made.replays->stop();
  REQUIRE(made.until([&] { return outcome->has_value(); }));
  const auto late = made.play(file);
  REQUIRE_FALSE(late);
  CHECK(late.error().code == rr::ErrorCode::operation_cancelled);
  SECTION("and goes while its threads run") {
    made.replays.reset();
  }
}
