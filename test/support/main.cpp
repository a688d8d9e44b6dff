#define CATCH_CONFIG_MAIN
#if defined(__GNUC__) && !defined(__clang__)
// GCC 12 with -fsanitize=address takes std::regex's states, which Catch2 compiles here, for uninitialized.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <catch2/catch.hpp>
