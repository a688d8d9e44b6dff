#include "core/session/known_definitions.hpp"

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>

namespace rr {

std::string make_definitions_tag(const std::vector<std::string_view>& texts) {
  std::string content;
  for (const auto text : texts) content.append(std::to_string(text.size())).append(":").append(text);
  return to_string(boost::uuids::name_generator_sha1(boost::uuids::ns::oid())(content));
}

}  // namespace rr
