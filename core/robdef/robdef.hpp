// Service definitions, from text to meaning and back. Layer: robdef. Source: service definitions spec.
#pragma once

#include "core/robdef/format/format.hpp"
#include "core/robdef/parse/parse.hpp"
#include "core/robdef/verify/verify.hpp"
