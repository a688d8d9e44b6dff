// rrgate check and fmt, and how definitions find their imports.
#include <catch2/catch.hpp>

#include "node/generate/definition_set.hpp"
#include "server/cli/command.hpp"
#include "test/server/support/command_run.hpp"
#include "test/support/folder.hpp"

using namespace rrgate;
using Catch::Matchers::Contains;
using rrgate::test::Folder;
using rrgate::test::run_command;

namespace {

constexpr const char* lamp =
    "service test.lamp\nstdver 0.10\nimport test.light\nobject Lamp\n"
    "    property test.light.Colour colour\nend\n";
constexpr const char* light = "service test.light\nstdver 0.10\nstruct Colour\n    field double red\nend\n";

}  // namespace

TEST_CASE("check: imports are found among the files, beside them, and in folders") {
  const Folder folder;
  const auto file = folder.write("lamp.robdef", lamp);
  const auto missing = run_command("check", {file});
  CHECK(missing.code == exit_failed);
  CHECK(missing.errors == file +
                              ":3:8: error: found the import of 'test.light', but no such definition was given "
                              "[import-missing]\n");

  const auto given = folder.write("any name.robdef", light);
  CHECK(run_command("check", {file, given}).output == file + ": good; test.lamp\n" + given + ": good; test.light\n");
  const auto away = folder.write("away/test.light.robdef", light);
  CHECK(run_command("check", {file}).code == exit_failed);
  CHECK(run_command("check", {"-I", folder.path("none"), "-I", folder.path("away"), file}).code == exit_ok);
  folder.write("test.light.robdef", light);
  CHECK(run_command("check", {file}).output == file + ": good; test.lamp\n");
}

TEST_CASE("check: a set is in order of its imports, whatever the order of files") {
  const Folder folder;
  const std::vector<std::string> files{folder.write("lamp.robdef", lamp), folder.write("test.light.robdef", light)};
  const auto set = DefinitionSet::from_files(files, {}, rr::RobdefMode::strict);
  REQUIRE(set.is_good());
  REQUIRE(set.in_order().size() == 2);
  CHECK(set.in_order()[0]->name == "test.light");
  CHECK(set.requested()[0]->name == "test.lamp");
  CHECK(set.find_entity("test.light.Colour")->members.size() == 1);
  CHECK(set.find_entity("test.lamp.Colour") == nullptr);
  CHECK(DefinitionSet::from_files({&files[0], 1}, {}, rr::RobdefMode::strict).requested().size() == 1);
}

TEST_CASE("check: errors name file, line and column; compat takes old syntax with warnings") {
  const Folder folder;
  const auto bad = folder.write("bad.robdef", "service a\nstdver 0.10\nobject X\n    property  int33 x\nend\n");
  const auto found = run_command("check", {bad});
  CHECK(found.code == exit_failed);
  CHECK_THAT(found.errors, Contains(bad + ":4:15: error: ") && Contains("'int33'"));
  const auto old = folder.write("old.robdef", "service a\noption version 0.8\noption constant int16 A.B 1\n");
  CHECK(run_command("check", {old}).code == exit_failed);
  const auto compat = run_command("check", {"--compat", old});
  CHECK(compat.code == exit_ok);
  CHECK_THAT(compat.errors, Contains(old + ":3:") && Contains(": warning: "));
  const auto none = run_command("check", {folder.path("none.robdef")});
  CHECK(none.code == exit_failed);
  CHECK_THAT(none.errors, Contains("none.robdef") && Contains("no file that can be read"));
  CHECK(run_command("check", {}).code == exit_usage);
  CHECK(run_command("check", {"--strict", old}).code == exit_usage);
}

TEST_CASE("fmt: prints the canonical text, checks the layout, or lays out in place") {
  const Folder folder;
  const auto file =
      folder.write("a.robdef", "service  a\nstdver 0.10\n# why\nobject X\n  ## what\n property  int32 x\nend\n");
  CHECK(run_command("fmt", {file}).output == "service a\n\nstdver 0.10\n\nobject X\n    property int32 x\nend\n\n");
  const auto before = run_command("fmt", {"--check", file});
  CHECK(before.code == exit_failed);
  CHECK(before.output == file + "\n");
  CHECK(run_command("fmt", {"--in-place", file}).code == exit_ok);
  CHECK(folder.read("a.robdef") == "service a\nstdver 0.10\n# why\nobject X\n    ## what\n    property int32 x\nend\n");
  CHECK(run_command("fmt", {"--check", file}).code == exit_ok);
}

TEST_CASE("fmt: bad files are reported and left alone") {
  const Folder folder;
  const auto bad = folder.write("bad.robdef", "service a\nstructure X\n");
  const auto found = run_command("fmt", {"--in-place", bad, folder.path("none.robdef")});
  CHECK(found.code == exit_failed);
  CHECK_THAT(found.errors, Contains(bad + ":2") && Contains("none.robdef: error: "));
  CHECK(folder.read("bad.robdef") == "service a\nstructure X\n");
  CHECK(run_command("fmt", {"--in-place", "--check", bad}).code == exit_usage);
  CHECK(run_command("fmt", {}).code == exit_usage);
}
