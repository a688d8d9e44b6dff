// A service to be found by its type, and by what that implements.
#pragma once

#include <memory>
#include <string>

#include "node/service/service.hpp"

namespace rr::test {

inline constexpr const char* things_definition = R"(service experimental.found
object Base
  property int32 one
end
object Thing
  implements Base
  property int32 one
end
object Other
  property int32 two
end
)";

inline std::shared_ptr<Service> make_thing(const std::string& name, const std::string& room = {}) {
  auto service = Service::from_text({things_definition}, name, "Thing");
  service->property("one").get([] { return 1; }).set([](std::int32_t) {});
  if (!room.empty()) service->set_attribute("room", Value(room));
  return service;
}

}  // namespace rr::test
