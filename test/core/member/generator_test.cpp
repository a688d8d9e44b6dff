// The generators of one client: how they are named, what each step does to them, when they are forgotten.
#include "core/member/generator.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

using namespace rr;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;

namespace {

MemberDefinition make_function(std::string name) {
  MemberDefinition function;
  function.kind = MemberKind::function;
  function.name = std::move(name);
  function.type.type = DataType::double_t;
  function.type.container = ContainerKind::generator;
  return function;
}

struct Script {
  GeneratorTable table{3};
  MemberDefinition count = make_function("count");
  Now now{TimePoint{} + 1h, {}};

  GeneratorId open(std::string_view path = "arm") {
    const auto id = table.add(path, count).value();
    REQUIRE(table.opened(id, now));
    return id;
  }
  Result<GeneratorTable::Step> begin(GeneratorId id, GeneratorStep step) {
    return table.begin("arm", count, generator_index(id), step, now);
  }
  ErrorCode code(GeneratorId id, GeneratorStep step = GeneratorStep::next) {
    const auto begun = begin(id, step);
    return begun ? ErrorCode::none : begun.error().code;
  }
};

}  // namespace

TEST_CASE("indices are positive, ids are never used again") {
  Script script;
  std::vector<GeneratorId> ids;
  for (int i = 0; i < 100; ++i) {
    ids.push_back(script.open());
    CHECK(generator_index(ids.back()) >= 0);
    script.table.remove(ids.back());
  }
  std::sort(ids.begin(), ids.end());
  CHECK(std::adjacent_find(ids.begin(), ids.end()) == ids.end());
}

TEST_CASE("a generator is stepped by its index, at its own member and path alone") {
  Script script;
  const auto id = script.open();
  const auto other = make_function("other");
  CHECK(script.begin(id, GeneratorStep::next)->id == id);
  CHECK(script.table.begin("arm", other, generator_index(id), GeneratorStep::next, script.now).error().code ==
        ErrorCode::invalid_operation);
  CHECK(script.table.begin("leg", script.count, generator_index(id), GeneratorStep::next, script.now).error().code ==
        ErrorCode::invalid_operation);
  const auto wrong = script.table.begin("arm", script.count, generator_index(id) ^ 1, GeneratorStep::next, script.now);
  CHECK(wrong.error().code == ErrorCode::invalid_operation);
  CHECK_THAT(wrong.error().message, Contains("Invalid generator") && Contains("count"));
}

TEST_CASE("nobody steps a generator whose function has not returned") {
  Script script;
  const auto id = script.table.add("arm", script.count).value();
  CHECK(script.code(id) == ErrorCode::invalid_operation);
  REQUIRE(script.table.opened(id, script.now));
  CHECK(script.code(id) == ErrorCode::none);
}

TEST_CASE("next that fails ends a generator, next that succeeds does not") {
  Script script;
  const auto id = script.open();
  REQUIRE(script.begin(id, GeneratorStep::next).has_value());
  CHECK_FALSE(script.table.finish(id, GeneratorStep::next, false, script.now));
  REQUIRE(script.begin(id, GeneratorStep::next).has_value());
  CHECK(script.table.finish(id, GeneratorStep::next, true, script.now));
  CHECK(script.code(id) == ErrorCode::invalid_operation);
  CHECK(script.table.size() == 0);
}

TEST_CASE("after close and abort the table itself answers, once, then the generator is unknown") {
  Script script;
  const auto [step, answer] = GENERATE(std::pair(GeneratorStep::close, ErrorCode::stop_iteration),
                                       std::pair(GeneratorStep::abort, ErrorCode::operation_aborted));
  const auto id = script.open();
  CHECK(script.begin(id, step)->is_for_application);
  CHECK(script.table.finish(id, step, false, script.now));
  CHECK_FALSE(script.begin(id, step)->is_for_application);
  CHECK_FALSE(script.begin(id, GeneratorStep::close)->is_for_application);
  CHECK(script.code(id) == answer);
  CHECK(script.code(id) == ErrorCode::invalid_operation);
}

TEST_CASE("a close overtakes a next that is not answered yet") {
  Script script;
  const auto id = script.open();
  REQUIRE(script.begin(id, GeneratorStep::next).has_value());
  CHECK(script.begin(id, GeneratorStep::close)->is_for_application);
  CHECK_FALSE(script.table.finish(id, GeneratorStep::next, true, script.now));  // the close is still to come
  CHECK(script.table.finish(id, GeneratorStep::close, false, script.now));
  CHECK(script.code(id) == ErrorCode::stop_iteration);
}

TEST_CASE("a client runs a bounded number of generators") {
  Script script;
  const auto first = script.open();
  script.open();
  script.open();
  CHECK(script.table.add("arm", script.count).error().code == ErrorCode::out_of_system_resource);
  script.table.remove(first);
  CHECK(script.table.add("arm", script.count).has_value());
}

TEST_CASE("a generator that has ended is no longer one that the client runs") {
  Script script;
  const auto running = script.open();
  GeneratorId ended = 0;
  for (int i = 0; i < 10; ++i) {
    script.now.steady += 1s;
    ended = script.open();
    REQUIRE(script.begin(ended, i % 2 == 0 ? GeneratorStep::close : GeneratorStep::abort).has_value());
    script.table.finish(ended, GeneratorStep::close, false, script.now);
    CHECK(script.table.size() <= 3);
  }
  CHECK(script.begin(running, GeneratorStep::next).has_value());
  CHECK(script.code(ended) == ErrorCode::operation_aborted);  // the newest are those that a late step may still be for
  script.open();
  const auto closing = script.open();
  REQUIRE(script.begin(closing, GeneratorStep::close).has_value());  // and is not answered yet
  CHECK(script.table.add("arm", script.count).error().code == ErrorCode::out_of_system_resource);
}

TEST_CASE("generators that are left alone are forgotten after ten minutes, closed ones after 30 seconds") {
  Script script;
  const auto idle = script.open();
  const auto used = script.open();
  const auto closed = script.open();
  REQUIRE(script.begin(closed, GeneratorStep::close).has_value());
  script.table.finish(closed, GeneratorStep::close, false, script.now);
  CHECK(script.table.deadline() == script.now.steady + 30s);
  script.now.steady += 30s;
  CHECK(script.table.remove_idle(script.now).empty());  // the application has forgotten that one already
  CHECK(script.table.size() == 2);
  REQUIRE(script.begin(used, GeneratorStep::next).has_value());
  script.table.finish(used, GeneratorStep::next, false, script.now);
  script.now.steady += 570s - 1ns;
  CHECK(script.table.remove_idle(script.now).empty());
  script.now.steady += 1ns;
  CHECK(script.table.remove_idle(script.now) == std::vector{idle});
  CHECK(script.table.deadline() == script.now.steady + 30s);
}

TEST_CASE("a generator that is at work is not idle, however long it takes") {
  Script script;
  const auto id = script.open();
  REQUIRE(script.begin(id, GeneratorStep::next).has_value());
  script.now.steady += 24h;
  CHECK(script.table.remove_idle(script.now).empty());
  REQUIRE(script.begin(id, GeneratorStep::next).has_value());
  script.table.finish(id, GeneratorStep::next, false, script.now);  // one of the two
  script.now.steady += 24h;
  CHECK(script.table.remove_idle(script.now).empty());
  script.table.finish(id, GeneratorStep::next, false, script.now);
  CHECK(script.table.deadline() == script.now.steady + 10min);
}

TEST_CASE("the generators of a released object go, and late answers for them are no harm") {
  Script script;
  const auto kept = script.open("arm");
  const auto released = script.open("arm.tool");
  REQUIRE(script.table.begin("arm.tool", script.count, generator_index(released), GeneratorStep::next, script.now)
              .has_value());
  const auto gone = script.table.remove_released([](std::string_view path) { return path == "arm.tool"; });
  CHECK(gone == std::vector{released});
  CHECK_FALSE(script.table.finish(released, GeneratorStep::next, true, script.now));
  CHECK(script.code(kept) == ErrorCode::none);
}
