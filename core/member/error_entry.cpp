#include "core/member/error_entry.hpp"

namespace rr {

void write_error(Message& message, const Error& error) {
  write_error(message, error, TypeRegistry{});
}

void write_error(Message& message, const Error& error, const TypeRegistry& types) {
  auto& entry = message.entries.back();
  // A reply says either its result or its error: elements that were added before the failure go.
  message.elements.resize(entry.first_element);
  entry.end_element = entry.first_element;
  entry.element_count = 0;
  entry.error = error.code == ErrorCode::none ? ErrorCode::internal_error : error.code;
  message.add_text("errorname", message.store(std::string_view(error.qualified_name())));
  message.add_text("errorstring", message.store(std::string_view(error.message)));
  if (!error.sub_name.empty()) message.add_text("errorsubname", message.store(std::string_view(error.sub_name)));
  if (error.param) {
    const auto elements = message.elements.size();
    const auto kept = message.entries.back();
    if (!pack_varvalue(message, "errorparam", *error.param, types)) {
      message.elements.resize(elements);
      message.entries.back() = kept;
    }
  }
}

Error read_error(const Message& message, const MessageEntry& entry, const TypeRegistry& types) {
  Error error{entry.error, {}};
  for (const auto& element : message.elements_of(entry)) {
    if (element.key_kind != KeyKind::name) continue;
    const bool is_text = element.type == DataType::string_t;
    if (element.name == "errorname" && is_text) error.name = element.text();
    if (element.name == "errorstring" && is_text) error.message = element.text();
    if (element.name == "errorsubname" && is_text) error.sub_name = element.text();
    if (element.name == "errorparam")
      if (auto param = unpack_varvalue(message, element, types))
        error.param = std::make_shared<const Value>(std::move(*param));
  }
  // Only these two codes leave the name to the sender; for all others the code decides.
  if (error.code != ErrorCode::remote_error && error.code != ErrorCode::unknown_error &&
      !error_code_name(error.code).empty())
    error.name.clear();
  return error;
}

}  // namespace rr
