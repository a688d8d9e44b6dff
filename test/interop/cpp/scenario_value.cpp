#include "test/interop/cpp/scenario_value.hpp"

#include <stdexcept>

namespace {

using nlohmann::json;

const std::string type_prefix = "experimental.interop.";

template <class T>
T to_number(const json& value) {
  if constexpr (std::is_same_v<T, rr::CDouble> || std::is_same_v<T, rr::CSingle>) {
    return T(value.at(0).get<typename T::value_type>(), value.at(1).get<typename T::value_type>());
  } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    // Beyond 2^53 as decimal text.
    if (!value.is_string()) return value.get<T>();
    if constexpr (std::is_signed_v<T>)
      return static_cast<T>(std::stoll(value.get<std::string>()));
    else
      return static_cast<T>(std::stoull(value.get<std::string>()));
  } else {
    return value.get<T>();
  }
}

template <class T>
rr::Array to_array(const json& items) {
  std::unique_ptr<T[]> numbers(new T[items.size() + 1]);  // not a vector: of bool it would be no array
  std::size_t count = 0;
  for (const auto& item : items) numbers[count++] = to_number<T>(item);
  return rr::Array::copy(std::span<const T>(numbers.get(), count));
}

std::vector<std::uint32_t> dims_of(const json& shaped) {
  return shaped.at("dims").get<std::vector<std::uint32_t>>();
}

/// `rest` is what follows the type's word: "", "[]" or "[*]".
template <class T>
rr::Value to_numbers(const std::string& rest, const json& body) {
  if (rest.empty()) return to_number<T>(body);
  if (rest == "[]") return to_array<T>(body);
  return rr::MultiDimArray{dims_of(body), to_array<T>(body.at("data"))};
}

rr::Structure to_structure(const std::string& name, const json& fields) {
  rr::Structure structure{type_prefix + name, {}};
  for (const auto& [field, value] : fields.items()) structure.fields.push_back({field, from_scenario(value)});
  return structure;
}

rr::Value to_pods(const std::string& name, const std::string& rest, const json& body) {
  rr::PodArray pods;
  pods.type_name = type_prefix + name;
  pods.is_scalar = rest.empty();
  pods.is_multidim = rest == "[*]";
  if (pods.is_multidim) pods.dims = dims_of(body);
  if (pods.is_scalar)
    pods.items.push_back(to_structure(name, body));
  else
    for (const auto& item : pods.is_multidim ? body.at("data") : body) pods.items.push_back(to_structure(name, item));
  return pods;
}

rr::Value to_named_array(const std::string& name, const std::string& rest, const json& body) {
  rr::NamedArray named;
  named.type_name = type_prefix + name;
  named.is_scalar = rest.empty();
  named.is_multidim = rest == "[*]";
  if (named.is_multidim) named.dims = dims_of(body);
  named.array = to_array<double>(named.is_multidim ? body.at("data") : body);
  return named;
}

template <class Map>
rr::Value to_map(const json& pairs) {
  Map map;
  for (const auto& pair : pairs)
    map.items.emplace_back(pair.at(0).get<typename decltype(map.items)::value_type::first_type>(),
                           from_scenario(pair.at(1)));
  return map;
}

rr::Value to_ramp(std::size_t count) {
  std::vector<double> items(count);
  for (std::size_t i = 0; i < count; ++i) items[i] = static_cast<double>(i);
  return items;
}

}  // namespace

rr::Value from_scenario(const json& tagged) {
  if (tagged.is_null()) return {};
  if (tagged.is_string()) return tagged.get<std::string>();
  const std::string tag = tagged.items().begin().key();
  const json& body = tagged.items().begin().value();
  const std::string base = tag.substr(0, tag.find('['));
  const std::string rest = tag.substr(base.size());
  if (tag == "ramp") return to_ramp(body.get<std::size_t>());
  if (tag == "varvalue") return from_scenario(body);
  if (tag == "Color") return body.get<std::int32_t>();
  if (tag == "map{int32}") return to_map<rr::MapInt32>(body);
  if (tag == "map{string}") return to_map<rr::MapString>(body);
  if (tag == "list") {
    rr::List list;
    for (const auto& item : body) list.items.push_back(from_scenario(item));
    return list;
  }
  if (base == "double") return to_numbers<double>(rest, body);
  if (base == "single") return to_numbers<float>(rest, body);
  if (base == "int8") return to_numbers<std::int8_t>(rest, body);
  if (base == "uint8") return to_numbers<std::uint8_t>(rest, body);
  if (base == "int16") return to_numbers<std::int16_t>(rest, body);
  if (base == "uint16") return to_numbers<std::uint16_t>(rest, body);
  if (base == "int32") return to_numbers<std::int32_t>(rest, body);
  if (base == "uint32") return to_numbers<std::uint32_t>(rest, body);
  if (base == "int64") return to_numbers<std::int64_t>(rest, body);
  if (base == "uint64") return to_numbers<std::uint64_t>(rest, body);
  if (base == "cdouble") return to_numbers<rr::CDouble>(rest, body);
  if (base == "csingle") return to_numbers<rr::CSingle>(rest, body);
  if (base == "bool") return to_numbers<bool>(rest, body);
  if (base == "Sample") return to_pods(base, rest, body);
  if (base == "Vector3" || base == "Quaternion" || base == "Transform") return to_named_array(base, rest, body);
  if (base == "Pose" || base == "Everything") return to_structure(base, body);
  throw std::invalid_argument("a scenario sends the unknown type '" + tag + "'");
}
