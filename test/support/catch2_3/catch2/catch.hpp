/// \file
/// Catch2 3 (Debian 13) by the names of Catch2 2 (Debian 12), in which the tests are written.
#pragma once
#include <catch2/catch_all.hpp>

namespace Catch {
using Matchers::EndsWith;
using Matchers::Equals;
using Matchers::Matches;
using Matchers::StartsWith;
using Matchers::VectorContains;
using TestEventListenerBase = EventListenerBase;
using Matchers::ContainsSubstring;
}  // namespace Catch

using Catch::Approx;

// In 3 Contains is another matcher, for elements of ranges.
#define Contains ContainsSubstring
