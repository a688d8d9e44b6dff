#include <catch2/catch.hpp>

#include "server/cli/command.hpp"
#include "server/log/log.hpp"

using namespace rrgate;

TEST_CASE("options are taken in both spellings, unknown ones are named") {
  constexpr std::string_view known[] = {"--config", "--port"};
  const auto parse = [&](std::vector<std::string_view> arguments) { return parse_arguments(arguments, {known}); };
  CHECK(parse({"--config", "a"}).options.at("--config") == "a");
  CHECK(parse({"--config=a=b"}).options.at("--config") == "a=b");
  CHECK(parse({"file", "--port=1"}).operands == std::vector<std::string>{"file"});
  CHECK_THAT(parse({"--confg", "a"}).error, Catch::Contains("unknown option '--confg'"));
  CHECK_THAT(parse({"--config"}).error, Catch::Contains("needs a value"));
  CHECK_THAT(parse({"--port=1", "--port=2"}).error, Catch::Contains("twice"));

  constexpr std::string_view flags[] = {"--quiet"};
  constexpr std::string_view repeated[] = {"-I"};
  const auto parse_more = [&](std::vector<std::string_view> arguments) {
    return parse_arguments(arguments, {known, flags, repeated});
  };
  const auto parsed = parse_more({"-I", "a", "--quiet", "file", "-I=b", "--port", "1"});
  CHECK(parsed.error.empty());
  CHECK(parsed.repeated == std::vector<std::string>{"a", "b"});
  CHECK(parsed.flags.count("--quiet") == 1);
  CHECK(parsed.operands == std::vector<std::string>{"file"});
  CHECK_THAT(parse_more({"--quiet=1"}).error, Catch::Contains("takes no value"));
  CHECK_THAT(parse_more({"-I"}).error, Catch::Contains("needs a value"));
}

TEST_CASE("numbers, '-' and what follows '--' are operands, and numbers of options are checked") {
  constexpr std::string_view known[] = {"--count"};
  const auto parse = [&](std::vector<std::string_view> arguments) { return parse_arguments(arguments, {known}); };
  CHECK(parse({"-5", "-", "--count=3"}).operands == std::vector<std::string>{"-5", "-"});
  CHECK(parse({"a", "--", "--count", "-b"}).operands == std::vector<std::string>{"a", "--count", "-b"});
  CHECK(number_option(parse({"--count=3"}), "--count", 7, 10) == 3u);
  CHECK(number_option(parse({}), "--count", 7, 10) == 7u);
  CHECK_FALSE(number_option(parse({"--count=11"}), "--count", 7, 10));
  CHECK_FALSE(number_option(parse({"--count=3x"}), "--count", 7, 10));
  CHECK_FALSE(number_option(parse({"--count", ""}), "--count", 7, 10));
}

TEST_CASE("commands are found by name; help and mistakes have their exit codes") {
  static std::size_t given = 0;
  constexpr Command commands[] = {{"go", "go FILE", "goes", [](Arguments arguments) {
                                     given = arguments.size();
                                     return 7;
                                   }}};
  const auto run = [&](std::vector<std::string_view> arguments) { return run_command_line(commands, arguments); };
  CHECK(run({"go", "a", "b"}) == 7);
  CHECK(given == 2);
  CHECK(run({"go", "--help"}) == exit_ok);
  CHECK(run({"--help"}) == exit_ok);
  CHECK(run({"--version"}) == exit_ok);
  CHECK(run({"stop"}) == exit_usage);
  CHECK(run({"--verbose"}) == exit_usage);
  CHECK(run({}) == exit_usage);
}

TEST_CASE("log lines quote what strangers wrote") {
  CHECK(format_log_text("client gone", {{"peer", "127.0.0.1:1"}, {"bytes", 7}}) ==
        "client gone peer=127.0.0.1:1 bytes=7");
  CHECK(format_log_text("x", {{"name", "a b"}, {"none", ""}}) == "x name='a b' none=''");
  CHECK(format_log_text("x", {{"name", "a\nlevel=error"}}) == "x name='a\\x0alevel=error'");
  CHECK(format_log_json("x", {{"name", "a\"\n\\"}, {"n", 7}}) == R"("event":"x","name":"a\"\u000a\\","n":7)");
  CHECK(format_log_text("x", {{"name", std::string(1000, 'y')}}).size() < 400);
}
