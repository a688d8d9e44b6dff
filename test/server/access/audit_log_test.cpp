#include "server/access/audit_log.hpp"

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "server/access/audit_file.hpp"
#include "server/access/audit_tail.hpp"
#include "server/access/audit_trail.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

namespace fs = std::filesystem;

Identity alice() {
  Identity out;
  out.name = "alice";
  out.roles = {"operator"};
  out.proof = Proof::token;
  out.client = "192.0.2.1:5";
  out.face = Face::rest;
  return out;
}

struct Folder {
  Folder() {
    std::string made = (fs::temp_directory_path() / "rrgate-audit-XXXXXX").string();
    REQUIRE(::mkdtemp(made.data()));
    path = made;
  }
  ~Folder() { fs::remove_all(path); }
  std::string file(const std::string& name = "audit") const { return (path / name).string(); }
  fs::path path;
};

std::string read(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<std::string> lines_of(const std::string& path) {
  std::istringstream text(read(path));
  std::vector<std::string> out;
  for (std::string line; std::getline(text, line);) out.push_back(line);
  return out;
}

void write_lines(const std::string& path, const std::vector<std::string>& lines) {
  std::ofstream out(path);
  for (const auto& line : lines) out << line << '\n';
}

std::vector<std::string> events_of(const std::string& path) {
  std::vector<std::string> out;
  for (const auto& line : lines_of(path)) out.push_back(nlohmann::json::parse(line)["event"]);
  return out;
}

/// A start, `count` records and a stop.
void write_log(const AuditConfig& config, int count) {
  AuditLog log;
  REQUIRE(log.open(config));
  const auto who = alice();
  for (int i = 0; i < count; ++i) log.add({.event = "write", .who = &who, .detail = std::to_string(i)});
  REQUIRE(log.flush(std::chrono::seconds(10)));
}

std::vector<AuditFinding> findings_of(const std::vector<std::string>& files) {
  return verify_audit_files(files).value().findings;
}

}  // namespace

TEST_CASE("one gateway writes an audit file, also behind a rotation and when it was read anew; the next one goes on") {
  const Folder folder;
  const AuditConfig config{.file = folder.file(), .max_bytes = 600};
  {
    AuditLog log;
    REQUIRE(log.open(config));
    const auto is_refused = [&] {
      AuditLog other;
      const auto opened = other.open(config);
      return !opened && opened.error().message.ends_with("another gateway writes it; expected one for each file");
    };
    CHECK(is_refused());
    const auto who = alice();
    for (int i = 0; i < 5; ++i) log.add({.event = "write", .who = &who});
    REQUIRE(log.flush(std::chrono::seconds(10)));
    REQUIRE(fs::exists(folder.file("audit.1")));
    CHECK(is_refused());
    REQUIRE(log.open(config));
    REQUIRE(log.reopen());
    CHECK(is_refused());
    AuditLog beside;
    CHECK(beside.open({.file = folder.file("beside")}));
  }
  AuditLog next;
  CHECK(next.open(config));
}

TEST_CASE("a record of the audit log says who did what, when") {
  const auto who = alice();
  const AccessRequest what{"create", "Create", "Create.axes[0]", "speed", Verb::write};
  const auto now = std::chrono::system_clock::time_point(std::chrono::milliseconds(1'900'000'000'007));
  CHECK(format_audit_event({.event = "write", .who = &who, .what = &what, .trace = "0af7"}, now) ==
        R"("time":"2030-03-17T17:46:40.007Z","event":"write","outcome":"ok","face":"rest","user":"alice",)"
        R"("roles":["operator"],"proof":"token","client":"192.0.2.1:5","verb":"write","device":"create",)"
        R"("service":"Create","path":"Create.axes[0]","member":"speed","trace":"0af7")");
  // Nothing that strangers choose begins another line, or fills the disk with one.
  Identity evil;
  evil.name = "a\n{\"event\":\"login\"}\xff" + std::string(5000, 'x');
  const auto text =
      format_audit_event({.event = "login_failed", .who = &evil, .detail = "why", .outcome = Outcome::refused}, now);
  CHECK(text.find('\n') == std::string::npos);
  CHECK(text.size() < 1000);
  CHECK(nlohmann::json::parse("{" + text + "}")["detail"] == "why");
  const auto cut = format_audit_event({.event = "login_failed", .detail = std::string(499, 'x') + "\xc3\xa4"}, now);
  CHECK(nlohmann::json::parse("{" + cut + "}")["detail"] == std::string(499, 'x'));
}

TEST_CASE("the hash of a record is that of its text behind the hash before") {
  AuditChain chain;
  const auto first = chain.add("\"event\":\"a\"", true);
  CHECK(first == R"({"seq":1,"prev":"0000000000000000000000000000000000000000000000000000000000000000","event":"a",)"
                 R"("hash":")" +
                     chain.hash + "\"}\n");
  // printf '%064d{"seq":1,"prev":"%064d","event":"a"}' 0 0 | sha256sum
  CHECK(chain.hash == "ed624815d436a54a52df0da6d3bd927931130e230d199f7f615296f4779bf909");
  const auto before = chain.hash;
  const auto line = chain.add("\"event\":\"b\"", false);
  const auto parsed = parse_audit_line(std::string_view(line).substr(0, line.size() - 1));
  REQUIRE(parsed);
  CHECK(parsed->seq == 2);
  CHECK_FALSE(parsed->previous);
  CHECK(hash_audit_line(before, *parsed) == chain.hash);
  for (std::size_t size = 0; size + 1 < line.size(); ++size) CHECK_FALSE(parse_audit_line(line.substr(0, size)));
  for (const auto* other : {R"({"seq":0,"event":"b","hash":")", R"({"seq":x,"event":"b","hash":")"})
    CHECK_FALSE(parse_audit_line(other + chain.hash + "\"}"));
}

TEST_CASE("the chain goes on behind a restart, a rotation and a file that was moved") {
  const Folder folder;
  const AuditConfig config{.file = folder.file(), .max_bytes = 2000, .keep = 8};  // all of it
  write_log(config, 3);
  CHECK((fs::status(folder.file()).permissions() & fs::perms(0777)) == fs::perms(0600));
  CHECK(events_of(folder.file()) == std::vector<std::string>{"started", "write", "write", "write", "stopped"});
  write_log(config, 20);
  CHECK(fs::exists(folder.file("audit.1")));
  {
    AuditLog log;
    REQUIRE(log.open(config));
    fs::rename(folder.file(), folder.file("moved"));
    REQUIRE(log.reopen());
    log.add({.event = "write"});
    REQUIRE(log.flush(std::chrono::seconds(10)));
    CHECK_FALSE(log.open({.file = folder.file("no/such")}));
    log.add({.event = "write"});
    REQUIRE(log.flush(std::chrono::seconds(10)));
    CHECK(log.state().lost == 0);
  }
  std::vector<std::string> files;
  for (const auto& each : fs::directory_iterator(folder.path)) files.push_back(each.path().string());
  const auto trail = verify_audit_files(files).value();
  for (const auto& each : trail.findings) UNSCOPED_INFO(each.file << ":" << each.line << " " << each.found);
  CHECK(trail.findings.empty());
  CHECK(trail.first == 1);
  CHECK(trail.last.seq == trail.records);
  CHECK(trail.records == 5 + 22 + 4);
}

TEST_CASE("of the renamed files as many are kept as are wanted") {
  const Folder folder;
  write_log({.file = folder.file(), .max_bytes = 1000, .keep = 2}, 5);
  for (int i = 0; i < 5; ++i) write_log({.file = folder.file(), .max_bytes = 1000, .keep = 2}, 5);
  CHECK(fs::exists(folder.file("audit.2")));
  CHECK_FALSE(fs::exists(folder.file("audit.3")));
  const auto trail = verify_audit_files({folder.file(), folder.file("audit.1"), folder.file("audit.2")}).value();
  CHECK(trail.findings.empty());
  CHECK(trail.first > 1);
  // A file that is missing in between is seen.
  const auto found = findings_of({folder.file(), folder.file("audit.2")});
  REQUIRE(found.size() == 1);
  CHECK(found[0].file == folder.file());
  CHECK(found[0].line == 1);
}

TEST_CASE("a rotation that finds no file descriptor, and is tried again, loses none of the renamed files") {
  const Folder folder;
  auto file = AuditFile::open({.file = folder.file(), .max_bytes = 300, .keep = 3}).value();
  const std::vector<std::string> record{R"("event":"write","detail":")" + std::string(150, 'x') + '"'};
  const auto renamed = [&](int number) { return read(folder.file("audit." + std::to_string(number))); };
  for (int i = 0; i < 4; ++i) REQUIRE(file.write(record));
  const auto newest = read(folder.file());
  const auto first = renamed(1);
  const auto second = renamed(2);
  REQUIRE_FALSE(renamed(3).empty());
  rlimit descriptors{};
  ::getrlimit(RLIMIT_NOFILE, &descriptors);
  const rlimit none{0, descriptors.rlim_max};
  ::setrlimit(RLIMIT_NOFILE, &none);
  int failed = 0;
  for (int i = 0; i < 5; ++i) failed += file.write(record) ? 0 : 1;
  ::setrlimit(RLIMIT_NOFILE, &descriptors);
  CHECK(failed == 5);
  REQUIRE(file.write(record));
  CHECK(renamed(1) == newest);
  CHECK(renamed(2) == first);
  CHECK(renamed(3) == second);
  CHECK(lines_of(folder.file()).size() == 1);
  CHECK(findings_of({folder.file(), folder.file("audit.1"), folder.file("audit.2"), folder.file("audit.3")}).empty());
}

TEST_CASE("records that were edited, cut out, put elsewhere or cut off are found") {
  const Folder folder;
  write_log({.file = folder.file()}, 6);
  auto lines = lines_of(folder.file());
  REQUIRE(lines.size() == 8);
  const auto check = [&](std::uint64_t line, std::string_view found, std::string_view expected) {
    write_lines(folder.file(), lines);
    const auto findings = findings_of({folder.file()});
    REQUIRE_FALSE(findings.empty());
    CHECK(findings[0].line == line);
    CHECK(findings[0].found.find(found) != std::string::npos);
    CHECK(findings[0].expected.find(expected) != std::string::npos);
    return findings.size();
  };
  CHECK(findings_of({folder.file()}).empty());
  const auto check_without_head = [&] {
    fs::remove(folder.file("audit.head"));
    CHECK(check(0, "audit.head: the end may have been cut off", "which names the last record") == 1);
    write_log({.file = folder.file()}, 1);
    CHECK(read(folder.file()).find("audit.head is missing: the end of the file may have been cut off") !=
          std::string::npos);
  };
  SECTION("edited") {
    lines[3].replace(lines[3].find("alice"), 5, "bob");
    CHECK(check(4, "record 4 with hash", "by its text and the record before") == 1);
  }
  SECTION("edited, with a hash that fits") {
    const auto before = parse_audit_line(lines[2])->hash;
    lines[3].replace(lines[3].find("alice"), 5, "bobby");
    const auto hash = hash_audit_line(before, *parse_audit_line(lines[3]));
    lines[3].replace(lines[3].size() - 66, 64, hash);
    CHECK(check(5, "record 5 with hash", "hash") == 1);
  }
  SECTION("cut out") {
    lines.erase(lines.begin() + 3);
    CHECK(check(4, "record 5", "record 4") == 1);
  }
  SECTION("put elsewhere") {
    std::swap(lines[3], lines[4]);
    check(4, "record 5", "record 4");
  }
  SECTION("put in") {
    lines.insert(lines.begin() + 3, "{\"seq\":4}");
    CHECK(check(4, "no record: '{\"seq\":4}'", "record 4") == 1);
  }
  SECTION("cut off in front") {
    lines.erase(lines.begin());
    CHECK(check(1, "record 2 without \"prev\"", "the first record of a file") == 1);
  }
  SECTION("cut off at the end") {
    lines.resize(5);
    CHECK(check(0, "an end at record 5", "record 8 with hash") == 1);
    // The next start knows, and what is missing stays missed.
    write_log({.file = folder.file()}, 1);
    CHECK(read(folder.file()).find("ends with record 5, but 8 were written") != std::string::npos);
    const auto findings = findings_of({folder.file()});
    REQUIRE(findings.size() == 1);
    CHECK(findings[0].line == 6);
    CHECK(findings[0].found == "record 9");
    CHECK(findings[0].expected == "record 6");
  }
  SECTION("cut off at the end, and what tells of it is gone") {
    lines.resize(5);
    write_lines(folder.file(), lines);
    check_without_head();
  }
  SECTION("cut off to where the gateway had stopped before, and what tells of it is gone") {
    write_log({.file = folder.file()}, 2);
    write_lines(folder.file(), lines);
    check_without_head();
  }
  SECTION("cut off at the end, and what tells of it was changed to match") {
    write_lines(folder.file(), lines);
    const auto last = parse_audit_line(lines[4]).value();
    lines.resize(5);
    std::ofstream(folder.file("audit.head")) << last.seq << ' ' << last.hash << '\n';
    write_lines(folder.file(), lines);
    CHECK(findings_of({folder.file()}).empty());
    write_log({.file = folder.file()}, 1);
    CHECK(read(folder.file()).find("there is no \\\"stopped\\\"") != std::string::npos);
  }
  SECTION("a file that was renamed, checked alone") {
    fs::rename(folder.file(), folder.file("audit.1"));
    CHECK(findings_of({folder.file("audit.1")}).empty());
  }
}

TEST_CASE("a line that the power failed in is cut off; lines of before there was a chain stay") {
  const Folder folder;
  write_lines(folder.file(), {R"({"time":"2020-01-01T00:00:00.000Z","event":"write"})"});
  write_log({.file = folder.file(), .syncs = true}, 1);
  std::ofstream(folder.file(), std::ios::app) << R"({"seq":4,"ti)";
  write_log({.file = folder.file()}, 1);
  const auto trail = verify_audit_files({folder.file()}).value();
  CHECK(trail.findings.empty());
  CHECK(trail.unchained == 1);
  CHECK(trail.records == 6);
  CHECK(read(folder.file()).find("12 bytes were cut off") != std::string::npos);
}

TEST_CASE("a full disk keeps nobody waiting; what does not fit into memory is lost, and counted") {
  const Folder folder;
  AuditLog log;
  const auto who = alice();
  log.add({.event = "login", .who = &who});  // nowhere
  REQUIRE(log.open({.file = "/dev/full"}));
  CHECK(log.state().failure == "No space left on device");
  CHECK(log.admit());
  for (int i = 0; i < 10; ++i) log.add({.event = "call", .who = &who});
  CHECK_FALSE(log.flush(std::chrono::milliseconds(1)));
  CHECK(log.state().lost == 0);
  const std::string long_text(400, 'x');
  for (std::size_t i = 0; i < AuditLog::max_waiting_bytes / 400; ++i) log.add({.event = "call", .detail = long_text});
  const auto lost = log.state().lost;
  CHECK(lost > 0);
  // What waits is written as soon as there is a disk, and that something is missing is told.
  REQUIRE(log.open({.file = folder.file(), .fails_closed = true}));
  REQUIRE(log.flush(std::chrono::seconds(30)));
  CHECK(log.admit());
  const auto text = read(folder.file());
  CHECK(text.find("\"event\":\"resumed\"") != std::string::npos);
  CHECK(text.find(std::to_string(lost) + " records were lost") != std::string::npos);
  CHECK(findings_of({folder.file()}).empty());
}

namespace {

/// The numbers of the records that are found, the newest first.
std::vector<std::uint64_t> tail_of(const AuditConfig& config, std::size_t limit, const AuditFilter& filter = {}) {
  const auto tail = read_audit_tail(config, filter, limit);
  REQUIRE(tail);
  std::vector<std::uint64_t> out;
  for (const auto& line : tail->records) out.push_back(nlohmann::json::parse(line)["seq"]);
  return out;
}

}  // namespace

TEST_CASE("the newest records are read from the end, through renamed files, up to as many as are wanted") {
  const Folder folder;
  const AuditConfig config{.file = folder.file(), .max_bytes = 40'000, .keep = 20};
  write_log(config, 1000);  // about 300 bytes each: some files, each with more than a block or less
  REQUIRE(fs::exists(folder.file("audit.2")));
  std::vector<std::uint64_t> all;
  for (std::uint64_t seq = 1002; seq > 0; --seq) all.push_back(seq);
  CHECK(tail_of(config, 2000) == all);
  CHECK(read_audit_tail(config, {}, 1002)->is_all);
  CHECK_FALSE(read_audit_tail(config, {}, 1001)->is_all);
  CHECK(tail_of(config, 3) == std::vector<std::uint64_t>{1002, 1001, 1000});
  CHECK(tail_of(config, 9, {.user = "alice"}).size() == 9);
  CHECK(tail_of(config, 9, {.user = "bob"}).empty());
  CHECK(tail_of(config, 9, {.user = "a*", .since = "9"}).empty());

  // One large file: blocks end anywhere within its lines.
  const AuditConfig whole{.file = folder.file("whole")};
  write_log(whole, 1000);
  CHECK(tail_of(whole, 2000) == all);
}

TEST_CASE("the end of an audit log that is cut, foreign or renamed meanwhile is read as far as it goes") {
  const Folder folder;
  const AuditConfig config{.file = folder.file()};
  write_log(config, 3);
  {
    std::ofstream out(config.file, std::ios::app);
    out << "no record\n{\"seq\":6,\"half";
  }
  CHECK(tail_of(config, 9) == std::vector<std::uint64_t>{5, 4, 3, 2, 1});
  fs::copy_file(config.file, config.file + ".1");  // as if it was renamed after it was read
  CHECK(tail_of(config, 9) == std::vector<std::uint64_t>{5, 4, 3, 2, 1});
  CHECK(read_audit_tail(config, {}, 5)->is_all);
}

TEST_CASE("an audit log that can't be read from its end says why") {
  const Folder folder;
  const auto gone = read_audit_tail({.file = folder.file()}, {}, 1);
  REQUIRE_FALSE(gone);
  CHECK(gone.error().code == rr::ErrorCode::io_error);
  CHECK_THAT(gone.error().message, Catch::Contains("No such file"));
  const auto null = read_audit_tail({.file = "/dev/null"}, {}, 1);
  REQUIRE_FALSE(null);
  CHECK(null.error().code == rr::ErrorCode::invalid_state);
}

TEST_CASE("no more than the last 8 MiB of an audit log are looked at") {
  const Folder folder;
  const AuditConfig config{.file = folder.file()};
  write_log(config, 1);
  auto lines = lines_of(config.file);
  lines.insert(lines.begin() + 2, std::string(9 * 1024 * 1024, 'x'));
  write_lines(config.file, lines);
  const auto tail = read_audit_tail(config, {}, 9);
  REQUIRE(tail);
  CHECK(tail->records.size() == 1);
  CHECK_FALSE(tail->is_all);
}
