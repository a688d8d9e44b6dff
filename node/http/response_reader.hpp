// Reads the response to a request of ours. Layer: node/http. Parsing is Beast's. Source: RFC 9112 sections 4 and 6.
#pragma once

#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <functional>

#include "core/support/error.hpp"
#include "node/transport/byte_stream.hpp"

namespace rrgate {

using ResponseParser = boost::beast::http::response_parser<boost::beast::http::string_body>;

/// Reads until the response, or the connection where that ends it, is at its end.
/// `parser`   new; holds status, header and body.
/// `largest`  bytes of the header, and of the body that is held at a time.
/// `on_more`  called when there is more of the body, which it may take away; empty: nobody wants to know.
/// Errors     connection_error: no HTTP, more than `largest`, or what the connection ended by.
rr::awaitable<rr::Result<>> read_response(rr::ByteStream& stream, ResponseParser& parser, std::size_t largest,
                                          const std::function<void()>& on_more);

}  // namespace rrgate
