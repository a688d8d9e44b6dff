#include "node/service/service.hpp"

#include <catch2/catch.hpp>

#include "node/service/node.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

constexpr const char* definition = R"(service test.lamp
stdver 0.10

struct Spot
    field double x
    field double y
end

object Bulb
    property double watts
end

object WarmBulb
    implements Bulb
    property double watts
end

object Lamp
    property double brightness
    property string name [readonly]
    property int32 secret [writeonly]
    function void blink(int16 count, double[] pattern)
    function int32 total()
    event burnt(string why)
    wire double level [readonly]
    wire double wish [writeonly]
    objref Bulb bulb
    objref Bulb{int32} bulbs
    pipe double samples
    callback void ask()
    memory uint8[] data
    function double{generator} scan()
end
)";

std::shared_ptr<Service> make_lamp() {
  return Service::from_text({definition}, "lamp", "Lamp");
}

std::shared_ptr<Service> make_complete_lamp() {
  auto lamp = make_lamp();
  lamp->property("brightness").get([] { return 1.0; }).set([](double) {});
  lamp->property("name").get([] { return "n"; });
  lamp->property("secret").set([](std::int32_t) {});
  lamp->function("blink", [](std::int16_t, std::vector<double>) {});
  lamp->function("total", [] { return 3; });
  lamp->generator("scan", [] { return [] { return std::optional<double>(); }; });
  lamp->objref("bulb", std::shared_ptr<Object>());
  lamp->objref("bulbs", [](std::string_view) { return std::shared_ptr<Object>(); });
  return lamp;
}

}  // namespace

TEST_CASE("handlers that do not fit are refused where they are set") {
  const auto lamp = make_lamp();
  CHECK_THAT(refusal([&] { lamp->function("blnk", [] {}); }), Equals("test.lamp.Lamp has no member 'blnk'"));
  CHECK_THAT(refusal([&] { lamp->function("brightness", [] {}); }),
             Equals("test.lamp.Lamp.brightness is a property, not a function"));
  CHECK_THAT(refusal([&] { lamp->function("blink", [](std::int16_t) {}); }),
             Equals("test.lamp.Lamp.blink: the handler takes 1 parameters, the definition has 2"));
  CHECK_THAT(refusal([&] { lamp->function("blink", [](std::string, std::vector<double>) {}); }),
             Equals("test.lamp.Lamp.blink: parameter 'count' is int16, the handler takes string"));
  CHECK_THAT(refusal([&] { lamp->function("blink", [](std::int16_t, std::vector<float>) {}); }),
             Equals("test.lamp.Lamp.blink: parameter 'pattern' is double[], the handler takes single[]"));
  CHECK_THAT(refusal([&] { lamp->function("total", [] { return "three"; }); }),
             Equals("test.lamp.Lamp.total: is int32, the handler returns string"));
  CHECK_THAT(refusal([&] { lamp->property("brightness").set([](std::int32_t) {}); }),
             Equals("test.lamp.Lamp.brightness (set): parameter 'value' is double, the handler takes int32"));
  CHECK_THAT(refusal([&] { lamp->property("name").set([](std::string) {}); }), Contains("readonly"));
  CHECK_THAT(refusal([&] { lamp->property("secret").get([] { return 1; }); }), Contains("writeonly"));
  CHECK_THAT(refusal([&] { lamp->on_wire("level", [](double) {}); }), Contains("readonly"));
  CHECK_THAT(refusal([&] { lamp->on_wire("wish", [](std::string) {}); }), Contains("'value' is double"));
  CHECK_THAT(refusal([&] { lamp->function("scan", [] { return 1.0; }); }), Contains("generator"));
}

TEST_CASE("values that cannot be sent are refused where they are set, connected or not") {
  const auto lamp = make_lamp();
  CHECK_THAT(refusal([&] { lamp->set_wire("level", "high"); }), Contains("test.lamp.Lamp.level"));
  CHECK_THAT(refusal([&] { lamp->set_wire("wish", 1.0); }), Contains("writeonly"));
  CHECK_THAT(refusal([&] { lamp->fire("burnt"); }), Contains("fired with 0 arguments, the definition has 1"));
  CHECK_THAT(refusal([&] { lamp->fire("burnt", 5); }), Contains("argument 'why'"));
  CHECK_NOTHROW(lamp->set_wire("level", 0.5));
  CHECK_NOTHROW(lamp->fire("burnt", "age"));
}

TEST_CASE("objects behind objrefs are of the objref's type or implement it") {
  const auto lamp = make_lamp();
  CHECK_NOTHROW(lamp->objref("bulb", lamp->make_object("Bulb")));
  CHECK_NOTHROW(lamp->objref("bulb", lamp->make_object("test.lamp.WarmBulb")));
  CHECK_THAT(refusal([&] { lamp->objref("bulb", lamp->make_object("Lamp")); }),
             Equals("test.lamp.Lamp.bulb: is Bulb, the object is test.lamp.Lamp"));
  CHECK_THAT(refusal([&] { lamp->objref("bulbs", lamp->make_object("Bulb")); }), Contains("indexed"));
  CHECK_THAT(refusal([&] { lamp->make_object("Candle"); }), Contains("no object type 'test.lamp.Candle'"));
  CHECK_THAT(refusal([&] { lamp->make_object("Spot"); }), Contains("no object type 'test.lamp.Spot'"));
}

TEST_CASE("a node names every handler that is missing, and leaves out kinds that need none") {
  Node node("test.node");
  const auto lamp = make_lamp();
  lamp->property("brightness").get([] { return 1.0; });
  lamp->function("total", [] { return 3; });
  CHECK_THAT(refusal([&] { node.add(lamp); }),
             Equals("service 'lamp': no handler for set of property Lamp.brightness, get of property Lamp.name, "
                    "set of property Lamp.secret, function Lamp.blink, objref Lamp.bulb, objref Lamp.bulbs, "
                    "function Lamp.scan"));

  const auto complete = make_complete_lamp();
  const auto bulb = complete->make_object("Bulb");
  CHECK_THAT(refusal([&] { node.add(complete); }),
             Equals("service 'lamp': no handler for get of property Bulb.watts, set of property Bulb.watts"));
  bulb->property("watts").get([] { return 5.0; }).set([](double) {});
  CHECK_NOTHROW(node.add(complete));
  CHECK_THAT(refusal([&] { node.add(complete); }), Contains("added to a node before"));
  CHECK_THAT(refusal([&] { node.add(make_complete_lamp()); }), Contains("has a service 'lamp' already"));
}

TEST_CASE("a service needs a definition that holds its root type") {
  CHECK_THAT(refusal([] { Service::from_text({definition}, "lamp", "Candle"); }), Contains("test.lamp.Candle"));
  CHECK_THAT(refusal([] { Service::from_text({"service test.bad\nobject\nend\n"}, "bad", "X"); }), Contains("2"));
  CHECK_THAT(
      refusal([] { Service::from_text({"service test.a\nstdver 0.10\nimport test.b\nobject X\nend\n"}, "a", "X"); }),
      Contains("test.b"));
  CHECK_THAT(refusal([] { Service::from_text({}, "none", "X"); }), Contains("no definition"));
  CHECK_THAT(refusal([] { Service::from_file("no/such.robdef", "x", "X"); }), Contains("no/such.robdef"));
}

TEST_CASE("an object that a service has no room for is refused; until then each is one and the same for all") {
  std::shared_ptr<Service> lamp;
  RunningNode node([&](Node& made) {
    lamp = make_complete_lamp();
    lamp->objref("bulbs", [made = lamp.get()](std::string_view) {
      auto bulb = made->make_object("Bulb");
      bulb->property("watts").get([] { return 5.0; }).set([](double) {});
      return bulb;
    });
    made.add(lamp);
  });
  const auto client = connect(node.url("lamp"));
  for (int i = 0; i < 4095; ++i) client.object("bulbs", std::to_string(i));
  const auto refused = error_of([&] { client.object("bulbs", "4095"); });
  CHECK(refused.code == ErrorCode::out_of_system_resource);
  CHECK_THAT(refused.message, Contains("'lamp.bulbs[4095]'") && Contains("expected at most 4096"));
  client.connection().close();
  CHECK_NOTHROW(connect(node.url("lamp")).object("bulbs", "4095"));
}
