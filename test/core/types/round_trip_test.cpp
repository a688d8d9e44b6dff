// Random values of random types come back from the wire as they were, in both message versions.
#include <catch2/catch.hpp>

#include "test/core/types/fixture.hpp"
#include "test/core/types/random_value.hpp"
#include "test/core/types/show_result.hpp"

using namespace rr;
using namespace rr::test;

namespace {

void check_round_trip(const Value& value, const TypeDefinition& type) {
  for (const std::uint16_t version : {std::uint16_t{2}, std::uint16_t{4}}) {
    INFO("version " << version);
    const auto read = round_trip(value, type, version);
    REQUIRE((read ? "" : read.error().message) == "");
    REQUIRE(*read == value);
  }
}

/// A random declared type: a field of the test definitions, with a container of its own where it has none.
TypeDefinition random_type(RandomValue& random) {
  static const auto types = [] {
    std::vector<TypeDefinition> list;
    for (const auto& definition : test_types().definitions())
      for (const auto& entity : definition->entities)
        if (entity.kind == EntityKind::structure)
          for (const auto& member : entity.members) list.push_back(member.type);
    return list;
  }();
  auto type = types[random.below(static_cast<std::uint32_t>(types.size()))];
  constexpr ContainerKind containers[] = {ContainerKind::none, ContainerKind::list, ContainerKind::map_int32,
                                          ContainerKind::map_string};
  if (type.container == ContainerKind::none) type.container = containers[random.below(4)];
  return type;
}

}  // namespace

TEST_CASE("random values of every declared type round-trip") {
  for (std::uint32_t seed = 0; seed < 3000; ++seed) {
    RandomValue random(test_types(), seed);
    const auto type = random_type(random);
    INFO("seed " << seed << " type " << format_type(type));
    check_round_trip(random.make(type), type);
  }
}

TEST_CASE("random structures that hold a field of every type round-trip") {
  const auto every = named_type("test.types.every");
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    INFO("seed " << seed);
    check_round_trip(RandomValue(test_types(), seed).make(every), every);
  }
}

TEST_CASE("a declared value read as varvalue packs to the same bytes") {
  const auto any = type_of(DataType::varvalue_t);
  for (std::uint32_t seed = 0; seed < 1000; ++seed) {
    RandomValue random(test_types(), seed);
    const auto type = random_type(random);
    INFO("seed " << seed << " type " << format_type(type));
    const auto bytes = pack_message(random.make(type), type, 4);
    REQUIRE(bytes);
    const auto value = unpack_message(*bytes, any);
    REQUIRE((value ? "" : value.error().message) == "");
    const auto again = pack_message(*value, any, 4);
    REQUIRE((again ? "" : again.error().message) == "");
    REQUIRE(*again == *bytes);
  }
}
