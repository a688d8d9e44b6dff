#include "core/types/multidim.hpp"

#include <catch2/catch.hpp>

#include "test/core/types/fixture.hpp"

using namespace rr;
using rr::test::type_of;

namespace {
std::optional<std::uint64_t> product(std::vector<std::uint32_t> dims) {
  return product_of(std::span<const std::uint32_t>(dims));
}
}  // namespace

TEST_CASE("the product of dims does not overflow") {
  CHECK(product({2, 3, 4}) == 24u);
  CHECK(product({}) == 1u);
  CHECK(product({0xffffffff, 0xffffffff}) == 0xfffffffe00000001u);
  CHECK(product({0x80000000, 0x80000000, 4}) == std::nullopt);
  CHECK(product({0xffffffff, 0xffffffff, 0xffffffff, 0}) == 0u);
  CHECK(product({0, 0xffffffff, 0xffffffff, 0xffffffff}) == 0u);
}

TEST_CASE("counts are those that the type declares") {
  const auto fixed = type_of(DataType::double_t, ArrayKind::fixed, {3});
  CHECK(wrong_count(fixed, 3).empty());
  CHECK(wrong_count(fixed, 2) == "has 2, expected 3");
  const auto max = type_of(DataType::double_t, ArrayKind::max, {3});
  CHECK(wrong_count(max, 0).empty());
  CHECK(wrong_count(max, 3).empty());
  CHECK(wrong_count(max, 4) == "has 4, expected at most 3");
  const auto grid = type_of(DataType::double_t, ArrayKind::fixed_multidim, {2, 3});
  CHECK(wrong_count(grid, 6).empty());
  CHECK(wrong_count(grid, 5) == "has 5, expected 6");
  CHECK(wrong_count(type_of(DataType::double_t, ArrayKind::variable), 1000).empty());
  const auto huge = type_of(DataType::double_t, ArrayKind::fixed_multidim, {2147483647, 2147483647, 2147483647});
  CHECK_FALSE(wrong_count(huge, 1).empty());
}

TEST_CASE("dims are those that the type declares") {
  const auto grid = type_of(DataType::double_t, ArrayKind::fixed_multidim, {2, 3});
  const auto has = [&](std::vector<std::uint32_t> dims) { return has_declared_dims(grid, dims); };
  CHECK(has({2, 3}));
  CHECK_FALSE(has({3, 2}));
  CHECK_FALSE(has({6}));
  CHECK_FALSE(has({2, 3, 1}));
  const std::vector<std::uint32_t> any{7, 8, 9};
  CHECK(has_declared_dims(type_of(DataType::double_t, ArrayKind::multidim), any));
}

TEST_CASE("dims are written short") {
  CHECK(dims_text(std::vector<std::uint32_t>{2, 3}) == "[2,3]");
  CHECK(dims_text({}) == "[]");
  CHECK(dims_text(std::vector<std::uint32_t>(1000, 7)).size() < 80);
}

TEST_CASE("the type of an item is written without the container") {
  auto type = type_of(DataType::double_t, ArrayKind::fixed, {3});
  type.container = ContainerKind::list;
  CHECK(item_type_text(type) == "double[3]");
}
