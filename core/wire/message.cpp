#include "core/wire/message.hpp"

#include <algorithm>

namespace rr {

namespace {
constexpr std::size_t block_size = 4096;
}  // namespace

MessageEntry& Message::begin_entry(EntryType type, std::string_view service_path, std::string_view member_name,
                                   std::uint32_t request_id) {
  open_.clear();
  auto& entry = entries.emplace_back();
  entry.type = type;
  entry.service_path = service_path;
  entry.member_name = member_name;
  entry.request_id = request_id;
  entry.first_element = entry.end_element = static_cast<std::uint32_t>(elements.size());
  return entry;
}

MessageElement& Message::append(const MessageElement& element) {
  if (open_.empty())
    ++entries.back().element_count;
  else
    ++elements[open_.back()].count;
  elements.push_back(element);
  const auto end = static_cast<std::uint32_t>(elements.size());
  elements.back().end = end;
  for (const auto index : open_) elements[index].end = end;
  entries.back().end_element = end;
  return elements.back();
}

MessageElement& Message::add(std::string_view name, DataType type, std::uint32_t count, ByteSpan data) {
  MessageElement element;
  element.name = name;
  element.type = type;
  element.count = count;
  element.data = data;
  return append(element);
}

MessageElement& Message::add_numbered(std::int32_t number, DataType type, std::uint32_t count, ByteSpan data) {
  MessageElement element;
  element.key_kind = KeyKind::number;
  element.number = number;
  element.type = type;
  element.count = count;
  element.data = data;
  return append(element);
}

MessageElement& Message::add_text(std::string_view name, std::string_view text) {
  return add(name, DataType::string_t, static_cast<std::uint32_t>(text.size()), as_bytes(text));
}

MessageElement& Message::begin_nested(std::string_view name, DataType type, std::string_view type_name) {
  MessageElement element;
  element.name = name;
  element.type = type;
  element.type_name = type_name;
  auto& added = append(element);
  open_.push_back(static_cast<std::uint32_t>(elements.size() - 1));
  return added;
}

MessageElement& Message::begin_nested_numbered(std::int32_t number, DataType type, std::string_view type_name) {
  MessageElement element;
  element.key_kind = KeyKind::number;
  element.number = number;
  element.type = type;
  element.type_name = type_name;
  auto& added = append(element);
  open_.push_back(static_cast<std::uint32_t>(elements.size() - 1));
  return added;
}

void Message::end_nested() {
  open_.pop_back();
}

ByteSpan Message::store(ByteSpan bytes) {
  if (bytes.empty()) return {};
  std::uint8_t* to = nullptr;
  if (bytes.size() > block_size / 4) {
    // An owner, not a block: an encoded message that references the bytes keeps them after clear().
    std::shared_ptr<std::uint8_t> large(new std::uint8_t[bytes.size()], std::default_delete<std::uint8_t[]>());
    to = large.get();
    owners_.push_back(std::move(large));
  } else {
    if (block_index_ < blocks_.size() && block_used_ + bytes.size() > block_size) {
      ++block_index_;
      block_used_ = 0;
    }
    if (block_index_ == blocks_.size()) blocks_.emplace_back(new std::uint8_t[block_size]);
    to = blocks_[block_index_].get() + block_used_;
    block_used_ += bytes.size();
  }
  std::copy(bytes.begin(), bytes.end(), to);
  return {to, bytes.size()};
}

void Message::clear() {
  header = {};
  clear_kept(entries);
  clear_kept(elements);
  clear_kept(open_);
  if (blocks_.size() > max_kept_bytes / block_size) blocks_.resize(max_kept_bytes / block_size);
  block_index_ = 0;
  block_used_ = 0;
  clear_kept(owners_);
}

std::string_view data_type_name(DataType type) {
  switch (type) {
    case DataType::void_t:
      return "void";
    case DataType::double_t:
      return "double";
    case DataType::single_t:
      return "single";
    case DataType::int8_t:
      return "int8";
    case DataType::uint8_t:
      return "uint8";
    case DataType::int16_t:
      return "int16";
    case DataType::uint16_t:
      return "uint16";
    case DataType::int32_t:
      return "int32";
    case DataType::uint32_t:
      return "uint32";
    case DataType::int64_t:
      return "int64";
    case DataType::uint64_t:
      return "uint64";
    case DataType::string_t:
      return "string";
    case DataType::cdouble_t:
      return "cdouble";
    case DataType::csingle_t:
      return "csingle";
    case DataType::bool_t:
      return "bool";
    case DataType::structure_t:
      return "structure";
    case DataType::map_int32_t:
      return "vector";
    case DataType::map_string_t:
      return "dictionary";
    case DataType::object_t:
      return "object";
    case DataType::varvalue_t:
      return "varvalue";
    case DataType::varobject_t:
      return "varobject";
    case DataType::list_t:
      return "list";
    case DataType::pod_t:
      return "pod";
    case DataType::pod_array_t:
      return "pod_array";
    case DataType::pod_multidimarray_t:
      return "pod_multidimarray";
    case DataType::enum_t:
      return "enum";
    case DataType::namedtype_t:
      return "namedtype";
    case DataType::namedarray_t:
      return "namedarray";
    case DataType::namedarray_array_t:
      return "namedarray_array";
    case DataType::namedarray_multidimarray_t:
      return "namedarray_multidimarray";
    case DataType::multidimarray_t:
      return "multidimarray";
  }
  return "unknown";
}

std::string_view entry_type_name(EntryType type) {
  switch (type) {
    case EntryType::null:
      return "Null";
    case EntryType::stream_op:
      return "StreamOp";
    case EntryType::stream_op_ret:
      return "StreamOpRet";
    case EntryType::stream_check_capability:
      return "StreamCheckCapability";
    case EntryType::stream_check_capability_ret:
      return "StreamCheckCapabilityRet";
    case EntryType::get_service_desc:
      return "GetServiceDesc";
    case EntryType::get_service_desc_ret:
      return "GetServiceDescRet";
    case EntryType::object_type_name:
      return "ObjectTypeName";
    case EntryType::object_type_name_ret:
      return "ObjectTypeNameRet";
    case EntryType::service_closed:
      return "ServiceClosed";
    case EntryType::service_closed_ret:
      return "ServiceClosedRet";
    case EntryType::connect_client:
      return "ConnectClient";
    case EntryType::connect_client_ret:
      return "ConnectClientRet";
    case EntryType::disconnect_client:
      return "DisconnectClient";
    case EntryType::disconnect_client_ret:
      return "DisconnectClientRet";
    case EntryType::connection_test:
      return "ConnectionTest";
    case EntryType::connection_test_ret:
      return "ConnectionTestRet";
    case EntryType::get_node_info:
      return "GetNodeInfo";
    case EntryType::get_node_info_ret:
      return "GetNodeInfoRet";
    case EntryType::reconnect_client:
      return "ReconnectClient";
    case EntryType::reconnect_client_ret:
      return "ReconnectClientRet";
    case EntryType::node_check_capability:
      return "NodeCheckCapability";
    case EntryType::node_check_capability_ret:
      return "NodeCheckCapabilityRet";
    case EntryType::get_service_attributes:
      return "GetServiceAttributes";
    case EntryType::get_service_attributes_ret:
      return "GetServiceAttributesRet";
    case EntryType::connect_client_combined:
      return "ConnectClientCombined";
    case EntryType::connect_client_combined_ret:
      return "ConnectClientCombinedRet";
    case EntryType::endpoint_check_capability:
      return "EndpointCheckCapability";
    case EntryType::endpoint_check_capability_ret:
      return "EndpointCheckCapabilityRet";
    case EntryType::service_check_capability_req:
      return "ServiceCheckCapabilityReq";
    case EntryType::service_check_capability_ret:
      return "ServiceCheckCapabilityRet";
    case EntryType::client_keep_alive_req:
      return "ClientKeepAliveReq";
    case EntryType::client_keep_alive_ret:
      return "ClientKeepAliveRet";
    case EntryType::client_session_op_req:
      return "ClientSessionOpReq";
    case EntryType::client_session_op_ret:
      return "ClientSessionOpRet";
    case EntryType::service_path_released_req:
      return "ServicePathReleasedReq";
    case EntryType::service_path_released_ret:
      return "ServicePathReleasedRet";
    case EntryType::property_get_req:
      return "PropertyGetReq";
    case EntryType::property_get_res:
      return "PropertyGetRes";
    case EntryType::property_set_req:
      return "PropertySetReq";
    case EntryType::property_set_res:
      return "PropertySetRes";
    case EntryType::function_call_req:
      return "FunctionCallReq";
    case EntryType::function_call_res:
      return "FunctionCallRes";
    case EntryType::generator_next_req:
      return "GeneratorNextReq";
    case EntryType::generator_next_res:
      return "GeneratorNextRes";
    case EntryType::event_req:
      return "EventReq";
    case EntryType::event_res:
      return "EventRes";
    case EntryType::pipe_packet:
      return "PipePacket";
    case EntryType::pipe_packet_ret:
      return "PipePacketRet";
    case EntryType::pipe_connect_req:
      return "PipeConnectReq";
    case EntryType::pipe_connect_ret:
      return "PipeConnectRet";
    case EntryType::pipe_disconnect_req:
      return "PipeDisconnectReq";
    case EntryType::pipe_disconnect_ret:
      return "PipeDisconnectRet";
    case EntryType::pipe_closed:
      return "PipeClosed";
    case EntryType::pipe_closed_ret:
      return "PipeClosedRet";
    case EntryType::callback_call_req:
      return "CallbackCallReq";
    case EntryType::callback_call_ret:
      return "CallbackCallRet";
    case EntryType::wire_packet:
      return "WirePacket";
    case EntryType::wire_packet_ret:
      return "WirePacketRet";
    case EntryType::wire_connect_req:
      return "WireConnectReq";
    case EntryType::wire_connect_ret:
      return "WireConnectRet";
    case EntryType::wire_disconnect_req:
      return "WireDisconnectReq";
    case EntryType::wire_disconnect_ret:
      return "WireDisconnectRet";
    case EntryType::wire_closed:
      return "WireClosed";
    case EntryType::wire_closed_ret:
      return "WireClosedRet";
    case EntryType::memory_read:
      return "MemoryRead";
    case EntryType::memory_read_ret:
      return "MemoryReadRet";
    case EntryType::memory_write:
      return "MemoryWrite";
    case EntryType::memory_write_ret:
      return "MemoryWriteRet";
    case EntryType::memory_get_param:
      return "MemoryGetParam";
    case EntryType::memory_get_param_ret:
      return "MemoryGetParamRet";
    case EntryType::wire_peek_in_value_req:
      return "WirePeekInValueReq";
    case EntryType::wire_peek_in_value_ret:
      return "WirePeekInValueRet";
    case EntryType::wire_peek_out_value_req:
      return "WirePeekOutValueReq";
    case EntryType::wire_peek_out_value_ret:
      return "WirePeekOutValueRet";
    case EntryType::wire_poke_out_value_req:
      return "WirePokeOutValueReq";
    case EntryType::wire_poke_out_value_ret:
      return "WirePokeOutValueRet";
  }
  return "unknown";
}

}  // namespace rr
