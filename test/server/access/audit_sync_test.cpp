// What "fsync" of the audit log asks of the system. This file takes the place of fdatasync() for the whole program.
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <sstream>

#include "server/access/audit_log.hpp"
#include "test/support/folder.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

std::atomic<int> sync_count = 0;
std::atomic<bool> disk_fails = false;

std::size_t records_about(const std::string& text, const std::string& detail) {
  std::istringstream lines(text);
  std::size_t out = 0;
  for (std::string line; std::getline(lines, line);)
    if (nlohmann::json::parse(line).value("detail", "") == detail) ++out;
  return out;
}

}  // namespace

extern "C" int fdatasync(int) {
  ++sync_count;
  if (!disk_fails) return 0;
  errno = EIO;
  return -1;
}

TEST_CASE("with fsync each batch is on the disk before it counts as written, and what can't get there is not") {
  const bool is_wanted = GENERATE(true, false);
  test::Folder folder;
  const auto file = folder.path("audit");
  AuditLog log;
  REQUIRE(log.open({.file = file, .syncs = is_wanted}));
  sync_count = 0;
  log.add({.event = "write", .detail = "one"});
  REQUIRE(log.flush(std::chrono::seconds(10)));
  CHECK((sync_count > 0) == is_wanted);
  CHECK(records_about(folder.read("audit"), "one") == 1);

  disk_fails = true;
  log.add({.event = "write", .detail = "two"});
  CHECK(log.flush(std::chrono::milliseconds(200)) != is_wanted);
  CHECK(records_about(folder.read("audit"), "two") == (is_wanted ? 0 : 1));
  disk_fails = false;
  REQUIRE(log.flush(std::chrono::seconds(10)));
  CHECK(records_about(folder.read("audit"), "two") == 1);
}
