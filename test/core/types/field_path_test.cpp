#include "core/types/field_path.hpp"

#include <catch2/catch.hpp>

#include <deque>
#include "test/core/types/show_result.hpp"

using namespace rr;

TEST_CASE("a path reads like the way to the value") {
  const FieldPath root{nullptr, FieldPath::Step::field, 0, "pose", {}};
  const auto items = root.field("items", "com.x.Pose");
  const auto item = items.index(3);
  const auto entry = item.key("a 'k'\n");
  CHECK(path_text(root) == "pose");
  CHECK(path_text(items) == "pose.items");
  CHECK(path_text(entry) == "pose.items[3]['a \\'k\\'\\x0a']");
  CHECK(path_text(root.index(-4)) == "pose[-4]");
}

TEST_CASE("names that a peer chose are quoted") {
  const FieldPath root{nullptr, FieldPath::Step::field, 0, "a\x1b[31m", {}};
  CHECK(path_text(root) == "'a\\x1b[31m'");
}

TEST_CASE("a long path is cut in the middle") {
  std::deque<FieldPath> steps;
  steps.push_back({nullptr, FieldPath::Step::field, 0, "start", {}});
  for (int i = 0; i < 200; ++i) steps.push_back(steps.back().field("middle", "t.T"));
  steps.push_back(steps.back().field("end", "t.T"));
  const auto text = path_text(steps.back());
  CHECK(text.size() < 300);
  CHECK(text.substr(0, 12) == "start.middle");
  CHECK(text.substr(text.size() - 4) == ".end");
}

TEST_CASE("an error names the innermost named type") {
  const FieldPath root{nullptr, FieldPath::Step::field, 0, "pose", {}};
  const auto field = root.field("q", "com.x.Pose");
  const auto error = value_error(ErrorCode::data_type_error, "pack", field.index(1), "has 3, expected 4");
  CHECK(error.code == ErrorCode::data_type_error);
  CHECK(error.message == "pack 'pose.q[1]' (com.x.Pose): has 3, expected 4");
  CHECK(value_error(ErrorCode::null_value, "unpack", root, "is null").message == "unpack 'pose': is null");
}
