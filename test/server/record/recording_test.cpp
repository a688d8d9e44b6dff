#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stop_token>

#include "server/json/schema.hpp"
#include "server/record/recording.hpp"
#include "test/support/folder.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

constexpr const char* definition = R"(service com.x
stdver 0.10
enum Mode
    idle = 0,
    busy = 1
end
struct Pose
    field double[3] position
    field Mode mode
    field Pose{list} history
end
object Robot
    wire Pose pose [readonly]
    event moved(Pose pose, int32 count)
    property uint8[] picture
    property double[2,2] matrix
end
)";

struct Recorded {
  rr::TypeRegistry types;
  RecordedService service;
  const rr::EntityDefinition* robot = nullptr;
  rr::OrderedJson named = {};

  explicit Recorded(const std::string& text = definition) {
    REQUIRE(types.add({text}, rr::RobdefMode::strict));
    named = rr::named_type_schemas(types);
    robot = types.find_entity("com.x.Robot");
    service.service = "Robot";
    service.url = "rr+tcp://h:1/?service=Robot";
    service.type = "com.x.Robot";
    service.node.name = "my.robot";
    service.definitions = {text};
    service.objects = {{"Robot", "com.x.Robot"}};
  }
  RecordingWriter write(const std::string& path, RecordingOptions options = {}) {
    auto writer = RecordingWriter::create(path, std::move(options)).value();
    add_to(writer);
    return writer;
  }
  void add_to(RecordingWriter& writer) {
    service.label = "Robot";
    REQUIRE(writer.add_service(service));
  }
  std::uint16_t add(RecordingWriter& writer, const char* member) {
    return writer.add_member(service, "Robot", "", *robot->find_member(member), named).value();
  }
};

/// As of a recording that has no other schemas.
rr::OrderedJson schema_of(const Recorded& robot, const char* member) {
  auto nodes = max_schema_nodes;
  return recorded_schema(*robot.robot->find_member(member), robot.named, nodes);
}

rr::OrderedJson value(int number) {
  return {{"value", number}};
}

std::vector<std::string> documents(Recording& recording) {
  std::vector<std::string> out;
  for (const auto& chunk : recording.chunks()) {
    const auto read = recording.read(chunk).value();
    for (const auto& message : read.messages) out.push_back(recording.read_document(message).value().dump());
  }
  return out;
}

}  // namespace

TEST_CASE("a recording tells its services, members, definitions and messages") {
  const test::Folder folder;
  Recorded robot;
  auto writer = RecordingWriter::create(folder.path("a.mcap")).value();
  robot.service.label = writer.free_label("Robot");
  CHECK(robot.service.label == "Robot");
  REQUIRE(writer.add_service(robot.service));
  CHECK(writer.free_label("Robot") == "Robot-2");
  const auto pose = robot.add(writer, "pose");
  const auto moved = robot.add(writer, "moved");
  REQUIRE(writer.write(pose, value(1), rr::TimeSpec{5, 6}, {10, 0}));
  REQUIRE(writer.write(moved, {{"pose", nullptr}, {"count", 3}}, {}, {9, 0}));  // the clock was set back
  REQUIRE(writer.close());

  auto recording = Recording::open(writer.path()).value();
  REQUIRE(recording.services().size() == 1);
  CHECK(recording.services()[0].definitions == std::vector<std::string>{definition});
  CHECK(recording.services()[0].node.name == "my.robot");
  CHECK(recording.services()[0].objects.at("Robot") == "com.x.Robot");
  REQUIRE(recording.members().size() == 2);
  CHECK(recording.members().at(pose).topic == "/Robot/pose");
  CHECK(recording.members().at(pose).type == "Pose");
  CHECK(recording.members().at(moved).kind == rr::MemberKind::event);
  CHECK(recording.members().at(moved).message_count == 1);
  CHECK(recording.begin() == 10'000'000'000u);
  CHECK(recording.end() == 10'000'000'000u);
  CHECK(mcap_time_text(recording.begin()) == "1970-01-01T00:00:10.000000000Z");
  CHECK(documents(recording) == std::vector<std::string>{R"({"value":1})", R"({"count":3,"pose":null})"});
  CHECK(recording.read(recording.chunks()[0]).value().messages[0].publish_time == 5'000'000'006u);
}

TEST_CASE("a file that is large enough is followed by the next, which stands for itself; the oldest go") {
  const test::Folder folder;
  Recorded robot;
  RecordingOptions options;
  options.max_bytes = 20'000;
  options.kept_files = 2;
  auto writer = robot.write(folder.path("a.mcap"), options);
  const auto pose = robot.add(writer, "pose");
  for (int i = 0; i < 1000; ++i) REQUIRE(writer.write(pose, value(i), {}, {i, 0}));
  REQUIRE(writer.close());
  CHECK(writer.message_count() == 1000);
  CHECK(!std::filesystem::exists(folder.path("a.mcap")));
  auto last = Recording::open(writer.path()).value();
  CHECK(documents(last).back() == R"({"value":999})");
  CHECK(last.services().at(0).type == "com.x.Robot");
  CHECK(last.size() < 22'000);
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& each :
       std::filesystem::directory_iterator(std::filesystem::path(writer.path()).parent_path()))
    ++files;
  CHECK(files == 2);
}

TEST_CASE("the files that follow leave those of an earlier recording alone, unless they are to be replaced") {
  const test::Folder folder;
  const auto earlier = folder.path("a-2.mcap");
  const auto record_much = [&](bool replaces) {
    Recorded robot;
    RecordingOptions options;
    options.max_bytes = 20'000;
    options.replaces = replaces;
    auto writer = robot.write(folder.path("a.mcap"), options);
    const auto pose = robot.add(writer, "pose");
    for (int i = 0; writer.path() == folder.path("a.mcap"); ++i) REQUIRE(writer.write(pose, value(i), {}, {i, 0}));
    REQUIRE(writer.close());
    return writer.path();
  };
  std::ofstream(earlier) << "of yesterday";
  CHECK(record_much(false) == folder.path("a-3.mcap"));
  CHECK(std::filesystem::file_size(earlier) == 12);
  CHECK(record_much(true) == earlier);
  CHECK(std::filesystem::file_size(earlier) > 12);
}

TEST_CASE("the files of a recording are one time line, however they are given") {
  const test::Folder folder;
  Recorded robot;
  RecordingOptions options;
  options.max_bytes = 10'000;
  auto writer = robot.write(folder.path("a.mcap"), options);
  const auto pose = robot.add(writer, "pose");
  for (int i = 0; i < 900; ++i) REQUIRE(writer.write(pose, value(i), {}, {i, 0}));
  robot.service.objects["Robot.arm"] = "com.x.Robot";  // found late
  REQUIRE(writer.add_service(robot.service));
  const auto moved = robot.add(writer, "moved");
  for (int i = 900; i < 1000; ++i) REQUIRE(writer.write(moved, {{"count", i}}, {}, {i, 0}));
  REQUIRE(writer.close());
  std::vector<std::string> files;
  for (const auto& each : std::filesystem::directory_iterator(folder.path("")))
    files.push_back(each.path().filename().string());
  REQUIRE(files.size() > 3);
  std::sort(files.begin(), files.end(), std::greater<>());

  auto recording = Recording::open(files, {}, folder.path("")).value();
  std::vector<std::string> expected;
  for (int i = 0; i < 1000; ++i)
    expected.push_back((i < 900 ? R"({"value":)" : R"({"count":)") + std::to_string(i) + "}");
  CHECK(documents(recording) == expected);
  CHECK(recording.message_count() == 1000);
  CHECK(recording.begin() == 0);
  CHECK(recording.end() == 999'000'000'000u);
  CHECK(recording.size() == writer.size());
  REQUIRE(recording.members().size() == 2);
  CHECK(recording.members().at(pose).message_count == 900);
  CHECK(recording.members().at(moved).message_count == 100);
  REQUIRE(recording.services().size() == 1);
  CHECK(recording.services()[0].objects.size() == 2);
  CHECK(recording.files().size() == files.size());
  CHECK(recording.files().front() == "a.mcap");
  CHECK(recording.name() == "a.mcap to a-" + std::to_string(files.size()) + ".mcap");
  std::vector<std::string> counts;
  REQUIRE(recording.for_each(recording.members().at(moved), [&](const McapMessage& message) -> rr::Result<> {
    counts.push_back(recording.read_document(message).value().dump());
    return {};
  }));
  CHECK(counts == std::vector<std::string>(expected.begin() + 900, expected.end()));
}

TEST_CASE("files of a recording go together by what they recorded, whatever numbers their channels have") {
  const test::Folder folder;
  const auto record = [&](const std::string& path, const std::vector<const char*>& members, int second) {
    Recorded robot;
    auto writer = robot.write(path);
    for (const auto* member : members) REQUIRE(writer.write(robot.add(writer, member), value(second), {}, {second, 0}));
    REQUIRE(writer.close());
    return path;
  };
  const auto late = record(folder.path("late.mcap"), {"picture", "matrix", "pose"}, 2);
  const auto early = record(folder.path("early.mcap"), {"pose", "picture"}, 1);
  auto recording = Recording::open(std::vector<std::string>{late, early}).value();
  std::vector<std::string> topics;
  for (const auto& chunk : recording.chunks()) {
    const auto read = recording.read(chunk).value();
    for (const auto& message : read.messages) topics.push_back(recording.members().at(message.channel).topic);
  }
  CHECK(topics ==
        std::vector<std::string>{"/Robot/pose", "/Robot/picture", "/Robot/picture", "/Robot/matrix", "/Robot/pose"});
  CHECK(recording.members().size() == 3);
  for (const auto& [channel, member] : recording.members()) {
    CHECK(member.channel == channel);
    CHECK(member.message_count == (member.member == "matrix" ? 1 : 2));
  }
}

TEST_CASE("files that are of no one recording are refused, and those that were cut are named") {
  const test::Folder folder;
  Recorded robot;
  const auto record = [&](const char* name, int from, int to) {
    auto writer = robot.write(folder.path(name));
    const auto pose = robot.add(writer, "pose");
    for (const int second : {from, to}) REQUIRE(writer.write(pose, value(second), {}, {second, 0}));
    REQUIRE(writer.close());
  };
  const auto open = [&](const std::vector<std::string>& files) { return Recording::open(files, {}, folder.path("")); };
  record("a.mcap", 1, 3);
  record("b.mcap", 2, 4);
  CHECK(open({"b.mcap", "a.mcap"}).error().message ==
        "b.mcap: begins before the end of a.mcap: they are of two recordings");
  robot.service.type = "com.x.Other";
  record("c.mcap", 5, 6);
  CHECK(open({"a.mcap", "c.mcap"}).error().message ==
        "c.mcap: service 'Robot' is a com.x.Other, and in the files before a com.x.Robot");
  CHECK(open({"a.mcap", "none.mcap"}).error().message.starts_with("none.mcap: can't be read"));
  robot.service.type = "com.x.Robot";
  record("d.mcap", 3, 6);  // at the moment when the one before ends
  CHECK(open({"d.mcap", "a.mcap"}).value().message_count() == 4);
  record("e.mcap", 3, 3);  // all at that moment
  for (const auto& files : {std::vector<std::string>{"a.mcap", "d.mcap", "e.mcap"}, {"d.mcap", "e.mcap", "a.mcap"}})
    CHECK(open(files).value().files() == std::vector<std::string>{"a.mcap", "e.mcap", "d.mcap"});
  std::filesystem::create_symlink(folder.path("e.mcap"), folder.path("link.mcap"));
  for (const auto* same : {"e.mcap", "./e.mcap", "link.mcap"})
    CHECK(open({"a.mcap", "e.mcap", same}).error().message == std::string(same) + ": is given twice");
  std::filesystem::resize_file(folder.path("a.mcap"), std::filesystem::file_size(folder.path("a.mcap")) / 2);
  CHECK(open({"d.mcap", "a.mcap"}).value().cut().starts_with("a.mcap ends at byte "));
}

TEST_CASE("a file that was cut before its first service is left out of its recording, and named") {
  const test::Folder folder;
  Recorded robot;
  auto writer = robot.write(folder.path("a.mcap"));
  REQUIRE(writer.write(robot.add(writer, "pose"), value(1), {}, {1, 0}));
  REQUIRE(writer.close());
  const auto whole = folder.read("a.mcap");
  const auto within_service = whole.find("robotraconteur.service");
  REQUIRE(within_service != std::string::npos);
  const auto open = [&](const std::vector<std::string>& files) { return Recording::open(files, {}, folder.path("")); };
  for (std::size_t size = 0; size <= within_service; ++size) {
    folder.write("b.mcap", whole.substr(0, size));
    const auto recording = open({"b.mcap", "a.mcap"});
    REQUIRE(recording.has_value());
    REQUIRE(recording->cut().starts_with("b.mcap ends at byte " + std::to_string(size)));
    REQUIRE(recording->files() == std::vector<std::string>{"a.mcap"});
    REQUIRE(recording->message_count() == 1);
    const auto alone = open({"b.mcap"});
    REQUIRE_FALSE(alone.has_value());
    REQUIRE(alone.error().message.starts_with("b.mcap: holds no service: ends at byte " + std::to_string(size)));
  }
  folder.write("b.mcap", "no recording");
  CHECK(open({"a.mcap", "b.mcap"}).error().message.starts_with("b.mcap: is no MCAP file"));
}

TEST_CASE("no further file of a recording is read once those before take too much memory") {
  const test::Folder folder;
  Recorded robot;
  const auto record = [&](const char* name, int second) {
    auto writer = robot.write(folder.path(name));
    REQUIRE(writer.write(robot.add(writer, "pose"), value(second), {}, {second, 0}));
    REQUIRE(writer.close());
    return std::string(name);
  };
  const std::vector<std::string> files{record("a.mcap", 1), record("b.mcap", 2)};
  const auto open = [&](const std::vector<std::string>& some, std::size_t memory) {
    return Recording::open(some, {}, folder.path(""), memory);
  };
  const auto both = Recording::open(files, {}, folder.path("")).value().memory();
  CHECK(open(files, both).has_value());
  const auto refused = open({files[0], files[1], "none.mcap"}, both - 1);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == rr::ErrorCode::out_of_system_resource);
  CHECK(refused.error().message.starts_with("b.mcap: with it, the recording takes " + std::to_string(both)));
}

TEST_CASE("what is written to a file after its recording was opened is no part of it") {
  const test::Folder folder;
  Recorded robot;
  const auto record = [&](const char* name, int from) {
    auto writer = robot.write(folder.path(name));
    const auto pose = robot.add(writer, "pose");
    for (int i = from; i < from + 10; ++i) REQUIRE(writer.write(pose, value(i), {}, {i, 0}));
    REQUIRE(writer.close());
  };
  record("a.mcap", 0);
  record("b.mcap", 10);
  const auto whole = folder.read("b.mcap");
  const auto last = Recording::open(folder.path("b.mcap")).value().chunks().back();
  folder.write("b.mcap", whole.substr(0, last.offset + last.bytes - 20));  // within its last message
  auto recording = Recording::open(std::vector<std::string>{"a.mcap", "b.mcap"}, {}, folder.path("")).value();
  const auto count = recording.message_count();
  REQUIRE(count < 20);
  folder.write("b.mcap", whole);
  CHECK(documents(recording).size() == count);
}

TEST_CASE("schemas have no references and no choices, as tools read them that plot") {
  const Recorded robot;
  const auto pose = schema_of(robot, "pose");
  const auto text = pose.dump();
  CHECK(text.find("$ref") == std::string::npos);
  CHECK(text.find("oneOf") == std::string::npos);
  const auto& fields = pose["properties"]["value"]["properties"];
  CHECK(fields["position"]["items"]["type"] == "number");
  CHECK(fields["mode"]["type"] == "string");
  CHECK(fields["history"]["type"] == "array");
  CHECK(schema_of(robot, "moved")["properties"]["count"]["type"] == "integer");
  const auto picture = schema_of(robot, "picture")["properties"]["value"];
  CHECK(picture["contentEncoding"] == "base64");
  const auto matrix = schema_of(robot, "matrix")["properties"]["value"];
  CHECK(matrix["properties"]["dims"]["type"] == "array");
}

TEST_CASE("a definition whose schemas would have no end gives one that says little") {
  std::string text = "service com.x\nstdver 0.10\n";
  for (int i = 0; i < 10; ++i) {
    text += "struct S" + std::to_string(i) + "\n";
    for (const auto* field : {"a", "b", "c", "d", "e", "f", "g", "h"})
      text += "    field " + (i == 9 ? std::string("double") : "S" + std::to_string(i + 1)) + " " + field + "\n";
    text += "end\n";
  }
  text += "object Robot\n    wire S0 large\n    wire S8 small\n    event moved(S8 by, S0 to)\n";
  for (int i = 0; i < 1000; ++i) text += "    property S8 p" + std::to_string(i) + "\n";
  const Recorded robot(text + "end\n");
  CHECK(schema_of(robot, "large") == rr::OrderedJson{{"type", "object"}});
  CHECK(schema_of(robot, "moved") == rr::OrderedJson{{"type", "object"}});
  const auto small = schema_of(robot, "small");
  CHECK(small["properties"]["value"]["properties"]["h"]["properties"]["a"]["type"] == "number");
  auto nodes = max_schema_nodes;
  std::size_t bytes = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto name = "p" + std::to_string(i);
    bytes += recorded_schema(*robot.robot->find_member(name), robot.named, nodes).dump().size();
  }
  CHECK(nodes < 10);
  CHECK(bytes < 64 * max_schema_nodes);
  CHECK(bytes > 2 * max_schema_nodes);
}

TEST_CASE("documentation without end is no part of a schema") {
  const std::string doc(200'000, 'x');
  const Recorded robot("service com.x\nstdver 0.10\nstruct S\n    ## " + doc +
                       "\n    field double a\nend\nobject Robot\n    wire S pose\n    ## " + doc +
                       "\n    wire double gain\nend\n");
  CHECK(schema_of(robot, "pose") == rr::OrderedJson{{"type", "object"}});
  CHECK(schema_of(robot, "gain") == rr::OrderedJson{{"type", "object"}});
}

TEST_CASE("a clock that is set back stops no time") {
  const test::Folder folder;
  Recorded robot;
  auto writer = robot.write(folder.path("a.mcap"));
  const auto pose = robot.add(writer, "pose");
  for (const int seconds : {100, 101, 50, 51, 52, 40, 41, 108, 109})
    REQUIRE(writer.write(pose, value(seconds), {}, {seconds, 0}));
  REQUIRE(writer.close());
  auto recording = Recording::open(writer.path()).value();
  std::vector<McapTime> seconds;
  for (const auto& chunk : recording.chunks())
    for (const auto& message : recording.read(chunk).value().messages)
      seconds.push_back(message.log_time / 1'000'000'000u);
  CHECK(seconds == std::vector<McapTime>{100, 101, 101, 102, 103, 103, 104, 108, 109});
}

TEST_CASE("a file whose index takes too much memory is followed by the next") {
  const test::Folder folder;
  Recorded robot;
  RecordingOptions options;
  options.max_index_bytes = 1000;
  auto writer = robot.write(folder.path("a.mcap"), options);
  const auto pose = robot.add(writer, "pose");
  for (int i = 0; i < 100; ++i) {
    REQUIRE(writer.write(pose, value(i), {}, {i, 0}));
    REQUIRE(writer.flush());
  }
  REQUIRE(writer.close());
  CHECK(writer.path() != folder.path("a.mcap"));
  std::size_t messages = 0;
  std::size_t files = 0;
  for (const auto& each : std::filesystem::directory_iterator(std::filesystem::path(writer.path()).parent_path())) {
    messages += Recording::open(each.path().string()).value().message_count();
    ++files;
  }
  CHECK(messages == 100);
  CHECK(files > 5);
  CHECK(files < 20);
}

TEST_CASE("a file holds more than the definitions and schemas, however low the limit is") {
  const test::Folder folder;
  Recorded robot;
  RecordingOptions options;
  options.max_bytes = 100;
  auto writer = robot.write(folder.path("a.mcap"), options);
  const auto pose = robot.add(writer, "pose");
  const auto before = writer.size();
  const auto least = writer.least_file_bytes();
  CHECK(least == before + before / 4);
  for (int i = 0; i < 1000; ++i) REQUIRE(writer.write(pose, value(i), {}, {i, 0}));
  REQUIRE(writer.close());
  std::size_t files = 0;
  for (const auto& each : std::filesystem::directory_iterator(std::filesystem::path(writer.path()).parent_path())) {
    const auto recording = Recording::open(each.path().string()).value();
    if (each.path() == writer.path()) continue;
    CHECK(recording.message_count() > 5);
    CHECK(recording.size() > least);
    CHECK(recording.size() < 3 * least);
    ++files;
  }
  CHECK(files > 5);
}

TEST_CASE("files of former runs count among those that are kept, and go when the next has a message") {
  const test::Folder folder;
  RecordingOptions options;
  options.max_bytes = 20'000;
  options.kept_files = 3;
  options.ring = "mine";
  options.former = {folder.path("1.mcap"), folder.path("2.mcap"), folder.path("3.mcap"), folder.path("4.mcap")};
  for (const auto& path : options.former) std::ofstream(path) << "of before";
  options.replaces = true;  // a folder stands in the way
  std::filesystem::create_directory(folder.path("a-2.mcap"));
  auto writer = RecordingWriter::create(folder.path("a.mcap"), options).value();
  CHECK(std::filesystem::exists(folder.path("1.mcap")));
  CHECK(recorded_ring(folder.path("a.mcap")) == "mine");
  Recorded robot;
  robot.add_to(writer);
  const auto pose = robot.add(writer, "pose");
  CHECK(writer.kept().size() == 4);
  CHECK(std::filesystem::exists(folder.path("1.mcap")));
  REQUIRE(writer.write(pose, value(0), {}, {0, 0}));
  CHECK(writer.kept() == std::deque<std::string>{folder.path("3.mcap"), folder.path("4.mcap")});
  CHECK(!std::filesystem::exists(folder.path("2.mcap")));
  rr::Result<> written;
  std::uint64_t size = 0;
  for (int i = 0; written; ++i) {
    size = writer.size();
    written = writer.write(pose, value(i), {}, {i, 0});
  }
  CHECK_THAT(written.error().message, Catch::Contains("a-2.mcap: can't be written: Is a directory"));
  CHECK(std::filesystem::exists(folder.path("3.mcap")));
  CHECK(std::filesystem::exists(folder.path("4.mcap")));
  CHECK(std::filesystem::is_directory(folder.path("a-2.mcap")));
  CHECK(writer.size() < size * 3 / 2);  // not twice
  CHECK(recorded_ring(folder.path("4.mcap")).empty());
  CHECK(writer.drop_oldest());
  CHECK(!std::filesystem::exists(folder.path("3.mcap")));
}

TEST_CASE("a recording that is not wanted any more is read no further") {
  const test::Folder folder;
  Recorded robot;
  auto writer = robot.write(folder.path("a.mcap"));
  REQUIRE(writer.close());
  std::stop_source unwanted;
  CHECK(Recording::open(writer.path(), unwanted.get_token()).has_value());
  unwanted.request_stop();
  const auto given_up = Recording::open(writer.path(), unwanted.get_token());
  REQUIRE_FALSE(given_up.has_value());
  CHECK(given_up.error().code == rr::ErrorCode::operation_cancelled);
}

TEST_CASE("what is no recording says so") {
  const test::Folder folder;
  auto writer = McapWriter::create(folder.path("other.mcap"), "another").value();
  REQUIRE(writer.close());
  CHECK_THAT(Recording::open(writer.path()).error().message,
             Catch::Contains("other.mcap: holds no service: has no metadata"));
  auto foreign = McapWriter::create(folder.path("foreign.mcap"), "another").value();
  REQUIRE(foreign.add_channel("/camera", "ros1", 0, {}));
  REQUIRE(foreign.close());
  CHECK_THAT(Recording::open(foreign.path()).error().message,
             Catch::Contains("channel at byte") && Catch::Contains("/camera") && Catch::Contains("has no metadata"));
}

TEST_CASE("a message that is not what it should be names its place") {
  const test::Folder folder;
  Recorded robot;
  auto writer = robot.write(folder.path("a.mcap"));
  const auto pose = robot.add(writer, "pose");
  REQUIRE(writer.write(pose, {{"other", 1}}, {}, {1, 0}));
  REQUIRE(writer.close());
  auto recording = Recording::open(writer.path()).value();
  const auto read = recording.read(recording.chunks().at(0)).value();
  CHECK_THAT(recording.read_document(read.messages[0]).error().message,
             Catch::Contains("a.mcap: /Robot/pose, message 0: has no \"value\""));
}
