#include <catch2/catch.hpp>

#include "node/platform/text_file.hpp"
#include "server/access/access.hpp"
#include "server/access/access_text.hpp"
#include "server/cli/command.hpp"
#include "server/cli/printable.hpp"
#include "server/config/config.hpp"
#include "server/config/version.hpp"
#include "server/log/log.hpp"
#include "test/server/support/command_run.hpp"
#include "test/support/folder.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

struct Given {
  std::string file;
  std::vector<std::string> words;
  CLI::Option* rest = nullptr;
  int port = 7;
};
Given given;

/// Runs "go" or "cut fine" of a program that has these two.
test::CommandRun run(std::vector<std::string> words) {
  Commands commands;
  const auto keep = [](const Given& values) {
    given = values;
    if (values.rest) given.words = values.rest->results();
    return 9;
  };
  const auto [app, values] = commands.add<Given>("go", "Goes", keep);
  app.add_option("FILE", values.file, "What for")->required();
  app.add_option("--port", values.port, "Where to")->check(CLI::Range(0, 65535));
  values.rest = app.add_option("WORD", "How")
                    ->expected(1000)
                    ->allow_extra_args(false)
                    ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  commands.add<Given>("fine", "Cuts", keep, &commands.add_group("cut", "Parts"));
  return test::run_in_process([&] { return commands.run(std::move(words)); });
}

}  // namespace

TEST_CASE("commands take their options, and each word as it is") {
  CHECK(run({"go", "a", "--port", "1"}).code == 9);
  CHECK(given.file == "a");
  CHECK(given.port == 1);
  CHECK(run({"go", "--port=2", "a", "-5", "-", "[1, 2]", "{}", ""}).code == 9);
  CHECK(given.port == 2);
  CHECK(given.words == std::vector<std::string>{"-5", "-", "[1, 2]", "{}", ""});
  CHECK(run({"go", "a", "--", "--port", "-b", "go"}).code == 9);
  CHECK(given.words == std::vector<std::string>{"--port", "-b", "go"});
  CHECK(given.port == 7);
  CHECK(run({"cut", "fine"}).code == 9);
}

TEST_CASE("help and mistakes have their exit codes, and mistakes one sentence") {
  CHECK_THAT(run({"--help"}).output, Catch::Contains("Goes"));
  CHECK_THAT(run({"go", "--help"}).output, Catch::Contains("Where to"));
  CHECK_THAT(run({"help", "cut", "fine"}).output, Catch::Contains("Cuts"));
  CHECK(run({"go", "--help"}).code == exit_ok);
  CHECK(run({"--version"}).output == "rrgate " + std::string(version) + "\n");
  const auto mistake = [](std::vector<std::string> words) {
    const auto ran = run(std::move(words));
    CHECK(ran.code == exit_usage);
    CHECK(ran.output.empty());
    return ran.errors;
  };
  CHECK(mistake({"go"}) == "rrgate go: FILE is required; see rrgate go --help\n");
  CHECK_THAT(mistake({"go", "a", "--prot", "1"}), Catch::Contains("rrgate go: ") && Catch::Contains("--prot"));
  CHECK_THAT(mistake({"go", "a", "--port"}), Catch::Contains("--port"));
  CHECK_THAT(mistake({"go", "a", "--port", "x"}), Catch::Contains("--port") && Catch::Contains("x"));
  CHECK_THAT(mistake({"go", "a", "--port", "65536"}), Catch::Contains("65535"));
  CHECK_THAT(mistake({"go", "a", "--port=1", "--port=2"}), Catch::Contains("--port"));
  CHECK(mistake({"cut"}) == "rrgate cut: a command is required; see rrgate cut --help\n");
  CHECK_THAT(mistake({"stop"}), Catch::Contains("stop"));
  CHECK_THAT(mistake({"--verbose"}), Catch::Contains("--verbose"));
  CHECK_THAT(mistake({}), Catch::Contains("Goes"));
}

TEST_CASE("log lines quote what strangers wrote") {
  CHECK(format_log_text("client gone", {{"peer", "127.0.0.1:1"}, {"bytes", 7}}) ==
        "client gone peer=127.0.0.1:1 bytes=7");
  CHECK(format_log_text("x", {{"name", "a b"}, {"none", ""}}) == "x name='a b' none=''");
  CHECK(format_log_text("x", {{"name", "a\nlevel=error"}}) == "x name='a\\x0alevel=error'");
  CHECK(format_log_json("x", {{"name", "a\"\n\\"}, {"n", 7}}) == R"("event":"x","name":"a\"\u000a\\","n":7)");
  CHECK(format_log_text("x", {{"name", std::string(1000, 'y')}}).size() < 400);
}

TEST_CASE("init: the configuration has a key of its own, so that sign-ins outlive a restart") {
  const test::Folder folder;
  const auto config = folder.path("gateway.json");
  REQUIRE(test::run_command("init", {std::filesystem::path(config).parent_path().string()}).code == 0);
  const auto read = load_config(config);
  REQUIRE(read.findings.empty());
  const auto first = load_access(read.config.access);
  REQUIRE(first);
  CHECK((*first)->ticket_key.size() >= 48);
  CHECK(load_access(read.config.access).value()->ticket_key == (*first)->ticket_key);
  using std::filesystem::perms;
  const auto mode = std::filesystem::status(folder.path("tickets.key")).permissions();
  CHECK((mode & (perms::others_all | perms::group_write)) == perms::none);

  const test::Folder other;
  other.write("tickets.key", "somebody's");
  const auto again = test::run_command("init", {std::filesystem::path(other.path("x")).parent_path().string()});
  CHECK(again.code == 1);
  CHECK_THAT(again.errors, Catch::Contains("tickets.key: is there already; nothing was written"));

  const test::Folder third;
  third.write("gateway.json", R"({"listen": ["127.0.0.1:8080"], "devices": [], "discover": {"allow": []}})");
  const auto kept = test::run_command("init", {std::filesystem::path(third.path("x")).parent_path().string()});
  CHECK(kept.code == 1);
  CHECK_THAT(kept.errors, Catch::Contains("gateway.json: is there already, and says more than where to listen"));
}

TEST_CASE("init: the configuration deserves no warning") {
  const test::Folder folder;
  const auto config = folder.path("gateway.json");
  REQUIRE(test::run_command("init", {std::filesystem::path(config).parent_path().string()}).code == 0);
  const auto checked = test::run_command("check-config", {config});
  CHECK(checked.code == 0);
  CHECK(checked.errors.empty());
}

TEST_CASE("passwd: what others have changed while the password was typed stays") {
  /// Types a password, and whatever else happens meanwhile.
  struct Typist : std::streambuf {
    std::string typed = "secret\nsecret\n";
    std::function<void()> meanwhile;
    int underflow() override {
      if (eback()) return traits_type::eof();
      if (meanwhile) meanwhile();
      setg(typed.data(), typed.data(), typed.data() + typed.size());
      return traits_type::to_int_type(*gptr());
    }
  };
  const test::Folder folder;
  const auto users = folder.path("users");
  const auto set = [&](const std::string& name, std::function<void()> meanwhile) {
    Typist typist;
    typist.meanwhile = std::move(meanwhile);
    auto* const before = std::cin.rdbuf(&typist);
    const auto ran = test::run_command("passwd", {users, name});
    std::cin.rdbuf(before);
    std::cin.clear();
    return ran;
  };
  REQUIRE(set("alice", {}).code == exit_ok);
  REQUIRE(set("alice", [&] { REQUIRE(set("bob", {}).code == exit_ok); }).code == exit_ok);
  const auto both = read_text_file(users).value();
  CHECK(!find_line(both, "alice").empty());
  CHECK(!find_line(both, "bob").empty());

  std::string others;
  const auto refused = set("alice", [&] {
    REQUIRE(test::run_command("passwd", {users, "alice", "--delete"}).code == exit_ok);
    others = read_text_file(users).value();
  });
  CHECK(refused.code == exit_failed);
  CHECK_THAT(refused.errors, Catch::Contains("user 'alice' was changed meanwhile; nothing was changed"));
  CHECK(read_text_file(users) == others);
}

TEST_CASE("what would command a terminal is shown as question marks") {
  CHECK(printable("wei\u00df, \u20ac, \u00a0") == "wei\u00df, \u20ac, \u00a0");
  CHECK(printable("a\x1b[31m\x7f\r") == "a?[31m??");
  CHECK(printable("\u0080\u009b\u009f\u00a0") == "???\u00a0");
  CHECK(printable("a\tb\n\x1b") == "a?b??");
  CHECK(printable("a\tb\n\x1b", LineEnds::kept) == "a\tb\n?");
  CHECK(printable(std::string_view("\0\xc2", 2)) == "?\xc2");
}
