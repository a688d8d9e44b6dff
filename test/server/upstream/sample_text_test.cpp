// Values that many follow as JSON.
#include "server/http/endpoints/sample_text.hpp"

#include <set>
#include <string>
#include <vector>

#include "test/server/upstream/upstream_bench.hpp"

using namespace rrgate;
using namespace rrgate::test;

namespace {

constexpr const char* definition = R"(service test.meter
stdver 0.10
object Meter
    wire double[] level [readonly]
    event alarm(string what)
end
)";

/// A meter with a hundred who follow one of its members as JSON.
struct Meter {
  static constexpr std::size_t followers = 100;

  std::shared_ptr<rr::Service> service = rr::Service::from_text({definition}, "meter", "Meter");
  UpstreamBench bench;
  MemoryBudget memory{1'000'000};
  std::shared_ptr<ValueClient> client;
  std::vector<ValueClient::ListenerPtr> listeners;
  std::set<const void*> written;  ///< where the texts of the newest sample lie
  std::size_t heard = 0;
  SamplePtr newest;
  std::string text;

  Meter() : bench(service) {
    bench.open();
    REQUIRE(bench.find("meter").has_value());
    client = std::make_shared<ValueClient>(bench.upstream, Subject(), Device::Seat(*bench.device),
                                           MemoryBudget(1'000'000).charge(""));
  }
  void follow(const std::string& name, const std::vector<rr::JsonForm>& forms) {
    const auto types = bench.upstream->types();
    const auto* member = bench.upstream->object_type("meter")->find_member(name);
    for (std::size_t i = 0; i < followers; ++i) {
      const SampleHandler handler = [this, member, types, form = forms[i % forms.size()]](const SamplePtr& sample,
                                                                                          const rr::Error*) {
        if (!sample) return;
        if (sample != newest) written.clear();
        newest = sample;
        const auto& json = sample_text(*sample, *member, *types, form, memory);
        REQUIRE(json.has_value());
        written.insert(&json);
        text = *json;
        ++heard;
      };
      auto listening = bench.wait_for(client->listen({"meter", member, types}, 0, handler));
      REQUIRE(listening.has_value());
      listeners.push_back(std::move(*listening));
    }
  }
  void wait_for_all() {
    REQUIRE(bench.run_until([&] { return heard >= followers; }));
    heard = 0;
  }
};

}  // namespace

TEST_CASE("a value that a hundred follow as JSON is written once, and its text is held no longer than the value") {
  Meter meter;
  meter.follow("level", {rr::JsonForm{}});
  meter.heard = 0;
  meter.service->set_wire("level", std::vector<double>{1, 2.5});
  meter.wait_for_all();
  CHECK(meter.text == "[1.0,2.5]");
  CHECK(meter.written.size() == 1);
  CHECK(meter.memory.used() == meter.text.size());
  meter.service->set_wire("level", std::vector<double>{7});
  meter.wait_for_all();
  CHECK(meter.text == "[7.0]");
  CHECK(meter.written.size() == 1);
  CHECK(meter.memory.used() == meter.text.size());
  meter.listeners.clear();
  meter.newest.reset();
  CHECK(meter.memory.used() == 0);
}

TEST_CASE("those who follow a value in another form get it in theirs") {
  Meter meter;
  meter.follow("level", {rr::JsonForm{}, rr::JsonForm{.packs_arrays = true}});
  meter.heard = 0;
  meter.service->set_wire("level", std::vector<double>{1});
  meter.wait_for_all();
  CHECK(meter.written.size() == 2);
  CHECK(meter.text == R"({"b64":"AAAAAAAA8D8=","count":1})");
}

TEST_CASE("an event is written once for all who hear it, and those that are kept hold no text") {
  Meter meter;
  meter.follow("alarm", {rr::JsonForm{}});
  meter.service->fire("alarm", std::string("hot"));
  meter.wait_for_all();
  CHECK(meter.text == R"({"what":"hot"})");
  CHECK(meter.written.size() == 1);
  CHECK(meter.memory.used() == 0);
}
