#include "wasm-client/src/session_options.hpp"

#include "core/support/random.hpp"
#include "wasm-client/src/value_from_js.hpp"

namespace rr {

namespace {

class OptionReader {
 public:
  explicit OptionReader(const JsValue& js) : js_(js) {}

  /// Leaves `to` as it is where the option is not given.
  void read(std::string_view name, std::string& to) {
    const auto value = find(name, DataType::string_t);
    if (const auto* text = value.get_if<std::string>()) to = *text;
  }
  void read(std::string_view name, bool& to) {
    const auto value = find(name, DataType::bool_t);
    if (const auto flag = value.to<bool>(); !value.is_null() && flag.has_value()) to = *flag;
  }
  void read(std::string_view name, double& to) {
    const auto value = find(name, DataType::double_t);
    if (const auto number = value.to<double>(); !value.is_null() && number.has_value()) to = *number;
  }
  void read(std::string_view name, NodeId& to) {
    std::string text;
    read(name, text);
    if (text.empty()) return;
    if (const auto id = parse_node_id(text); id.has_value())
      to = *id;
    else
      refuse(name, id.error().message);
  }
  void read(std::string_view name, std::chrono::milliseconds& to) {
    auto number = static_cast<double>(to.count());
    read(name, number);
    constexpr double a_month = 31.0 * 24 * 3600 * 1000;  // "never" for a page; further would overflow somewhere
    if (number > 0)
      to = std::chrono::milliseconds(static_cast<std::int64_t>(number < a_month ? number : a_month));
    else
      refuse(name, "is not above 0");
  }
  void read(std::string_view name, Value& to) {
    TypeDefinition type;
    type.type = DataType::varvalue_t;
    type.container = ContainerKind::map_string;
    to = find(name, type);
  }
  void refuse(std::string_view name, std::string_view why) {
    if (!error_)
      error_ = make_error(ErrorCode::invalid_argument, "option '" + std::string(name) + "': " + std::string(why));
  }
  const std::optional<Error>& error() const { return error_; }

 private:
  Value find(std::string_view name, DataType data_type) {
    TypeDefinition type;
    type.type = data_type;
    return find(name, type);
  }
  Value find(std::string_view name, const TypeDefinition& type) {
    const auto field = js_.field(name);
    if (!field || field->is_nullish()) return {};
    auto value = from_js(*field, type, types_, FieldPath{nullptr, FieldPath::Step::field, 0, name, {}});
    if (value.has_value()) return std::move(*value);
    if (!error_) error_ = value.error();
    return {};
  }

  const JsValue& js_;
  TypeRegistry types_;
  std::optional<Error> error_;
};

/// As WasmSession::known_definitions() gave them.
std::vector<KnownDefinitions> read_known_definitions(const JsValue& js) {
  std::vector<KnownDefinitions> known(js.length().value_or(0));
  for (std::size_t i = 0; i < known.size(); ++i) {
    const auto each = js.at(i).value_or(JsValue::undefined());
    const auto text = [&](std::size_t at) {
      return each.at(at).value_or(JsValue::undefined()).text().value_or(std::string());
    };
    known[i].name = text(0);
    known[i].tag = text(1);
    for (std::size_t at = 2; at < each.length().value_or(0); ++at) known[i].texts.push_back(text(at));
  }
  return known;
}

}  // namespace

Result<ClientOptions> read_session_options(const JsValue& js) {
  ClientOptions options;
  OptionReader reader(js);
  auto& connection = options.connection;
  reader.read("service", options.service);
  reader.read("nodeId", connection.target.id);
  reader.read("nodeName", connection.target.name);
  connection.self.id = random_node_id();
  reader.read("selfName", connection.self.name);
  reader.read("username", options.username);
  reader.read("credentials", options.credentials);
  reader.read("objectType", options.object_type);
  reader.read("connectTimeout", options.connect_timeout);

  double version = 4;
  reader.read("version", version);
  if (version == 2)
    connection.features.v4 = false;
  else if (version != 4)
    reader.refuse("version", "is neither 2 nor 4");
  bool has_string_table = true;
  reader.read("stringTable", has_string_table);
  if (!has_string_table || version == 2) connection.features.string_table = {.local = false, .standard = false};

  auto limit = static_cast<double>(connection.max_message_size);
  reader.read("maxMessageSize", limit);
  constexpr double smallest = 64 * 1024;
  constexpr double largest = 512.0 * 1024 * 1024;  // the heap of a page ends at 2 GB
  if (limit >= smallest && limit <= largest)
    connection.max_message_size = static_cast<std::size_t>(limit);
  else
    reader.refuse("maxMessageSize", "is not between 65536 and 536870912 bytes");
  if (connection.max_queued_bytes < 2 * connection.max_message_size)
    connection.max_queued_bytes = 2 * connection.max_message_size;

  if (const auto known = js.field("known"); known && known->kind() == JsKind::array)
    options.known_definitions = read_known_definitions(*known);

  if (options.service.empty()) reader.refuse("service", "is missing");
  if (reader.error()) return *reader.error();
  return options;
}

}  // namespace rr
