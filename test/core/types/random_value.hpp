// Random values of declared types, for tests and for nothing else.
#pragma once

#include <random>

#include "core/types/pack.hpp"

namespace rr::test {

/// Makes values as unpack() would give them: dims match, maps are sorted, type names are set.
class RandomValue {
 public:
  RandomValue(const TypeRegistry& types, std::uint32_t seed) : types_(types), engine_(seed) {}

  Value make(const TypeDefinition& type, int depth = 0);
  std::uint32_t below(std::uint32_t limit) {
    return std::uniform_int_distribution<std::uint32_t>(0, limit - 1)(engine_);
  }

 private:
  Value make_item(const TypeDefinition& type, int depth);
  Value make_varvalue(int depth);
  Value make_named(const TypeDefinition& type, int depth);
  Structure make_fields(const EntityDefinition& entity, int depth);
  std::string make_text();
  Array make_array(DataType type, std::size_t count);
  std::vector<std::uint32_t> make_dims(const TypeDefinition& type);
  std::size_t make_count(const TypeDefinition& type);

  const TypeRegistry& types_;
  std::mt19937 engine_;
};

}  // namespace rr::test
