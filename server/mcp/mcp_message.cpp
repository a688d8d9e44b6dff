#include "server/mcp/mcp_message.hpp"

#include <algorithm>

#include "server/mcp/mcp_describe.hpp"

namespace rrgate {

namespace {

/// Of a progressToken, which is sent back each second.
constexpr std::size_t longest_token = 256;

bool is_known(std::string_view revision) {
  return revision == newest_revision || is_handshake_revision(revision);
}

}  // namespace

bool is_handshake_revision(std::string_view revision) {
  return std::find(handshake_revisions.begin(), handshake_revisions.end(), revision) != handshake_revisions.end();
}

rr::OrderedJson known_revisions() {
  auto out = rr::OrderedJson::array();
  for (const auto revision : handshake_revisions) out.push_back(revision);
  out.push_back(newest_revision);
  return out;
}

std::string McpMessage::text(const char* key) const {
  const auto found = params.find(key);
  if (found == params.end()) return {};
  if (!found->is_string()) throw McpRefusal{mcp_invalid_params, "\"" + std::string(key) + "\" is no string"};
  return found->get<std::string>();
}

McpMessage read_message(const Request& request) {
  const auto type = request.header(http::field::content_type);
  // A page of another origin can send text/plain without being asked; JSON it can't.
  if (!equals_ignoring_case(type.substr(0, type.find(';')), "application/json"))
    throw McpRefusal{mcp_invalid_request, "Content-Type is " + rr::quote(type) + ", expected application/json", 415};
  const auto json = rr::read_json(request.message.body());
  if (!json) throw McpRefusal{mcp_parse_error, json.error().message, 400};
  const auto bad = [](const char* what) { return McpRefusal{mcp_invalid_request, what, 400}; };
  if (!json->is_object() || json->value("jsonrpc", rr::Json()) != "2.0")
    throw bad("expected one message of JSON-RPC 2.0, {\"jsonrpc\": \"2.0\", \"method\": ..., ...}");
  McpMessage out;
  if (const auto id = json->find("id"); id != json->end()) {
    if (!id->is_string() && !id->is_number_integer()) throw bad("\"id\" is neither a string nor a whole number");
    out.id = *id;
  }
  const auto method = json->find("method");
  if (method == json->end()) {
    if (json->contains("result") || json->contains("error")) out.id = nullptr;
    if (out.id.is_null()) return out;  // the gateway asks clients for nothing
    throw bad("\"method\" is missing");
  }
  if (!method->is_string()) throw bad("\"method\" is no string");
  out.method = method->get<std::string>();
  if (const auto params = json->find("params"); params != json->end()) {
    if (!params->is_object()) throw bad("\"params\" is no object");
    out.params = *params;
  }
  return out;
}

void take_revision(McpMessage& message, const Request& request) {
  const auto header = std::string(request.header("MCP-Protocol-Version"));
  std::string told;
  if (const auto meta = message.params.find("_meta"); meta != message.params.end() && meta->is_object())
    if (const auto found = meta->find("io.modelcontextprotocol/protocolVersion");
        found != meta->end() && found->is_string())
      told = found->get<std::string>();
  const auto mismatch = [](const std::string& what) { return McpRefusal{mcp_header_mismatch, what, 400}; };
  if (!told.empty() && told != header)
    throw mismatch("MCP-Protocol-Version is " + rr::quote(header) + ", the message is of " + rr::quote(told));
  if (!header.empty() && !is_known(header))
    throw McpRefusal{mcp_unsupported_version,
                     "protocol version " + rr::quote(header) + " is not known here",
                     400,
                     {{"supported", known_revisions()}, {"requested", header}}};
  message.is_modern = header == newest_revision;
  if (!message.is_modern || message.id.is_null()) return;
  if (const auto method = request.header("Mcp-Method"); method != message.method)
    throw mismatch("Mcp-Method is " + rr::quote(method) + ", the message's method " + rr::quote(message.method));
}

std::string program_of(const McpMessage& message) {
  const auto part = [](const rr::Json& of, const char* key) {
    const auto found = of.is_object() ? of.find(key) : of.end();
    return found == of.end() ? rr::Json() : *found;
  };
  const auto said = message.is_modern ? part(part(message.params, "_meta"), "io.modelcontextprotocol/clientInfo")
                                      : part(message.params, "clientInfo");
  std::string out;
  for (const auto* key : {"name", "version"})
    if (const auto text = part(said, key); text.is_string())
      out += (out.empty() ? "" : " ") + bounded_text(text.get<std::string>(), longest_shown);
  return out;
}

rr::OrderedJson progress_token(const McpMessage& message) {
  const auto meta = message.params.find("_meta");
  if (meta == message.params.end() || !meta->is_object()) return nullptr;
  const auto token = meta->find("progressToken");
  if (token == meta->end() || !(token->is_string() || token->is_number_integer())) return nullptr;
  if (token->is_string() && token->get_ref<const std::string&>().size() > longest_token)
    throw McpRefusal{mcp_invalid_params, "\"progressToken\" has more than " + std::to_string(longest_token) + " bytes"};
  return *token;
}

}  // namespace rrgate
