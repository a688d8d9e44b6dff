#include "test/interop/cpp/plain_value.hpp"

#include <algorithm>
#include <cmath>

namespace {

using nlohmann::json;

constexpr std::int64_t exact = std::int64_t{1} << 53;

template <class T>
json plain_number(T number) {
  if constexpr (std::is_same_v<T, bool>) {
    return number;
  } else if constexpr (std::is_integral_v<T>) {
    if constexpr (sizeof(T) == 8) {
      if (number > static_cast<T>(exact)) return std::to_string(number);
      if constexpr (std::is_signed_v<T>)
        if (number < -exact) return std::to_string(number);
    }
    return number;
  } else if constexpr (std::is_floating_point_v<T>) {
    if (std::isnan(number)) return "NaN";
    if (std::isinf(number)) return number > 0 ? "Infinity" : "-Infinity";
    return static_cast<double>(number);
  } else {
    return json::array({plain_number(number.real()), plain_number(number.imag())});
  }
}

template <class T>
json plain_items(rr::ByteSpan bytes) {
  json items = json::array();
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(T)) items.push_back(plain_number(rr::load<T>(&bytes[at])));
  return items;
}

json plain_items(rr::DataType type, rr::ByteSpan bytes) {
  using rr::DataType;
  switch (type) {
    case DataType::double_t:
      return plain_items<double>(bytes);
    case DataType::single_t:
      return plain_items<float>(bytes);
    case DataType::int8_t:
      return plain_items<std::int8_t>(bytes);
    case DataType::uint8_t:
      return plain_items<std::uint8_t>(bytes);
    case DataType::int16_t:
      return plain_items<std::int16_t>(bytes);
    case DataType::uint16_t:
      return plain_items<std::uint16_t>(bytes);
    case DataType::int32_t:
      return plain_items<std::int32_t>(bytes);
    case DataType::uint32_t:
      return plain_items<std::uint32_t>(bytes);
    case DataType::int64_t:
      return plain_items<std::int64_t>(bytes);
    case DataType::uint64_t:
      return plain_items<std::uint64_t>(bytes);
    case DataType::cdouble_t:
      return plain_items<rr::CDouble>(bytes);
    case DataType::csingle_t:
      return plain_items<rr::CSingle>(bytes);
    case DataType::bool_t:
      return plain_items<bool>(bytes);
    default:
      return json::array();
  }
}

json shaped(const std::vector<std::uint32_t>& dims, json data) {
  return {{"dims", dims}, {"data", std::move(data)}};
}

json plain(std::monostate) {
  return nullptr;
}
json plain(const rr::Scalar& scalar) {
  return plain_items(scalar.type, scalar.bytes()).front();
}
json plain(const std::string& text) {
  return text;
}
json plain(const rr::Array& array) {
  return plain_items(array.type(), array.bytes());
}
json plain(const rr::MultiDimArray& grid) {
  return shaped(grid.dims, plain(grid.array));
}

json plain(const rr::Structure& structure) {
  json fields = json::object();
  for (const auto& field : structure.fields) fields[field.name] = to_plain(field.value);
  return fields;
}

json plain(const rr::PodArray& pods) {
  json items = json::array();
  for (const auto& pod : pods.items) items.push_back(plain(pod));
  return pods.is_multidim ? shaped(pods.dims, std::move(items)) : items;
}

json plain(const rr::NamedArray& named) {
  json numbers = plain(named.array);
  return named.is_multidim ? shaped(named.dims, std::move(numbers)) : numbers;
}

json plain(const rr::List& list) {
  json items = json::array();
  for (const auto& item : list.items) items.push_back(to_plain(item));
  return {{"list", std::move(items)}};
}

template <class Map>
json plain_map(const Map& map) {
  auto items = map.items;
  std::sort(items.begin(), items.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  json pairs = json::array();
  for (const auto& [key, value] : items) pairs.push_back(json::array({key, to_plain(value)}));
  return {{"map", std::move(pairs)}};
}
json plain(const rr::MapInt32& map) {
  return plain_map(map);
}
json plain(const rr::MapString& map) {
  return plain_map(map);
}

}  // namespace

json to_plain(const rr::Value& value) {
  return std::visit([](const auto& held) { return plain(held); }, value.storage());
}

json to_digest(const rr::Value& value) {
  const json plain = to_plain(value);
  const json& items = plain.is_object() ? plain.at("data") : plain;
  double sum = 0;
  for (const auto& item : items) sum += item.get<double>();
  return {{"count", items.size()}, {"first", items.front()}, {"last", items.back()}, {"sum", sum}};
}
