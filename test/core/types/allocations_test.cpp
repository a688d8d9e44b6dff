// Packing scalars, arrays, strings and structures of them allocates nothing once the message has its capacity.
// Counts calls of operator new, so it is a program of its own.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <new>

#include "test/core/types/fixture.hpp"
#include "test/core/types/show_result.hpp"

namespace {
std::size_t allocations = 0;
}

// noinline: GCC 12 sees malloc and free through them otherwise, and warns of a mismatch (-Wmismatched-new-delete).
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

using namespace rr;
using namespace rr::test;

namespace {

std::size_t count_while_packing(const Value& value, const TypeDefinition& type) {
  Message message;
  bool ok = true;
  const auto pack_once = [&] {
    message.clear();
    message.begin_entry(EntryType::property_get_res, "svc", "d1", 5);
    ok = ok && pack(message, "value", value, type, test_types());
  };
  pack_once();
  const auto before = allocations;
  for (int i = 0; i < 100; ++i) pack_once();
  const auto counted = allocations - before;
  REQUIRE(ok);
  return counted;
}

std::size_t count_field(const Value& value, std::string_view field) {
  return count_while_packing(value, field_type("test.types.every", field));
}

}  // namespace

TEST_CASE("the counter counts") {
  const auto before = allocations;
  ::operator delete(::operator new(16));  // called by name: a compiler may leave out a new expression
  CHECK(allocations - before == 1);
}

TEST_CASE("a definition takes the same work however many are there") {
  TypeRegistry types;
  std::vector<std::size_t> counts;
  for (int i = 0; i < 200; ++i) {
    const auto text = "service demo.s" + std::to_string(100 + i) + "\nstruct A\n    field double x\nend\n";
    const auto before = allocations;
    REQUIRE(types.add({text}, RobdefMode::strict).has_value());
    counts.push_back(allocations - before);
  }
  CHECK(counts.back() <= counts.front() + 10);  // tables grow now and then
}

TEST_CASE("steady packing allocates nothing") {
  CHECK(count_field(1.5, "d") == 0);
  CHECK(count_field(std::int32_t{5}, "i16") == 0);
  CHECK(count_field("a text that is longer than a short string", "text") == 0);
  CHECK(count_field(std::vector<double>(10, 1.5), "ds") == 0);
  CHECK(count_field(std::vector<double>(100000, 1.5), "ds") == 0);
  CHECK(count_field(MultiDimArray{{2, 1}, Array::take(std::vector<double>{1, 2})}, "grid") == 0);
  CHECK(count_field(Structure{"test.types.point3", {{"z", 1.0}, {"y", 2.0}, {"x", 3.0}}}, "p3") == 0);
  CHECK(count_field(MapString{{{"a", {}}, {"b", {}}}}, "p3_by_name") == 0);
  CHECK(count_field(NamedArray{"", Array::take(std::vector<double>(30))}, "vs") == 0);
  const Structure point{"", {{"id", std::int16_t{1}}, {"value", 1.0f}}};
  CHECK(count_field(PodArray{"", std::vector<Structure>(50, point)}, "ps") == 0);
}
