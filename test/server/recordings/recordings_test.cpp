// What recordings may take of a folder: whose files go, and who ends when it is full.
#include "server/recordings/recordings.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <fstream>

#include "test/server/support/ring_file.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;

namespace {

/// A gateway's recordings of a device that is away.
struct RecordedArm {
  boost::asio::io_context io{1};
  test::Folder folder;
  Config config = configured();
  DeviceRegistry devices{io.get_executor(), config};
  ValueClients clients{io.get_executor(), MemoryBudget(1'000'000).charge("")};
  Recordings recordings{io.get_executor(), config, devices, clients, workers, MemoryBudget(1'000'000).charge("")};
  Workers workers;

  ~RecordedArm() {
    recordings.stop();
    clients.stop();
    devices.stop();
    run_for(std::chrono::milliseconds(100));
  }
  Config configured() {
    Config out;
    DeviceConfig arm;
    arm.name = "arm";
    arm.url = rr::parse_url("rr+tcp://127.0.0.1:1/?service=Arm").value();
    out.devices.push_back(arm);
    out.recordings.folder = folder.path("");
    out.recordings.max_bytes = 1'000'000;
    return out;
  }
  static RecordingWish wish(std::size_t kept = 0) {
    RecordingWish out;
    out.device = "arm";
    out.service = "Arm";
    out.max_file_bytes = kept == 0 ? 0 : 100'000;
    out.kept_files = kept;
    return out;
  }
  void run_for(std::chrono::milliseconds time) {
    io.restart();
    io.run_for(time);
  }
  template <class T>
  T wait_for(rr::awaitable<T> work) {
    std::optional<T> out;
    boost::asio::co_spawn(io, std::move(work), [&out](const std::exception_ptr& failure, T result) {
      if (failure) std::rethrow_exception(failure);
      out.emplace(std::move(result));
    });
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!out && std::chrono::steady_clock::now() < end) run_for(std::chrono::milliseconds(10));
    REQUIRE(out);
    return std::move(*out);
  }
  std::vector<RecordingInfo> list() { return wait_for(recordings.list(std::make_shared<AccessState>(), Identity())); }
  RecordingInfo look(const std::string& name) { return wait_for(recordings.find(name)).value(); }
  /// Until a recording of the configuration is under way.
  RecordingInfo standing() {
    RecordingInfo out;
    REQUIRE(until([&] {
      for (auto& each : list())
        if (each.is_standing && each.state == RecordingState::waiting) out = std::move(each);
      return !out.name.empty();
    }));
    return out;
  }
  bool until(const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!is_so() && std::chrono::steady_clock::now() < end) run_for(std::chrono::milliseconds(50));
    return is_so();
  }
  void fill(const std::string& name, std::uint64_t bytes) {
    if (!has(name)) std::ofstream(folder.path(name)).put(' ');
    std::filesystem::resize_file(folder.path(name), bytes);
  }
  bool has(const std::string& name) const { return std::filesystem::exists(folder.path(name)); }
  std::string ring_file(const std::string& name) {
    test::write_ring_file(folder.path(name), ring_of(wish(1)));
    return name;
  }
};

const std::string former[] = {"arm.Arm.20261121T083000123Z.mcap", "arm.Arm.20261122T083000123Z.mcap",
                              "arm.Arm.20261123T083000123Z.mcap", "arm.Arm.20261124T083000123Z.mcap"};

}  // namespace

TEST_CASE("recordings: a ring of files goes on over a restart of the gateway") {
  RecordedArm made;
  for (const auto& name : former) made.ring_file(name);
  made.fill("arm.Arm.20261120T083000123Z.mcap", 1000);  // of a client
  made.config.recordings.standing = {RecordedArm::wish(3)};
  made.recordings.follow_config();
  const auto begun = made.standing();
  CHECK(made.has("arm.Arm.20261120T083000123Z.mcap"));
  for (const auto& name : former) CHECK(made.has(name));  // until there is a message, of which the device has none
  REQUIRE(begun.files.size() == 1);
}

TEST_CASE("recordings: a ring keeps its files while the gateway is started again and the device stays away") {
  RecordedArm made;
  for (const auto* name : {&former[0], &former[1], &former[2]}) made.ring_file(*name);
  for (int start = 0; start < 3; ++start) {
    made.config.recordings.standing = {RecordedArm::wish(3)};
    made.recordings.follow_config();
    const auto begun = made.standing();
    CHECK(begun.files.size() == 1);
    made.config.recordings.standing.clear();  // as at a stop of the gateway
    made.recordings.follow_config();
    CHECK_FALSE(made.has(begun.name + ".mcap"));
  }
  for (const auto* name : {&former[0], &former[1], &former[2]}) CHECK(made.has(*name));
}

TEST_CASE("recordings: what the configuration wants goes on at once where it says that the device is elsewhere") {
  RecordedArm made;
  made.config.recordings.standing = {RecordedArm::wish()};
  made.recordings.follow_config();
  const auto before = made.standing().name;
  auto other = RecordedArm::wish();
  other.members = {"joints"};
  const auto clients = made.wait_for(made.recordings.begin(other)).value();
  auto next = made.config;
  next.devices.at(0).url = rr::parse_url("rr+tcp://127.0.0.1:2/?service=Arm").value();
  auto devices = made.devices.prepare(next).value();
  made.config = next;
  made.devices.replace(std::move(devices));
  made.recordings.follow_config();
  CHECK(made.standing().name != before);  // standing_period, after which it is begun anyway, is longer than that waits
  CHECK(made.look(clients).problem == "the device was changed in the configuration");
}

TEST_CASE("recordings: a ring makes room where the folder is full") {
  RecordedArm made;
  for (const auto& name : former) made.fill(made.ring_file(name), 300'000);
  made.config.recordings.standing = {RecordedArm::wish(10)};
  made.recordings.follow_config();
  made.standing();
  CHECK_FALSE(made.has(former[0]));
  CHECK(made.has(former[1]));
  made.fill("leg.Leg.20261121T083000123Z.mcap", 700'000);
  CHECK(made.until([&] { return !made.has(former[2]); }));
  CHECK_FALSE(made.has(former[1]));
  made.standing();
  CHECK(made.has("leg.Leg.20261121T083000123Z.mcap"));
}

TEST_CASE("recordings: clients leave room to what the configuration wants") {
  const std::size_t kept = GENERATE(0, 2);
  RecordedArm made;
  made.config.recordings.standing = {RecordedArm::wish(kept)};
  made.recordings.follow_config();
  made.standing();
  const auto client = made.wait_for(made.recordings.begin(RecordedArm::wish())).value();
  made.fill("leg.Leg.20261121T083000123Z.mcap", kept == 0 ? 850'000 : 750'000);
  made.run_for(std::chrono::milliseconds(1500));
  CHECK(made.look(client).state == RecordingState::waiting);
  made.fill("leg.Leg.20261121T083000123Z.mcap", kept == 0 ? 900'000 : 810'000);
  REQUIRE(made.until([&] { return made.look(client).state == RecordingState::failed; }));
  CHECK_THAT(made.look(client).problem, Catch::Contains("recordings have taken all that they may, ") &&
                                            Catch::Contains("more are for those that the configuration wants"));
  const auto refused = made.wait_for(made.recordings.begin(RecordedArm::wish()));
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == rr::ErrorCode::out_of_system_resource);
  made.run_for(std::chrono::milliseconds(1500));
  made.standing();
}

TEST_CASE("recordings: the largest of several clients' ends before the others have no room left") {
  RecordedArm made;
  const auto large = made.wait_for(made.recordings.begin(RecordedArm::wish())).value();
  const auto small = made.wait_for(made.recordings.begin(RecordedArm::wish())).value();
  made.fill(large + ".mcap", 920'000);
  REQUIRE(made.until([&] { return made.look(large).state == RecordingState::failed; }));
  CHECK_THAT(made.look(large).problem, Catch::Contains("has 920000 bytes of the 1000000 that 2 recordings"));
  made.run_for(std::chrono::milliseconds(1500));
  CHECK(made.look(small).state == RecordingState::waiting);
  made.fill(large + ".mcap", 1'000'000);
  REQUIRE(made.until([&] { return made.look(small).state == RecordingState::failed; }));
}

TEST_CASE("recordings: one that is alone takes all that there is") {
  RecordedArm made;
  const auto only = made.wait_for(made.recordings.begin(RecordedArm::wish())).value();
  made.fill(only + ".mcap", 990'000);
  made.run_for(std::chrono::milliseconds(1500));
  CHECK(made.look(only).state == RecordingState::waiting);
}

TEST_CASE("recordings: who may not record hears the same whether there is a recording") {
  RecordedArm made;
  const auto there = made.wait_for(made.recordings.begin(RecordedArm::wish())).value();
  AccessConfig closed;
  closed.rules = {AccessRule{{"operator"}, {"arm"}, {}, {}, {}, {Verb::record}}};
  Access access(closed);
  REQUIRE(access.load().has_value());
  const Identity stranger;
  const auto first = made.wait_for(made.recordings.find_for(access, stranger, there));
  const auto second = made.wait_for(made.recordings.find_for(access, stranger, "arm.Arm.20200101T000000000Z"));
  REQUIRE_FALSE(first.has_value());
  REQUIRE_FALSE(second.has_value());
  CHECK(first.error().code == rr::ErrorCode::permission_denied);
  CHECK(first.error().message == second.error().message);
  Identity may;
  may.name = "vera";
  may.roles = {"operator"};
  CHECK(made.wait_for(made.recordings.find_for(access, may, there)).has_value());
  const auto none = made.wait_for(made.recordings.find_for(access, may, "arm.Arm.20200101T000000000Z"));
  REQUIRE_FALSE(none.has_value());
  CHECK(none.error().code == rr::ErrorCode::resource_not_found);
}

TEST_CASE("recordings: one that has ended is deleted, and one that is under way is not") {
  RecordedArm made;
  const auto name = made.wait_for(made.recordings.begin(RecordedArm::wish())).value();
  const auto refused = made.wait_for(made.recordings.remove(name));
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == rr::ErrorCode::invalid_state);
  REQUIRE(made.recordings.end(name).has_value());
  CHECK(made.look(name).state == RecordingState::ended);
  REQUIRE(made.wait_for(made.recordings.remove(name)).has_value());
  CHECK_FALSE(made.has(name + ".mcap"));
  CHECK_FALSE(made.wait_for(made.recordings.find(name)).has_value());
  CHECK(made.list().empty());
}
