// Ranges and shapes of memories: what is within, what is not, and where its items lie.
#include "core/member/memory.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <numeric>

using namespace rr;
using Catch::Matchers::Contains;

namespace {

constexpr std::uint64_t largest = std::numeric_limits<std::uint64_t>::max();

struct Definitions {
  Definitions() {
    types
        .add({R"(service test.memories
stdver 0.10
namedarray Vector
  field double x
  field double y
end
pod Sample
  field int32 id
  field double[3] reading
end
object Store
  memory double[] plain
  memory int16[*] grid
  memory Vector[] vectors
  memory Sample[*] samples
end
)"},
             RobdefMode::strict)
        .value();
  }
  const MemberDefinition& member(std::string_view name) const {
    return *types.find_entity("test.memories.Store")->find_member(name);
  }
  ErrorCode check(std::string_view name, MemoryShape position, MemoryShape count, MemoryShape dimensions) const {
    const auto fits = check_memory_range({std::move(position), std::move(count)}, dimensions, member(name));
    return fits ? ErrorCode::none : fits.error().code;
  }
  TypeRegistry types;
};

/// The items of a range, copied out of a memory that holds 0, 1, 2 ...
std::vector<std::uint64_t> copied(const MemoryShape& dimensions, const MemoryRange& range,
                                  std::size_t* runs = nullptr) {
  std::vector<std::uint64_t> items;
  for_each_run(dimensions, range, [&](std::uint64_t from, std::uint64_t to, std::uint64_t count) {
    CHECK(to == items.size());
    for (std::uint64_t i = 0; i < count; ++i) items.push_back(from + i);
    if (runs) ++*runs;
  });
  return items;
}

}  // namespace

TEST_CASE("ranges are within their memory, to the last item and not one beyond") {
  const Definitions definitions;
  CHECK(definitions.check("plain", {0}, {10}, {10}) == ErrorCode::none);
  CHECK(definitions.check("plain", {10}, {0}, {10}) == ErrorCode::none);
  CHECK(definitions.check("plain", {1}, {10}, {10}) == ErrorCode::out_of_range);
  CHECK(definitions.check("plain", {11}, {0}, {10}) == ErrorCode::out_of_range);
  CHECK(definitions.check("plain", {0}, {1}, {0}) == ErrorCode::out_of_range);
  CHECK(definitions.check("grid", {1, 2}, {3, 0}, {4, 2}) == ErrorCode::none);
  CHECK(definitions.check("grid", {1, 2}, {3, 1}, {4, 2}) == ErrorCode::out_of_range);
}

TEST_CASE("positions and counts whose sum or product overflows are out of range") {
  const Definitions definitions;
  CHECK(definitions.check("plain", {largest}, {2}, {10}) == ErrorCode::out_of_range);
  CHECK(definitions.check("plain", {2}, {largest}, {10}) == ErrorCode::out_of_range);
  CHECK(definitions.check("plain", {largest}, {largest}, {largest}) == ErrorCode::out_of_range);
  CHECK(definitions.check("grid", {0, 0}, {1ull << 32, 1ull << 32}, {largest, largest}) == ErrorCode::out_of_range);
}

TEST_CASE("another number of dimensions is an argument that says so") {
  const Definitions definitions;
  CHECK(definitions.check("grid", {0}, {1}, {4, 2}) == ErrorCode::invalid_argument);
  CHECK(definitions.check("grid", {0, 0}, {1}, {4, 2}) == ErrorCode::invalid_argument);
  CHECK(definitions.check("grid", {0, 0, 0}, {1, 1, 1}, {4, 2}) == ErrorCode::invalid_argument);
}

TEST_CASE("items lie column-major, and whole dimensions make long runs") {
  const MemoryShape dimensions{4, 3, 2};
  std::size_t runs = 0;
  std::vector<std::uint64_t> all(24);
  std::iota(all.begin(), all.end(), 0u);
  CHECK(copied(dimensions, {{0, 0, 0}, {4, 3, 2}}, &runs) == all);
  CHECK(runs == 1);
  CHECK(copied(dimensions, {{1, 0, 1}, {2, 3, 1}}) == std::vector<std::uint64_t>{13, 14, 17, 18, 21, 22});
  runs = 0;
  CHECK(copied(dimensions, {{0, 1, 0}, {4, 2, 2}}, &runs).size() == 16);
  CHECK(runs == 2);
  CHECK(copied(dimensions, {{3, 2, 0}, {1, 1, 2}}) == std::vector<std::uint64_t>{11, 23});
  CHECK(copied(dimensions, {{0, 3, 0}, {4, 0, 2}}).empty());
  CHECK(copied({5}, {{2}, {3}}) == std::vector<std::uint64_t>{2, 3, 4});
}

TEST_CASE("values say their shape, if they are values of the memory") {
  const Definitions definitions;
  const auto shape = [&](std::string_view name, const Value& value) {
    return shape_of(value, definitions.member(name), definitions.types);
  };
  const auto numbers = [](std::size_t count) { return Array::take(std::vector<double>(count)); };
  CHECK(shape("plain", numbers(3)).value() == MemoryShape{3});
  CHECK(shape("grid", MultiDimArray{{2, 0}, numbers(0)}).value() == MemoryShape{2, 0});
  CHECK(shape("vectors", NamedArray{"", numbers(4)}).value() == MemoryShape{2});
  CHECK(shape("samples", PodArray{"", {{}, {}}, {1, 2}, false, true}).value() == MemoryShape{1, 2});

  CHECK(shape("plain", MultiDimArray{{1}, numbers(1)}).error().code == ErrorCode::data_type_mismatch);
  CHECK(shape("grid", numbers(1)).error().code == ErrorCode::data_type_mismatch);
  CHECK(shape("vectors", NamedArray{"", numbers(3)}).error().code == ErrorCode::data_type_mismatch);
  CHECK(shape("vectors", PodArray{"", {{}}}).error().code == ErrorCode::data_type_mismatch);
  CHECK(shape("samples", PodArray{"", {{}, {}}}).error().code == ErrorCode::data_type_mismatch);
  CHECK(shape("plain", Value("text")).error().code == ErrorCode::data_type_mismatch);
  const auto wrong = shape("grid", MultiDimArray{{2, 2}, numbers(3)}).error();
  CHECK(wrong.code == ErrorCode::invalid_argument);
  CHECK_THAT(wrong.message, Contains("dims [2,2] do not match 3 items"));
}

TEST_CASE("items have a size, exact for numbers and large enough for pods") {
  const Definitions definitions;
  const auto size = [&](std::string_view name) {
    return memory_item_size(definitions.member(name), definitions.types);
  };
  CHECK(size("plain") == 8);
  CHECK(size("grid") == 2);
  CHECK(size("vectors") == 16);
  CHECK(size("samples") >= 4 + 24);
  CHECK(size("samples") < 200);
}

TEST_CASE("ranges and data that a message does not bring in order are refused") {
  const Definitions definitions;
  const auto& plain = definitions.member("plain");
  const auto range_of = [&](const MemberDefinition& member, auto write) {
    Message message;
    message.begin_entry(EntryType::memory_read, "store", member.name);
    write(message);
    const auto range = read_memory_range(message, message.entries.front(), member);
    return range ? ErrorCode::none : range.error().code;
  };
  const std::uint64_t numbers[] = {1, 2, 3};
  const auto add = [&](Message& message, const char* name, std::uint32_t count) {
    message.add(name, DataType::uint64_t, count, {reinterpret_cast<const std::uint8_t*>(numbers), count * 8});
  };
  const auto both = [&](std::uint32_t position, std::uint32_t count) {
    return [&add, position, count](Message& message) {
      add(message, "memorypos", position);
      add(message, "count", count);
    };
  };
  CHECK(range_of(plain, both(1, 1)) == ErrorCode::none);
  CHECK(range_of(plain, both(2, 1)) == ErrorCode::invalid_argument);
  CHECK(range_of(plain, both(0, 1)) == ErrorCode::invalid_argument);
  CHECK(range_of(definitions.member("grid"), both(3, 3)) == ErrorCode::none);
  CHECK(range_of(definitions.member("grid"), both(3, 2)) == ErrorCode::invalid_argument);
  CHECK(range_of(plain, [&](Message& message) { add(message, "memorypos", 1); }) ==
        ErrorCode::message_element_not_found);
  CHECK(range_of(plain, [&](Message& message) {
          message.add_scalar("memorypos", DataType::double_t, 1.0);
          add(message, "count", 1);
        }) == ErrorCode::data_type_mismatch);
}

TEST_CASE("pods that hold one another beyond counting are items of a size all the same") {
  const auto chain = [](std::size_t length, std::size_t fields) {
    std::string text = "service test.pods\nstdver 0.10\nobject Store\n  memory p0[] samples\nend\n";
    for (std::size_t i = 0; i < length; ++i) {
      text += "pod p" + std::to_string(i) + "\n";
      for (std::size_t field = 0; field < fields; ++field)
        text += "  field p" + std::to_string(i + 1) + " a" + std::to_string(field) + "\n";
      text += "end\n";
    }
    return text + "pod p" + std::to_string(length) + "\n  field int32 id\nend\n";
  };
  for (const auto& text : {chain(60, 2), chain(20'000, 1)}) {
    TypeRegistry types;
    types.add({text}, RobdefMode::strict).value();
    const auto* store = types.find_entity("test.pods.Store");
    CHECK(memory_item_size(*store->find_member("samples"), types) == largest);
  }
}
