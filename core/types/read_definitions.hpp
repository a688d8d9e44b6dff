// Definitions that other sessions have read, for those that come later. Layer: types.
#pragma once

#include <string>
#include <vector>

#include "core/types/type_registry.hpp"

namespace rr {

/// For one thread. An interface, because the client for the web has one session, and no room for what it does not use.
class ReadDefinitions {
 public:
  virtual ~ReadDefinitions() = default;
  /// Whether a registry with exactly these texts was kept, in whatever order. Its definitions are shared with `types`,
  /// which is empty.
  virtual bool find(const std::vector<std::string>& texts, TypeRegistry& types) = 0;
  virtual void keep(const TypeRegistry& types) = 0;
};

}  // namespace rr
