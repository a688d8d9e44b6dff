#include <catch2/catch.hpp>
#include <random>

#include "server/record/mcap_reader.hpp"
#include "server/record/mcap_writer.hpp"
#include "test/support/folder.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

constexpr McapTime second = 1'000'000'000;

/// Two channels with messages in turn, a second apart.
std::string write_sample(const test::Folder& folder, int messages, bool is_closed = true) {
  auto writer = McapWriter::create(folder.path("sample.mcap"), "test").value();
  const auto schema = writer.add_schema("com.x.Pose", "jsonschema", R"({"type":"object"})").value();
  REQUIRE(schema == 1);
  REQUIRE(writer.add_metadata("about", {{"a", "1"}, {"b", ""}}));
  REQUIRE(writer.add_channel("/a", "json", schema, {{"kind", "wire"}}).value() == 0);
  REQUIRE(writer.add_channel("/b", "json", schema, {}).value() == 1);
  for (int i = 0; i < messages; ++i) {
    const auto text = R"({"value":)" + std::to_string(i) + "}";
    const auto channel = static_cast<std::uint16_t>(i % 2);
    REQUIRE(writer.write({channel, static_cast<std::uint32_t>(i / 2), second * (i + 1), second, rr::as_bytes(text)}));
    if (i % 10 == 9) REQUIRE(writer.flush());
  }
  REQUIRE((is_closed ? writer.close() : writer.flush()));
  return writer.path();
}

struct Read {
  std::vector<std::string> texts = {};
  std::vector<McapTime> times = {};
  std::string error = {};
  std::string cut = {};
};

Read read(const std::string& path) {
  Read out;
  auto reader = McapReader::open(path);
  if (!reader) return {{}, {}, reader.error().message};
  for (;;) {
    auto record = reader->next();
    if (!record) {
      out.error = record.error().message;
      break;
    }
    if (!*record) break;
    if ((*record)->opcode == McapOpcode::channel)
      if (const auto channel = parse_mcap_channel((*record)->content); !channel) out.error = channel.error().message;
    if ((*record)->opcode == McapOpcode::metadata)
      if (const auto metadata = parse_mcap_metadata((*record)->content); !metadata)
        out.error = metadata.error().message;
    if ((*record)->opcode != McapOpcode::chunk) continue;
    auto chunk = McapChunkReader::open(**record);
    if (!chunk) {
      out.error = reader->error_in(**record, chunk.error().message).message;
      break;
    }
    for (auto inner = chunk->next(); inner && *inner; inner = chunk->next()) {
      const auto message = parse_mcap_message((*inner)->content);
      if (!message) {
        out.error = message.error().message;
        break;
      }
      out.texts.emplace_back(rr::as_text(message->data));
      out.times.push_back(message->log_time);
    }
  }
  out.cut = reader->cut();
  return out;
}

}  // namespace

TEST_CASE("what is written to an MCAP file is read again, in its order") {
  const test::Folder folder;
  const auto found = read(write_sample(folder, 25));
  CHECK(found.error.empty());
  CHECK(found.cut.empty());
  REQUIRE(found.texts.size() == 25);
  CHECK(found.texts.front() == R"({"value":0})");
  CHECK(found.texts.back() == R"({"value":24})");
  CHECK(found.times.back() == 25 * second);
}

TEST_CASE("a file that was cut is readable up to where it ends") {
  const test::Folder folder;
  const auto whole = read(write_sample(folder, 25));
  const auto bytes = folder.read("sample.mcap");
  std::size_t most = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto found = read(folder.write("cut.mcap", bytes.substr(0, size)));
    CHECK(found.error.empty());
    REQUIRE(found.texts.size() >= most);
    most = found.texts.size();
    REQUIRE(std::equal(found.texts.begin(), found.texts.end(), whole.texts.begin()));
    if (found.texts.size() < whole.texts.size()) REQUIRE_THAT(found.cut, Catch::Contains("ends at byte"));
  }
  CHECK(most == whole.texts.size());
}

TEST_CASE("a process that ends without closing its file loses what was not flushed, and nothing else") {
  const test::Folder folder;
  const auto found = read(write_sample(folder, 25, false));
  CHECK(found.texts.size() == 25);
  CHECK_THAT(found.cut, Catch::Contains("without the end of its data"));
}

TEST_CASE("files that are none say what was found and what was expected") {
  const test::Folder folder;
  CHECK_THAT(read(folder.path("none.mcap")).error, Catch::Contains("none.mcap: can't be read: No such file"));
  CHECK_THAT(read(folder.write("short", "\x89MCB")).error, Catch::Contains("is no MCAP file: begins with"));
  CHECK_THAT(read(folder.write("text", "hello, this is text")).error,
             Catch::Contains("begins with 68 65 6c 6c 6f 2c 20 74, expected 89 4d 43 41 50 30 0d 0a"));
  auto bytes = folder.read(std::filesystem::path(write_sample(folder, 4)).filename().string());
  const auto changed = bytes.find(R"({"value":2})");
  bytes[changed + 3] = 'V';
  CHECK_THAT(read(folder.write("changed.mcap", bytes)).error,
             Catch::Matches(".*changed.mcap: chunk at byte [0-9]+: was changed: its CRC is [0-9]+, expected [0-9]+"));
}

TEST_CASE("hostile files end in an error or in fewer messages, and take no memory that they do not have") {
  const test::Folder folder;
  const auto path = write_sample(folder, 25);
  const auto bytes = folder.read("sample.mcap");
  std::mt19937 random(7);
  std::size_t refused = 0;
  for (int i = 0; i < 3000; ++i) {
    auto changed = bytes;
    const auto changes = 1 + random() % 4;
    for (unsigned each = 0; each < changes; ++each)
      changed[mcap_magic.size() + random() % (changed.size() - mcap_magic.size())] = static_cast<char>(random());
    const auto found = read(folder.write("hostile.mcap", changed));
    refused += found.error.empty() ? 0 : 1;
    REQUIRE(found.texts.size() <= 2 * 25);
  }
  CHECK(refused > 100);
}

TEST_CASE("a message that is too large is refused, and the others are written") {
  const test::Folder folder;
  auto writer = McapWriter::create(folder.path("large.mcap"), "test").value();
  REQUIRE(writer.add_channel("/a", "json", 0, {}));
  const rr::Bytes large(max_mcap_message_bytes + 1, ' ');
  const auto written = writer.write({0, 0, 1, 1, large});
  REQUIRE(!written);
  CHECK_THAT(written.error().message, Catch::Contains("a message of 134217729 bytes; at most 134217728"));
  REQUIRE(writer.write({0, 1, 2, 2, rr::as_bytes("{}")}));
  REQUIRE(writer.close());
  CHECK(read(writer.path()).texts == std::vector<std::string>{"{}"});
}

TEST_CASE("a file that can't be written says why") {
  const auto none = McapWriter::create("/no/such/folder/a.mcap", "test");
  REQUIRE(!none);
  CHECK(none.error().message == "/no/such/folder/a.mcap: can't be written: No such file or directory");
  auto full = McapWriter::create("/dev/full", "test");
  REQUIRE(!full);
  CHECK_THAT(full.error().message, Catch::Contains("/dev/full: writing at byte 0 failed: No space left on device"));
}
