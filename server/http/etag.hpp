// What tells one content from another. Layer: server/http.
#pragma once

#include <string>
#include <string_view>

#include "server/http/request.hpp"

namespace rrgate {

/// Quoted, as a header has it; the same for the same content, in every run. `suffix` tells encodings of it apart.
std::string make_etag(std::string_view content, std::string_view suffix = {});
/// Whether If-None-Match has it: weak too, as proxies that compress make it, or as "*". Source: RFC 9110,
/// section 13.1.2.
bool has_etag(const Request& request, std::string_view etag);
/// With an ETag of its content; 304 where the request has it already.
Response with_etag(Response response, const Request& request);

}  // namespace rrgate
