// Values as JSON: the shared cases of the mapping, each with its wire element on the other side.
#include <catch2/catch.hpp>
#include <cstring>

#include "core/types/pack.hpp"
#include "core/types/type_text.hpp"
#include "server/json/value_from_json.hpp"
#include "test/core/types/show_result.hpp"
#include "test/support/golden.hpp"

using namespace rr;
using namespace rr::test;
using Case = nlohmann::ordered_json;

namespace {

template <class T>
void append(Bytes& out, T value) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}

double real_of(const Case& json) {
  if (!json.is_string()) return json.get<double>();
  const auto word = json.get<std::string>();
  return word == "NaN" ? std::numeric_limits<double>::quiet_NaN()
                       : (word == "Infinity" ? 1 : -1) * std::numeric_limits<double>::infinity();
}

void append_item(Bytes& out, const std::string& type, const Case& json) {
  const auto integer = [&] { return json.is_string() ? std::stoll(json.get<std::string>()) : json.get<long long>(); };
  if (type == "double") return append(out, real_of(json));
  if (type == "single") return append(out, static_cast<float>(real_of(json)));
  if (type == "cdouble") return append(out, real_of(json[0])), append(out, real_of(json[1]));
  if (type == "csingle")
    return append(out, static_cast<float>(real_of(json[0]))), append(out, static_cast<float>(real_of(json[1])));
  if (type == "bool") return append(out, json.get<bool>());
  if (type == "uint64")
    return append<std::uint64_t>(out,
                                 json.is_string() ? std::stoull(json.get<std::string>()) : json.get<std::uint64_t>());
  if (type == "int64") return append<std::int64_t>(out, integer());
  if (type == "int32") return append(out, static_cast<std::int32_t>(integer()));
  if (type == "uint32") return append(out, static_cast<std::uint32_t>(integer()));
  if (type == "int16") return append(out, static_cast<std::int16_t>(integer()));
  if (type == "uint16") return append(out, static_cast<std::uint16_t>(integer()));
  if (type == "int8") return append(out, static_cast<std::int8_t>(integer()));
  if (type == "uint8") return append(out, static_cast<std::uint8_t>(integer()));
  throw std::runtime_error("json-cases: no number type " + type);
}

/// The words of the cases for element types.
DataType element_type(const std::string& word) {
  for (std::uint16_t code = 0; code < 130; ++code)
    if (const auto type = static_cast<DataType>(code); data_type_name(type) == word) return type;
  throw std::runtime_error("json-cases: no element type " + word);
}

/// Adds an element as a case tells it.
void add_element(Message& message, const Case& json, std::string_view name) {
  const auto word = json.at("type").get<std::string>();
  const auto type = element_type(word);
  const bool is_numbered = json.contains("number");
  const auto number = is_numbered ? json["number"].get<std::int32_t>() : 0;
  const auto kept_name = message.store(json.contains("name") ? json["name"].get<std::string>() : std::string(name));
  if (is_nested(type)) {
    const auto type_name = message.store(json.value("type_name", std::string()));
    if (is_numbered)
      message.begin_nested_numbered(number, type, type_name);
    else
      message.begin_nested(kept_name, type, type_name);
    for (const auto& child : json["elements"]) add_element(message, child, "");
    message.end_nested();
    return;
  }
  Bytes bytes;
  if (word == "string") {
    const auto text = json["value"].get<std::string>();
    bytes.assign(text.begin(), text.end());
  } else if (word != "void") {
    for (const auto& item : json["value"]) append_item(bytes, word, item);
  }
  const auto data = message.store(ByteSpan(bytes));
  const auto count = static_cast<std::uint32_t>(bytes.size() / std::max<std::size_t>(1, item_size(type)));
  if (is_numbered)
    message.add_numbered(number, type, count, data);
  else
    message.add(kept_name, type, count, data);
}

/// An element and all below it as text, NaNs in their one form.
std::string describe(const Message& message, const MessageElement& element) {
  std::string out =
      std::string(element.key_kind == KeyKind::number ? std::to_string(element.number) : std::string(element.name)) +
      ":" + std::string(data_type_name(element.type)) + ":" + std::string(element.type_name) + ":" +
      std::to_string(element.count);
  out += is_nested(element.type) ? "(" : "=" + to_hex(element.data);
  std::vector<std::string> children;
  for (const auto& child : message.children_of(element)) children.push_back(describe(message, child) + " ");
  if (element.type == DataType::map_string_t) std::sort(children.begin(), children.end());  // any order is the same map
  for (const auto& child : children) out += child;
  return out + (is_nested(element.type) ? ")" : "");
}

struct Mapping {
  TypeRegistry types;
  TypeDefinition type;

  explicit Mapping(const Case& json) {
    std::string service;
    if (!json["definition"].is_null()) {
      const auto text = json["definition"].get<std::string>();
      const auto added = types.add({text}, RobdefMode::strict);
      if (!added) throw std::runtime_error(added.error().message);
      service = types.definitions().back()->name;
    }
    auto text = json["type"].get<std::string>();
    if (text == "varvalue") {
      type.type = DataType::varvalue_t;
      return;
    }
    auto found = parse_type_text(text, types);
    if (!found && !service.empty()) found = parse_type_text(service + "." + text, types);
    if (!found) throw std::runtime_error(found.error().message);
    type = *found;
  }
};

std::string show(const Error& error) {
  return error.message;
}

}  // namespace

TEST_CASE("json: every shared case") {
  const auto cases = Case::parse(read_golden("types/json-cases.json"));
  REQUIRE(cases.size() == 183);
  std::size_t values = 0;
  for (const auto& each : cases) {
    const auto name = each["name"].get<std::string>();
    const auto type_text = each["type"].get<std::string>();
    if (type_text.front() == '(') continue;  // results, exceptions, references: below, and where they are written
    ++values;
    INFO(name << ": " << each["reason"].get<std::string>());
    const Mapping mapping(each);
    JsonForm form;
    if (each.contains("options")) {
      form.packs_arrays = each["options"].value("arrays", "") == "packed";
      form.numbers_enums = each["options"].value("enums", "") == "number";
      form.ignores_unknown = each["options"].value("unknown", "") == "ignore";
    }
    const auto direction = each["direction"].get<std::string>();
    std::string text;
    if (each.contains("json_text"))
      text = each["json_text"].get<std::string>();
    else
      text = each["json"].dump();

    const auto json = read_json(text);
    const auto value = json ? value_from_json(*json, mapping.type, mapping.types, form) : Result<Value>(json.error());
    if (direction == "reject") {
      CHECK_FALSE(value);
      continue;
    }
    Message expected;
    expected.begin_entry(EntryType::property_get_res, "s", "m");
    add_element(expected, each["rr_value"], "value");
    if (direction != "encode") {
      CHECK((value ? "" : show(value.error())) == "");
      if (!value) continue;
      Message packed;
      packed.begin_entry(EntryType::property_get_res, "s", "m");
      const auto done = pack(packed, "value", *value, mapping.type, mapping.types);
      CHECK((done ? "" : show(done.error())) == "");
      if (done) CHECK(describe(packed, packed.elements[0]) == describe(expected, expected.elements[0]));
    }
    if (direction != "decode") {
      const auto received = unpack(expected, expected.elements[0], mapping.type, mapping.types);
      REQUIRE((received ? "" : show(received.error())) == "");
      const auto written = value_to_json(*received, mapping.type, mapping.types, form);
      REQUIRE((written ? "" : show(written.error())) == "");
      // As values, keys in any order; the sign of zero shows in the text.
      const auto plain = [](const std::string& of) { return nlohmann::json::parse(of); };
      CHECK(plain(write_json(*written)) == plain(text));
      if (text.find("-0.0") != std::string::npos) CHECK(write_json(*written).find("-0.0") != std::string::npos);
    }
  }
  CHECK(values == 179);
}

TEST_CASE("json: CBOR carries the same values, number arrays as typed arrays") {
  const auto cases = Case::parse(read_golden("types/json-cases.json"));
  JsonForm form;
  form.has_bytes = true;
  std::size_t seen = 0;
  for (const auto& each : cases) {
    if (each["direction"] != "both" || each.contains("options") || each["type"].get<std::string>().front() == '(')
      continue;
    INFO(each["name"].get<std::string>());
    const Mapping mapping(each);
    Message message;
    message.begin_entry(EntryType::property_get_res, "s", "m");
    add_element(message, each["rr_value"], "value");
    const auto value = unpack(message, message.elements[0], mapping.type, mapping.types);
    REQUIRE(value);
    const auto written = value_to_json(*value, mapping.type, mapping.types, form);
    REQUIRE(written);
    const auto read = read_cbor(write_cbor(*written));
    REQUIRE((read ? "" : show(read.error())) == "");
    const auto back = value_from_json(*read, mapping.type, mapping.types, form);
    REQUIRE((back ? "" : show(back.error())) == "");
    Message packed;
    packed.begin_entry(EntryType::property_get_res, "s", "m");
    REQUIRE(pack(packed, "value", *back, mapping.type, mapping.types));
    CHECK(describe(packed, packed.elements[0]) == describe(message, message.elements[0]));
    ++seen;
  }
  CHECK(seen > 50);
  TypeDefinition doubles;
  doubles.type = DataType::double_t;
  doubles.array = ArrayKind::variable;
  const auto written = value_to_json(Value(std::vector<double>{1.5}), doubles, {}, form);
  REQUIRE(written);
  CHECK(to_hex(write_cbor(*written)) == "d85648000000000000f83f");
}

TEST_CASE("json: errors say where") {
  const auto text_of = [](const std::string& text) {
    const auto json = read_json(text);
    return json ? std::string() : json.error().message;
  };
  CHECK(text_of("{\"a\": 1, \"a\": 2}") == "JSON has the key 'a' twice (byte 11)");
  CHECK(text_of("[1, 2").find("JSON is malformed at byte 5") == 0);
  CHECK(text_of("[1] 2").find("JSON is malformed at byte 4") == 0);
  CHECK(text_of(std::string(65, '[') + std::string(65, ']')).find("deep") != std::string::npos);
  CHECK(text_of("") != "");
  CHECK(text_of("1e-400") == "");

  TypeRegistry types;
  REQUIRE(types.add({"service com.x\nstruct Pose\nfield double[4]{list} qs\nend\n"}, RobdefMode::strict));
  const auto pose = parse_type_text("com.x.Pose", types);
  const auto value = value_from_json(*read_json("{\"qs\": [[1,2,3,4],[1,2,3]]}"), *pose, types, {}, "target");
  REQUIRE_FALSE(value);
  CHECK(value.error().message == "read 'target.qs[1]' (com.x.Pose): has 3, expected 4 (double[4])");
}

TEST_CASE("json: exceptions") {
  auto param = std::make_shared<Value>(std::vector<std::int32_t>{4});
  const Error error{ErrorCode::remote_error, "stuck", "demo.j.Jam", "axis", param};
  CHECK(write_json(error_to_json(error, {})) ==
        R"({"error":{"name":"demo.j.Jam","message":"stuck","subname":"axis","param":{"type":"int32[]","value":[4]}}})");
  CHECK(write_json(error_to_json({ErrorCode::value_not_set, "no \xff"}, {})) ==
        "{\"error\":{\"name\":\"RobotRaconteur.ValueNotSet\",\"message\":\"no \xef\xbf\xbd\"}}");
}

TEST_CASE("what is no UTF-8 is replaced where a document is written") {
  const rr::OrderedJson json{{"name", "F\xfchrung"}};
  CHECK(rr::write_json(json) == "{\"name\":\"F\xef\xbf\xbdhrung\"}");
}
