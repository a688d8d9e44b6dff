// Definitions come from services, which verified them: this module resolves their types, and leaves out what else there
// is to find. Defined here, the linker takes none of it. Layer: wasm-client/src.
#include "core/robdef/parse/constant_check.hpp"
#include "core/robdef/resolve/resolve.hpp"
#include "core/robdef/verify/verify.hpp"

std::vector<rr::Diagnostic> rr::verify_service_definitions(std::span<ServiceDefinition* const> set,
                                                           std::span<const ServiceDefinition* const> known,
                                                           RobdefMode) {
  return resolve_service_definitions(set, known);
}

bool rr::check_constant(StatementReader&, const ConstantDefinition&, const ConstantPlace&) {
  return true;
}
