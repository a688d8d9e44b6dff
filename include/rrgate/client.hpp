// To use a device: clients that wait (rr::connect) and clients on Asio (rr::async_connect), what generated client
// classes stand on, and connection URLs. docs/definition-tools.md, docs/tutorials/cpp-device.md. What this includes is
// internal, and changes.
#pragma once

#include "core/session/url.hpp"
#include "node/client/async_stub.hpp"
#include "node/client/client_stub.hpp"
#include "node/tls/certificate_files.hpp"
