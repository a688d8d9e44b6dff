// A memory of a service, for the client that waits. Layer: node/client.
//
//   auto samples = device.memory("samples");
//   const rr::Value first = samples.read({0}, {100});
#pragma once

#include <memory>
#include <string>

#include "core/member/memory.hpp"

namespace rr {

class BlockingConnection;

/// A handle that is cheap to copy. Everything throws ClientException. Large transfers are split into requests.
class RemoteMemory {
 public:
  RemoteMemory(std::shared_ptr<BlockingConnection> connection, std::string path, std::string name)
      : connection_(std::move(connection)), path_(std::move(path)), name_(std::move(name)) {}

  /// One number a dimension; the length of a plain array.
  MemoryShape dimensions() const;
  /// `count` items a dimension from `position` on: Array, MultiDimArray, PodArray or NamedArray.
  Value read(const MemoryShape& position, const MemoryShape& count) const;
  /// All of it.
  Value read() const;
  /// Writes all of `value` from `position` on.
  void write(const MemoryShape& position, const Value& value) const;

 private:
  std::shared_ptr<BlockingConnection> connection_;
  std::string path_;
  std::string name_;
};

}  // namespace rr
