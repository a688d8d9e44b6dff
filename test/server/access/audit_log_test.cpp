#include "server/access/audit_log.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "test/support/print.hpp"

using namespace rrgate;

namespace {

Identity alice() {
  Identity out;
  out.name = "alice";
  out.roles = {"operator"};
  out.proof = Proof::token;
  out.client = "192.0.2.1:5";
  return out;
}

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

TEST_CASE("a line of the audit log says who did what, when") {
  const auto who = alice();
  const AccessRequest what{"create", "Create", "Create.axes[0]", "speed", Verb::write};
  const auto now = std::chrono::system_clock::time_point(std::chrono::milliseconds(1'900'000'000'007));
  CHECK(format_audit_line({"write", &who, &what, {}}, now) ==
        R"({"time":"2030-03-17T17:46:40.007Z","event":"write","user":"alice","roles":["operator"],"proof":"token",)"
        R"("client":"192.0.2.1:5","verb":"write","device":"create","service":"Create","path":"Create.axes[0]",)"
        R"("member":"speed"})"
        "\n");
  // Nothing that strangers choose begins another line, or fills the disk with one.
  Identity evil;
  evil.name = "a\n{\"event\":\"login\"}\xff" + std::string(5000, 'x');
  const auto line = format_audit_line({"login_failed", &evil, nullptr, "why"}, now);
  CHECK(line.find('\n') == line.size() - 1);
  CHECK(line.size() < 1000);
  CHECK(nlohmann::json::parse(line)["detail"] == "why");
}

TEST_CASE("the audit log is added to, moves on when its file has moved, and outlives a full disk") {
  std::string folder = (std::filesystem::temp_directory_path() / "rrgate-audit-XXXXXX").string();
  REQUIRE(::mkdtemp(folder.data()));
  const std::filesystem::path path = folder + "/audit";
  const auto who = alice();
  AuditLog log;
  CHECK(log.write({"login", &who}));  // nowhere
  REQUIRE(log.open(path.string()));
  CHECK((std::filesystem::status(path).permissions() & std::filesystem::perms(0777)) == std::filesystem::perms(0600));
  CHECK(log.write({"login", &who}));
  std::filesystem::rename(path, folder + "/audit.1");
  CHECK(log.write({"login", &who}));
  REQUIRE(log.reopen());
  CHECK(log.write({"call", &who}));
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  CHECK(lines(read(folder + "/audit.1")) == 2);
  CHECK(lines(read(path)) == 1);
  CHECK_FALSE(log.open(folder + "/no/such/folder"));
  CHECK(log.write({"call", &who}));
  CHECK(lines(read(path)) == 2);
  CHECK(log.lost_lines() == 0);
  REQUIRE(log.open("/dev/full"));
  CHECK_FALSE(log.write({"call", &who}));
  CHECK(log.lost_lines() == 1);
  std::filesystem::remove_all(folder);
}
