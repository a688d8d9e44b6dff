// Transfers in parts: each below the limit, all in order, together the whole.
#include "core/member/memory_transfer.hpp"

#include <catch2/catch.hpp>
#include <numeric>

using namespace rr;

namespace {

MemberDefinition numbers_memory(ArrayKind array) {
  MemberDefinition member;
  member.kind = MemberKind::memory;
  member.name = "data";
  member.type.type = DataType::double_t;
  member.type.array = array;
  return member;
}

std::vector<MemoryRange> parts_of(MemoryRange range, std::uint64_t limit) {
  std::vector<MemoryRange> parts;
  MemoryParts all(std::move(range), limit);
  while (auto part = all.next()) parts.push_back(*part);
  return parts;
}

std::uint64_t product(const MemoryShape& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::uint64_t{1}, std::multiplies<>());
}

}  // namespace

TEST_CASE("a plain range is cut into pieces and a rest") {
  const auto parts = parts_of({{5}, {100}}, 64);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].position == MemoryShape{5});
  CHECK(parts[0].count == MemoryShape{64});
  CHECK(parts[1].position == MemoryShape{69});
  CHECK(parts[1].count == MemoryShape{36});
  CHECK(parts_of({{0}, {64}}, 64).size() == 1);
  CHECK(parts_of({{0}, {3}}, 1).size() == 3);
}

TEST_CASE("leading dimensions stay whole, the first that does not fit is cut, later ones go one at a time") {
  // As the reference cuts it: 64 bytes a request, doubles.
  auto parts = parts_of({{0, 0}, {4, 3}}, 8);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].count == MemoryShape{4, 2});
  CHECK(parts[1].position == MemoryShape{0, 2});
  CHECK(parts[1].count == MemoryShape{4, 1});

  parts = parts_of({{1, 1, 1}, {5, 2, 2}}, 3);
  REQUIRE(parts.size() == 8);
  CHECK(parts[0].count == MemoryShape{3, 1, 1});
  CHECK(parts[1].position == MemoryShape{4, 1, 1});
  CHECK(parts[1].count == MemoryShape{2, 1, 1});
  CHECK(parts[2].position == MemoryShape{1, 2, 1});
  CHECK(parts[7].position == MemoryShape{4, 2, 2});
}

TEST_CASE("parts cover every item once and in order, whatever the limit") {
  const MemoryRange range{{1, 0, 2, 1}, {3, 4, 1, 5}};
  const MemoryShape dimensions{5, 4, 3, 6};
  std::vector<std::uint64_t> wanted;
  const auto collect = [&](std::vector<std::uint64_t>& items, const MemoryRange& part) {
    for_each_run(dimensions, part, [&](std::uint64_t from, std::uint64_t, std::uint64_t count) {
      for (std::uint64_t i = 0; i < count; ++i) items.push_back(from + i);
    });
  };
  collect(wanted, range);
  REQUIRE(wanted.size() == 60);
  for (std::uint64_t limit = 1; limit <= 61; ++limit) {
    std::vector<std::uint64_t> items;
    for (const auto& part : parts_of(range, limit)) {
      CHECK(product(part.count) <= limit);
      collect(items, part);
    }
    CHECK(items == wanted);
  }
}

TEST_CASE("an empty range has no parts") {
  CHECK(parts_of({{0}, {0}}, 10).empty());
  CHECK(parts_of({{0, 0}, {5, 0}}, 10).empty());
  CHECK(parts_of({{0, 0, 0}, {0, 5, 5}}, 2).empty());
}

TEST_CASE("slices and the collector undo each other, and one part is not copied") {
  const TypeRegistry types;
  const auto member = numbers_memory(ArrayKind::multidim);
  std::vector<double> items(24);
  std::iota(items.begin(), items.end(), 0.0);
  const Value whole = MultiDimArray{{4, 3, 2}, Array::take(items)};
  for (const std::uint64_t limit : {1, 3, 5, 8, 24}) {
    MemoryCollector collector;
    std::uint64_t first = 0;
    for (const auto& part : parts_of({{0, 0, 0}, {4, 3, 2}}, limit)) {
      auto slice = memory_slice(whole, first, product(part.count), part.count, member, types);
      CHECK(slice.get_if<MultiDimArray>()->array.bytes().data() ==
            whole.get_if<MultiDimArray>()->array.bytes().data() + first * 8);
      first += product(part.count);
      collector.add(std::move(slice));
    }
    CHECK(collector.take(MemoryShape{4, 3, 2}, member, types) == whole);
  }
}

TEST_CASE("nothing at all is an empty value of the right type") {
  const TypeRegistry types;
  MemoryCollector none;
  const auto plain = none.take(MemoryShape{0}, numbers_memory(ArrayKind::variable), types);
  CHECK(plain == Value(Array::empty(DataType::double_t)));
  MemoryCollector empty;
  const auto grid = empty.take(MemoryShape{2, 0}, numbers_memory(ArrayKind::multidim), types);
  CHECK(grid == Value(MultiDimArray{{2, 0}, Array::empty(DataType::double_t)}));
}
