#include "server/mcp/value_hash.hpp"

#include <boost/container_hash/hash.hpp>
#include <string_view>

namespace rrgate {

namespace {

std::size_t hash_of_bytes(rr::ByteSpan bytes) {
  return std::hash<std::string_view>()({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// Adds what a value holds to `seed`.
struct Hasher {
  std::size_t& seed;

  void add(std::size_t hash) const { boost::hash_combine(seed, hash); }
  void add(const rr::Value& value) const {
    add(value.storage().index());
    std::visit(*this, value.storage());
  }
  void add(const std::vector<std::uint32_t>& dims) const { boost::hash_range(seed, dims.begin(), dims.end()); }

  void operator()(std::monostate) const {}
  void operator()(const rr::Scalar& scalar) const { add(hash_of_bytes(scalar.bytes())); }
  void operator()(const std::string& text) const { add(std::hash<std::string>()(text)); }
  void operator()(const rr::Array& array) const { add(hash_of_bytes(array.bytes())); }
  void operator()(const rr::MultiDimArray& array) const {
    add(array.dims);
    (*this)(array.array);
  }
  void operator()(const rr::NamedArray& array) const {
    add(array.dims);
    (*this)(array.array);
  }
  void operator()(const rr::Structure& structure) const {
    for (const auto& field : structure.fields) add(field.value);
  }
  void operator()(const rr::PodArray& pods) const {
    add(pods.dims);
    for (const auto& pod : pods.items) (*this)(pod);
  }
  void operator()(const rr::List& list) const {
    add(list.items.size());
    for (const auto& item : list.items) add(item);
  }
  void operator()(const rr::MapInt32& map) const { add_map(map.items); }
  void operator()(const rr::MapString& map) const { add_map(map.items); }

 private:
  template <class Items>
  void add_map(const Items& items) const {
    add(items.size());
    for (const auto& [key, item] : items) {
      boost::hash_combine(seed, key);
      add(item);
    }
  }
};

}  // namespace

std::size_t hash_of(const rr::Value& value) {
  std::size_t seed = 0;
  Hasher{seed}.add(value);
  return seed;
}

}  // namespace rrgate
