#include "server/upstream/device_definitions.hpp"

#include "test/server/upstream/upstream_bench.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

const std::string base = "service test.base\nstruct Size\n  field double width\nend\n";
const std::string user = "service test.user\nimport test.base\nobject User\n  property test.base.Size size\nend\n";

rr::TypeRegistry read(const std::vector<std::string>& texts) {
  rr::TypeRegistry types;
  types.add(texts, rr::RobdefMode::compat).value();
  return types;
}

/// Counts how often it was of use.
class Counted final : public rr::ReadDefinitions {
 public:
  bool find(const std::vector<std::string>& texts, rr::TypeRegistry& types) override {
    const bool is_known = definitions_.find(texts, types);
    if (is_known) ++found;
    return is_known;
  }
  void keep(const rr::TypeRegistry& types) override { definitions_.keep(types); }

  int found = 0;

 private:
  DeviceDefinitions definitions_;
};

/// A device that is looked at once, and the gateway's session with it.
struct Sensor {
  UpstreamBench bench;

  Sensor(const std::shared_ptr<Counted>& definitions, const std::string& text)
      : bench(rr::Service::from_text({text}, "sensor", "Sensor")) {
    bench.device->share_definitions(definitions);
    bench.device->start();
    REQUIRE(bench.run_until([this] { return bench.device->state() == DeviceState::online; }));
    bench.open();
  }
  const rr::ServiceDefinition* definition() const { return bench.upstream->types()->find_service("test.sensor"); }
};

}  // namespace

TEST_CASE("definitions that were kept are found by their texts, in any order") {
  DeviceDefinitions definitions;
  const auto kept = read({base, user});
  definitions.keep(kept);
  rr::TypeRegistry types;
  REQUIRE(definitions.find({user, base, user}, types));
  CHECK(types.find_entity("test.user.User") == kept.find_entity("test.user.User"));
  CHECK(types.find_service("test.base") == kept.find_service("test.base"));
}

TEST_CASE("definitions are not found by others, by some, or by more") {
  DeviceDefinitions definitions;
  definitions.keep(read({base, user}));
  rr::TypeRegistry types;
  CHECK_FALSE(definitions.find({}, types));
  CHECK_FALSE(definitions.find({user}, types));
  CHECK_FALSE(definitions.find({base, user + "# "}, types));
  CHECK_FALSE(definitions.find({base, user, "service test.more\n"}, types));
  CHECK(types.definitions().empty());
}

TEST_CASE("when too much is kept, it is forgotten; what others have of it stays theirs") {
  DeviceDefinitions definitions;
  rr::TypeRegistry types;
  definitions.keep(read({base}));
  REQUIRE(definitions.find({base}, types));
  const std::string half(DeviceDefinitions::max_bytes / 2, '#');
  const auto first = "service test.first\n" + half;
  const auto second = "service test.second\n" + half;
  definitions.keep(read({first}));
  definitions.keep(read({second}));
  rr::TypeRegistry others;
  CHECK_FALSE(definitions.find({base}, others));
  CHECK_FALSE(definitions.find({first}, others));
  CHECK(definitions.find({second}, others));
  CHECK(types.find_entity("test.base.Size")->find_member("width"));

  const auto large = "service test.large\n" + half + half;
  definitions.keep(read({large}));
  CHECK_FALSE(definitions.find({large}, others));
  CHECK(definitions.find({second}, others));
}

TEST_CASE("what equal devices define is read once, by looks and by sessions") {
  const std::string text = "service test.sensor\nobject Sensor\n  wire double level [readonly]\nend\n";
  const auto definitions = std::make_shared<Counted>();
  const Sensor first(definitions, text);
  CHECK(definitions->found == 0);
  const Sensor equal(definitions, text);
  CHECK(definitions->found == 2);  // the service index's, and its own
  CHECK(equal.definition() == first.definition());
  const Sensor other(definitions, text + "# another make\n");
  CHECK(definitions->found == 3);
  CHECK(other.definition() != first.definition());
  CHECK(other.definition()->text == text + "# another make\n");
}
