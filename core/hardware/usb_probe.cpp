#include "core/hardware/usb_probe.hpp"

namespace rr {

namespace {

constexpr std::uint8_t standard_in = 0x80;
constexpr std::uint8_t get_descriptor = 0x06;
constexpr std::uint16_t bos_value = 0x0F00;
constexpr std::uint16_t string_value = 0x0300;
constexpr std::uint16_t english = 0x0409;
constexpr std::uint16_t string_length = 255;
constexpr std::uint16_t block_index = 0x0500;

constexpr const char* step_names[] = {"BOS descriptor",
                                      "BOS descriptor",
                                      "Robot Raconteur descriptor block",
                                      "Robot Raconteur descriptor block",
                                      "string languages",
                                      "NodeID string",
                                      "NodeName string"};

}  // namespace

UsbProbe::UsbProbe(std::optional<UsbFunction> function) {
  if (function) {
    info_.function = *function;
    ask_block(Step::block_header, usb_block_header_size);
  } else {
    ask_descriptor(Step::bos_header, bos_value, 0, usb_bos_header_size);
  }
}

void UsbProbe::ask_descriptor(Step step, std::uint16_t value, std::uint16_t index, std::uint16_t length) {
  step_ = step;
  next_ = {standard_in, get_descriptor, value, index, length};
}

void UsbProbe::ask_block(Step step, std::uint16_t length) {
  step_ = step;
  const auto index = static_cast<std::uint16_t>(block_index | info_.function.interface);
  next_ = {vendor_interface_in, info_.function.vendor_code, 0, index, length};
}

void UsbProbe::handle_control(UsbStatus status, ByteSpan data) {
  if (result_) return;
  const auto what = std::string("USB ") + step_names[static_cast<std::size_t>(step_)] + ": ";
  if (status != UsbStatus::ok) {
    result_ = make_error(ErrorCode::connection_error, what + usb_status_text(status));
  } else if (data.size() > next_.length) {
    result_ = protocol_error(what + std::to_string(data.size()) + " bytes, asked for " + std::to_string(next_.length));
  } else if (auto handled = handle_answer(data); !handled) {
    result_ = handled.error();
  }
}

Result<> UsbProbe::handle_answer(ByteSpan data) {
  switch (step_) {
    case Step::bos_header: {
      const auto total = parse_usb_bos_header(data);
      if (!total) return total.error();
      ask_descriptor(Step::bos, bos_value, 0, *total);
      return {};
    }
    case Step::bos: {
      const auto function = parse_usb_bos(data);
      if (!function) return function.error();
      info_.function = *function;
      ask_block(Step::block_header, usb_block_header_size);
      return {};
    }
    case Step::block_header: {
      const auto total = parse_usb_block_header(data);
      if (!total) return total.error();
      ask_block(Step::block, *total);
      return {};
    }
    case Step::block: {
      const auto strings = parse_usb_block(data);
      if (!strings) return strings.error();
      strings_ = *strings;
      ask_descriptor(Step::languages, string_value, english, string_length);
      return {};
    }
    case Step::languages: {
      const auto language = parse_usb_languages(data);
      if (!language) return language.error();
      language_ = *language;
      ask_descriptor(Step::node_id, string_value | strings_.node_id, language_, string_length);
      return {};
    }
    case Step::node_id: {
      const auto text = parse_usb_string(data);
      if (!text) return text.error();
      const auto id = parse_node_id(*text);
      if (!id) return protocol_error("USB NodeID string: " + id.error().message);
      info_.id = *id;
      ask_descriptor(Step::node_name, string_value | strings_.node_name, language_, string_length);
      return {};
    }
    case Step::node_name:
      break;
  }
  const auto name = parse_usb_string(data);
  if (!name) return name.error();
  if (!name->empty() && !is_valid_node_name(*name))
    return protocol_error("USB NodeName string: " + quote(*name) + " is not a node name");
  info_.name = *name;
  result_ = info_;
  return {};
}

}  // namespace rr
