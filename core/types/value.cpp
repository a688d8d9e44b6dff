#include "core/types/value.hpp"

namespace rr {}
