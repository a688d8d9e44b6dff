// Default values. Source: service definitions spec, section 5.4.
#include "core/types/multidim.hpp"
#include "core/types/pack.hpp"

namespace rr {

namespace {

/// Declared sizes of a peer's definition may ask for more than memory holds; their product is not limited anywhere.
constexpr std::uint64_t most_bytes = 12u * 1024 * 1024;

class Defaults {
 public:
  explicit Defaults(const TypeRegistry& types) : types_(types) {}

  Value make(const TypeDefinition& type) {
    auto value = make_value(type);
    return is_too_large_ ? Value() : value;
  }

 private:
  Value make_value(const TypeDefinition& type) {
    if (type.container == ContainerKind::list || type.container == ContainerKind::map_int32 ||
        type.container == ContainerKind::map_string)
      return {};
    if (type.type == DataType::string_t) return Value(std::string());
    if (type.type == DataType::enum_t) return Value(std::int32_t{0});
    if (type.type == DataType::pod_t || type.type == DataType::namedarray_t) return make_named(type);
    if (!is_numeric(type.type)) return {};
    if (type.array == ArrayKind::none) return Value(Scalar{type.type});
    auto array = zeros(type.type, count_of(type));
    if (is_multidim(type)) return Value(MultiDimArray{dims_of(type), std::move(array)});
    return Value(std::move(array));
  }

  Value make_named(const TypeDefinition& type) {
    const auto* entity = types_.find_entity(type.qualified_name);
    if (!entity) return {};
    const auto count = type.array == ArrayKind::none ? 1 : count_of(type);
    const auto shape = [&](auto named) {
      named.type_name = type.qualified_name;
      named.is_scalar = type.array == ArrayKind::none;
      named.is_multidim = is_multidim(type);
      if (named.is_multidim) named.dims = dims_of(type);
      return named;
    };
    if (entity->kind == EntityKind::namedarray) {
      auto named = shape(NamedArray{});
      named.array = zeros(entity->namedarray_type, count > most_bytes ? count : count * entity->namedarray_count);
      return Value(std::move(named));
    }
    auto pods = shape(PodArray{});
    if (!take(count, sizeof(Structure)) || count == 0) return Value(std::move(pods));
    const auto outer_copies = copies_;
    copies_ *= count;
    Structure pod;
    for (const auto& member : entity->members) {
      if (!take(1, sizeof(Field))) return {};
      pod.fields.push_back({member.name, make_value(member.type)});
    }
    copies_ = outer_copies;
    pods.items.assign(static_cast<std::size_t>(count), pod);
    return Value(std::move(pods));
  }

  static std::uint64_t count_of(const TypeDefinition& type) {
    if (type.array != ArrayKind::fixed && type.array != ArrayKind::fixed_multidim) return 0;
    return product_of(std::span<const std::int32_t>(type.sizes)).value_or(most_bytes + 1);
  }

  static std::vector<std::uint32_t> dims_of(const TypeDefinition& type) {
    if (type.array == ArrayKind::multidim) return {1, 0};
    return {type.sizes.begin(), type.sizes.end()};
  }

  Array zeros(DataType type, std::uint64_t count) {
    if (!take(count, item_size(type))) return Array::empty(type);
    return Array::copy(type, Bytes(static_cast<std::size_t>(count) * item_size(type)));
  }

  /// Nothing overflows: copies_ and count are at most most_bytes, sizes a few hundred.
  bool take(std::uint64_t count, std::uint64_t size) {
    is_too_large_ = is_too_large_ || count > most_bytes || copies_ * count * size > most_bytes - taken_;
    if (!is_too_large_) taken_ += copies_ * count * size;
    return !is_too_large_;
  }

  const TypeRegistry& types_;
  std::uint64_t taken_ = 0;
  std::uint64_t copies_ = 1;  ///< of the pod that is being made
  bool is_too_large_ = false;
};

}  // namespace

Value default_value(const TypeDefinition& type, const TypeRegistry& types) {
  return Defaults(types).make(type);
}

}  // namespace rr
