// To write a device: a node with its services, what generated service classes stand on, users and TLS.
// docs/definition-tools.md, docs/device-author.md. What this includes is internal, and changes.
#pragma once

#include "node/service/node.hpp"
#include "node/service/password_file.hpp"
#include "node/service/service_stub.hpp"
#include "node/tls/certificate_files.hpp"
