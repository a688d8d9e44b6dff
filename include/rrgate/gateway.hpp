// A gateway inside a program: docs/embedding.md. What this includes is internal, and changes.
#pragma once

#include "server/gateway/embedded_gateway.hpp"
