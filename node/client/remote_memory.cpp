#include "node/client/remote_memory.hpp"

#include "node/client/client.hpp"

namespace rr {

MemoryShape RemoteMemory::dimensions() const {
  const Value dimensions = connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.get_memory_dimensions(path_, name_, std::move(done));
  });
  const auto items = dimensions.to_items<std::uint64_t>().value();
  return {items.begin(), items.end()};
}

Value RemoteMemory::read(const MemoryShape& position, const MemoryShape& count) const {
  return connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.read_memory(path_, name_, {position, count}, std::move(done));
  });
}

Value RemoteMemory::read() const {
  const MemoryShape all = dimensions();
  return read(MemoryShape(all.size(), 0), all);
}

void RemoteMemory::write(const MemoryShape& position, const Value& value) const {
  connection_->wait_for([&](ClientConnection& connection, auto done) {
    connection.write_memory(path_, name_, position, value, std::move(done));
  });
}

}  // namespace rr
