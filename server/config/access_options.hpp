// "access" of the configuration: who may do what. Layer: server/config.
#pragma once

#include <functional>

#include "server/access/access_config.hpp"
#include "server/config/config.hpp"
#include "server/config/object_reader.hpp"

namespace rrgate {

/// To be read before "access", which may name the file too.
void read_audit(ObjectReader& in, AuditConfig& audit);
void read_access(ObjectReader& in, AccessConfig& access);

/// What of it contradicts the rest.
void check_access(const Config& config, std::vector<Finding>& findings);

/// Calls `locate` for every path of a file in it.
void for_each_file(AccessConfig& access, const std::function<void(std::string&)>& locate);

/// Whether other machines reach one of the addresses although there is no TLS, or nobody must say who he is: a sentence
/// about the first; empty where all is well.
std::string exposure(const std::vector<rr::HostPort>& addresses, const Config& config);

}  // namespace rrgate
