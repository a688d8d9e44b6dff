// A generator that runs at a service, for the client that waits. Layer: node/client.
//
//   for (const rr::Value& point : scanner.generator("Scan", 360)) plot(point);
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <optional>
#include <string>

#include "core/types/value.hpp"

namespace rr {

class BlockingConnection;

/// One generator: a handle that can be copied, all copies are the same generator. What is not read to its end should be
/// closed: the service keeps it for ten minutes otherwise. Everything throws ClientException.
class RemoteGenerator {
 public:
  RemoteGenerator(std::shared_ptr<BlockingConnection> connection, std::string path, std::string function,
                  std::int32_t index);

  /// The next value, null where the generator returns none; std::nullopt after the last, and ever after.
  std::optional<Value> next() { return step(std::nullopt); }
  /// For generators that take a value with each step.
  std::optional<Value> next(const Value& parameter) { return step(parameter); }
  /// Ends it in order; nothing happens where it has ended.
  void close();
  /// Tells the service to stop what the generator does.
  void abort();

  /// For range-for, once.
  class iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Value;
    using difference_type = std::ptrdiff_t;
    using pointer = const Value*;
    using reference = const Value&;
    explicit iterator(RemoteGenerator* generator) : generator_(generator) { ++*this; }
    iterator() = default;
    reference operator*() const { return *value_; }
    pointer operator->() const { return &*value_; }
    iterator& operator++() {
      value_ = generator_->next();
      return *this;
    }
    void operator++(int) { ++*this; }
    bool operator==(std::default_sentinel_t) const { return !value_; }

   private:
    RemoteGenerator* generator_ = nullptr;
    std::optional<Value> value_;
  };
  iterator begin() { return iterator(this); }
  std::default_sentinel_t end() const { return {}; }

 private:
  struct State {
    std::shared_ptr<BlockingConnection> connection;
    std::string path;
    std::string function;
    std::int32_t index = 0;
    bool has_ended = false;
  };

  std::optional<Value> step(const std::optional<Value>& parameter);

  std::shared_ptr<State> state_;
};

}  // namespace rr
