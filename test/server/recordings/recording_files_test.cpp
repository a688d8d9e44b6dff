// Which files of a folder are of which recording, and of which ring.
#include "server/recordings/recording_files.hpp"

#include <catch2/catch.hpp>

#include "test/server/support/ring_file.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;

namespace {

RecordingWish ring(std::vector<std::string> members = {"*"}, std::size_t kept = 3) {
  RecordingWish out;
  out.device = "arm";
  out.service = "Arm";
  out.members = std::move(members);
  out.max_file_bytes = 1'000'000;
  out.kept_files = kept;
  return out;
}

/// A file that says it is of a ring, or of none.
std::string write_file(const test::Folder& folder, const std::string& name, const std::string& of,
                       test::RingFile kind = test::RingFile::with_message) {
  return test::write_ring_file(folder.path(name), of, kind);
}

}  // namespace

TEST_CASE("recordings: a name says what was recorded since when") {
  const auto name = parse_recording_name("arm.2.Arm.20261125T083000123Z");
  REQUIRE(name);
  CHECK(name->device == "arm.2");
  CHECK(name->service == "Arm");
  CHECK(format_recording_name(*name) == "arm.2.Arm.20261125T083000123Z");
  for (const auto* other : {"", "arm", "arm.Arm", "arm.Arm.20261125T083000123", "arm.20261125T083000123Z",
                            ".Arm.20261125T083000123Z", "arm..20261125T083000123Z", "arm.Arm.20261325T083000123Z"})
    CHECK_FALSE(parse_recording_name(other));
  CHECK(recording_of_file("arm.Arm.20261125T083000123Z.mcap") == "arm.Arm.20261125T083000123Z");
  CHECK(recording_of_file("arm.Arm.20261125T083000123Z-12.mcap") == "arm.Arm.20261125T083000123Z");
  CHECK(recording_of_file("arm.Arm.20261125T083000123Z-x.mcap").empty());
  CHECK(recording_of_file("arm.Arm.20261125T083000123Z").empty());
}

TEST_CASE("recordings: files of a folder come oldest first, of one recording or of all") {
  const test::Folder folder;
  const std::string first = "arm.Arm.20261125T083000123Z";
  for (const auto* end : {".mcap", "-2.mcap", "-10.mcap", ".txt"}) folder.write(first + end, "12345");
  folder.write("arm.Arm.20261126T083000123Z.mcap", "1");
  folder.write("other.mcap", "1");
  const auto all = look_into(folder.path("."), {});
  REQUIRE(all.size() == 2);
  const auto one = look_into(folder.path("."), first);
  REQUIRE(one.size() == 1);
  const auto& files = one.at(first);
  REQUIRE(files.size() == 3);
  CHECK(files[0].name == first + ".mcap");
  CHECK(files[1].name == first + "-2.mcap");
  CHECK(files[2].name == first + "-10.mcap");
  CHECK(files[0].bytes == 5);
  CHECK(look_into("", {}).empty());
  CHECK(look_into(folder.path("none"), {}).empty());
}

TEST_CASE("recordings: a ring has the files of former runs, and nobody else's") {
  const test::Folder folder;
  const auto wish = ring();
  const auto other = ring({"state"});
  const auto own = ring_of(wish);
  std::deque<std::string> expected;
  expected.push_back(write_file(folder, "arm.Arm.20261125T083000123Z.mcap", own));
  expected.push_back(write_file(folder, "arm.Arm.20261125T083000123Z-2.mcap", own));
  expected.push_back(write_file(folder, "arm.Arm.20261126T083000123Z.mcap", own));
  expected.push_back(write_file(folder, "arm.Arm.20261127T083000123Z.mcap", ring_of(ring({"gone"}))));
  write_file(folder, "arm.Arm.20261126T093000123Z.mcap", "");              // of a client
  write_file(folder, "arm.Arm.20261126T103000123Z.mcap", ring_of(other));  // of another ring
  write_file(folder, "arm.Other.20261126T083000123Z.mcap", own);
  write_file(folder, "leg.Arm.20261126T083000123Z.mcap", own);
  write_file(folder, "arm.Arm.20261128T083000123Z.mcap", own);  // under way
  folder.write("arm.Arm.20261126T113000123Z.mcap", "what is no recording");
  const auto found = find_ring(folder.path(""), wish, {wish, other}, {"arm.Arm.20261128T083000123Z"});
  CHECK(found == expected);
  CHECK(find_ring(folder.path(""), ring({"*"}, 0), {}, {}).empty());
}

TEST_CASE("recordings: files of a ring without a message are deleted, not counted") {
  using enum test::RingFile;
  const test::Folder folder;
  const auto wish = ring();
  const auto empty = write_file(folder, "arm.Arm.20261125T083000123Z.mcap", ring_of(wish), without_message);
  const auto killed = write_file(folder, "arm.Arm.20261126T083000123Z.mcap", ring_of(wish), without_end);
  const auto full = write_file(folder, "arm.Arm.20261127T083000123Z.mcap", ring_of(wish));
  const auto of_client = write_file(folder, "arm.Arm.20261127T093000123Z.mcap", "", without_message);
  const auto of_other = write_file(folder, "leg.Arm.20261127T093000123Z.mcap", ring_of(wish), without_message);
  const auto under_way = write_file(folder, "arm.Arm.20261128T083000123Z.mcap", ring_of(wish), without_end);
  CHECK(find_ring(folder.path(""), wish, {wish}, {"arm.Arm.20261128T083000123Z"}) == std::deque<std::string>{full});
  for (const auto& gone : {empty, killed}) CHECK_FALSE(std::filesystem::exists(gone));
  for (const auto& there : {full, of_client, of_other, under_way}) CHECK(std::filesystem::exists(there));
}
