// ClientOptions from the options object of the TypeScript side. Layer: wasm-client/src.
#pragma once

#include "core/session/client/client_session.hpp"
#include "wasm-client/src/js_access.hpp"

namespace rr {

/// Fields (all but `service` optional): service, nodeId, nodeName, selfName, username, credentials (a Map or object),
/// objectType, version (2 or 4), stringTable, connectTimeout (ms), maxMessageSize (bytes), known (what
/// WasmSession::known_definitions() gave, or an empty array).
/// The session's own node id is random.
/// Errors   invalid_argument, data_type_mismatch, out_of_range.
Result<ClientOptions> read_session_options(const JsValue& js);

}  // namespace rr
