// To hand a node the WebSockets that a Boost.Beast server of the program has accepted: rr::make_beast_stream and
// rr::Node::accept. docs/device-author.md. What this includes is internal, and changes.
#pragma once

#include "node/transport/beast_stream.hpp"
