// Documents about a device whose services bring definitions of one name that differ.
#include "server/http/endpoints/device_documents.hpp"

#include <catch2/catch.hpp>
#include <memory>
#include <set>

#include "server/json/json.hpp"

using namespace rrgate;
using Catch::Matchers::Contains;

namespace {

std::unique_ptr<rr::TypeRegistry> registry(const std::vector<std::string>& texts) {
  auto types = std::make_unique<rr::TypeRegistry>();
  REQUIRE(types->add(texts, rr::RobdefMode::compat).has_value());
  return types;
}

std::string light(const std::string& name) {
  return "service test.light\nstdver 0.10\nstruct " + name + "\n    field double red\nend\n";
}

std::string lamp(const std::string& name, const std::string& colour) {
  return "service test." + name + "\nstdver 0.10\nimport test.light\nobject Lamp\n    property test.light." + colour +
         " colour\nend\n";
}

struct Lamps {
  std::unique_ptr<rr::TypeRegistry> first = registry({light("Colour"), lamp("desk", "Colour")});
  std::unique_ptr<rr::TypeRegistry> same = registry({light("Colour"), lamp("floor", "Colour")});
  std::unique_ptr<rr::TypeRegistry> different = registry({light("Shade"), lamp("floor", "Shade")});
  DescribedService desk = {"desk", "test.desk.Lamp", first.get()};
  DescribedService alike = {"floor", "test.floor.Lamp", same.get()};
  DescribedService other = {"floor", "test.floor.Lamp", different.get()};
};

}  // namespace

TEST_CASE("a service fits into the documents of a device where it means the same by every name") {
  const Lamps lamps;
  CHECK(fits_beside(lamps.desk, {}));
  CHECK(fits_beside(lamps.alike, {lamps.desk}));
  CHECK_FALSE(fits_beside(lamps.other, {lamps.desk}));
  CHECK_FALSE(fits_beside(lamps.other, {lamps.alike, lamps.desk}));
}

TEST_CASE("types of services that fit beside each other are told, and why there are none of others") {
  const Lamps lamps;
  const auto told = device_document("types.d.ts", "d", "/d", {lamps.desk, lamps.alike}, {});
  CHECK(told.status == 200);
  REQUIRE(told.body);
  CHECK_THAT(*told.body, Contains("export interface Colour {"));
  const auto refused = device_document("types.d.ts", "d", "/d", {lamps.desk, lamps.other}, {});
  CHECK(refused.status == 503);
  REQUIRE(refused.body);
  CHECK_THAT(*refused.body, Contains("do not fit together") && Contains("Shade"));
}

TEST_CASE("documents of many paths through few objects are bounded, and say so") {
  std::string text = "service test.tree\nstdver 0.10\nobject o0\n    property double speed\nend\n";
  const auto add_object = [&text](int number) {
    const auto below = std::to_string(number - 1);
    text += "object o" + std::to_string(number) + "\n    event done()\n    objref o" + below + " a\n    objref o" +
            below + " b\nend\n";
  };
  for (int number = 1; number <= 20; ++number) add_object(number);
  const auto types = registry({text});
  const auto paths = [&types](const std::string& root) {
    const auto response = device_document("openapi.json", "d", "/d", {{"tree", root, types.get()}}, {});
    REQUIRE(response.body);
    const auto document = rr::OrderedJson::parse(*response.body);
    return std::pair(document["paths"].size(), document.contains("x-rr-truncated"));
  };
  CHECK(paths("test.tree.o3") == std::pair<std::size_t, bool>(15, false));
  const auto [count, is_truncated] = paths("test.tree.o20");
  CHECK(count > 1000);
  CHECK(count < 5000);
  CHECK(is_truncated);
  for (const std::string document : {"asyncapi.json", "thing-description.json"}) {
    const auto response = device_document(document, "d", "/d", {{"tree", "test.tree.o20", types.get()}}, {});
    REQUIRE(response.body);
    CHECK(response.body->size() < 8'000'000);
    CHECK_THAT(*response.body, Contains("\"x-rr-truncated\":true"));
  }
}

TEST_CASE("members whose paths differ only in '/' and '_' have ids of their own, and are in each document") {
  const auto types = registry({R"(service test.robot
stdver 0.10
object Arm
    property double speed
    event done()
    memory double[] data
    wire double w
    pipe double p
    function void stop()
end
object Robot
    objref Arm arm
    property double arm_speed
    event arm_done()
    memory double[] arm_data
    wire double arm_w
    pipe double arm_p
    function void arm_stop()
end
)"});
  const auto document = [&types](const std::string& name) {
    const auto response = device_document(
        name, "d", "/d", {{"socket", "test.robot.Robot", types.get()}, {"arm_w", "test.robot.Robot", types.get()}}, {});
    REQUIRE(response.body);
    return rr::OrderedJson::parse(*response.body);
  };
  std::set<std::string> ids, streams;
  std::size_t operations = 0;
  const auto open_api = document("openapi.json");
  for (const auto& [path, item] : open_api["paths"].items())
    for (const std::string method : {"get", "put", "post"})
      if (item.contains(method)) {
        ids.insert(item[method]["operationId"].get<std::string>());
        ++operations;
      }
  CHECK(operations == 2 * 2 * 10);
  CHECK(ids.size() == operations);

  const auto async_api = document("asyncapi.json");
  for (const auto& [id, channel] : async_api["channels"].items()) streams.insert(channel["address"].get<std::string>());
  CHECK(streams == std::set<std::string>{"/d/socket", "/d/socket/arm/done", "/d/socket/arm/w", "/d/socket/arm/p",
                                         "/d/socket/arm_done", "/d/socket/arm_w", "/d/socket/arm_p", "/d/arm_w",
                                         "/d/arm_w/arm/done", "/d/arm_w/arm/w", "/d/arm_w/arm/p", "/d/arm_w/arm_done",
                                         "/d/arm_w/arm_w", "/d/arm_w/arm_p"});
  CHECK(async_api["operations"].size() == 12 + 2 * 2);

  const auto thing = document("thing-description.json");
  CHECK(thing["properties"].size() == 2 * 4);
  CHECK(thing["events"].size() == 2 * 4);
  CHECK(thing["actions"].size() == 2 * 2);
}
