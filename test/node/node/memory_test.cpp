// Memories of the service API, asked by the blocking client.
#include "node/service/memory.hpp"

#include <catch2/catch.hpp>
#include <numeric>

#include "test/node/node/node_fixture.hpp"

using namespace rr;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

constexpr const char* definition = R"(service test.store
stdver 0.10
pod Sample
    field int32 id
end
namedarray Vector
    field double x
    field double y
end
object Store
    memory int32[] plain
    memory double[*] grid
    memory Vector[] vectors
    memory Sample[] samples
    memory uint8[] computed [readonly]
    memory uint8[] sink [writeonly]
    memory uint8[] missing
end
)";

std::shared_ptr<Service> make_store() {
  return Service::from_text({definition}, "Store", "Store");
}

}  // namespace

TEST_CASE("containers of the service are read and written in parts") {
  auto plain = std::make_shared<NumberMemory<std::int32_t>>();
  auto grid = std::make_shared<NumberMemory<double>>();
  auto vectors = std::make_shared<NumberMemory<double>>();
  auto samples = std::make_shared<PodMemory>();
  plain->dimensions = {100'000};
  plain->items.resize(100'000);
  std::iota(plain->items.begin(), plain->items.end(), 0);
  grid->dimensions = {2, 3};
  grid->items = {0, 1, 2, 3, 4, 5};
  vectors->dimensions = {2};
  vectors->items = {1, 2, 3, 4};
  samples->dimensions = {2};
  samples->items = {{{}, {{"id", std::int32_t{7}}}}, {{}, {{"id", std::int32_t{8}}}}};
  RunningNode node([&](Node& it) {
    auto store = make_store();
    store->memory("plain", plain);
    store->memory("grid", grid);
    store->memory("vectors", vectors);
    store->memory("samples", samples);
    it.add(store);
  });
  const auto store = connect(node.url("Store"));

  const auto remote_plain = store.memory("plain");
  CHECK(remote_plain.dimensions() == MemoryShape{100'000});
  CHECK(remote_plain.read().to_items<std::int32_t>().value().back() == 99'999);
  remote_plain.write({10}, Value(std::vector<std::int32_t>(60'000, -1)));
  const auto around = remote_plain.read({9}, {60'002});
  const auto items = around.to_items<std::int32_t>().value();
  CHECK(items.front() == 9);
  CHECK(items[1] == -1);
  CHECK(items[60'000] == -1);
  CHECK(items.back() == 60'010);

  const auto remote_grid = store.memory("grid");
  CHECK(remote_grid.read({1, 0}, {1, 3}) == Value(MultiDimArray{{1, 3}, Array::take(std::vector<double>{1, 3, 5})}));
  remote_grid.write({0, 1}, MultiDimArray{{2, 1}, Array::take(std::vector<double>{-1, -2})});
  CHECK(node.ask([&](Node&) { return grid->items; }) == std::vector<double>{0, 1, -1, -2, 4, 5});

  const auto remote_vectors = store.memory("vectors");
  CHECK(remote_vectors.dimensions() == MemoryShape{2});
  remote_vectors.write({1}, NamedArray{"", Array::take(std::vector<double>{5, 6})});
  CHECK(node.ask([&](Node&) { return vectors->items; }) == std::vector<double>{1, 2, 5, 6});

  const auto remote_samples = store.memory("samples");
  const auto second = remote_samples.read({1}, {1});
  CHECK(second.get_if<PodArray>()->items.front().find("id")->to<std::int32_t>().value() == 8);
  remote_samples.write({0}, second);
  CHECK(node.ask([&](Node&) { return samples->items[0].find("id")->to<std::int32_t>().value(); }) == 8);
}

TEST_CASE("a container whose dimensions do not fit its items fails requests, not the service") {
  auto plain = std::make_shared<NumberMemory<std::int32_t>>();
  plain->dimensions = {10};
  plain->items = {1, 2, 3};
  RunningNode node([&](Node& it) {
    auto store = make_store();
    store->memory("plain", plain);
    it.add(store);
  });
  const auto memory = connect(node.url("Store")).memory("plain");
  const auto error = error_of([&] { memory.read({0}, {10}); });
  CHECK(error.code == ErrorCode::invalid_state);
  CHECK(error.message == "the memory has 3 items, its dimensions say 10");
  CHECK(error_of([&] { memory.write({9}, Value(std::vector<std::int32_t>{1})); }).code == ErrorCode::invalid_state);
  node.ask([&](Node&) { return plain->dimensions = {3}; });
  CHECK(memory.read() == Value(std::vector<std::int32_t>{1, 2, 3}));
}

TEST_CASE("the service checks ranges itself: a memory may have shrunk since the client asked") {
  auto plain = std::make_shared<NumberMemory<std::int32_t>>();
  RunningNode node([&](Node& it) {
    auto store = make_store();
    auto handlers = detail::make_memory_handlers(plain, {});
    handlers.dimensions = [plain] {
      plain->items.resize(plain->items.size() / 2);
      return plain->dimensions = {plain->items.size()};
    };
    store->memory("plain", handlers);
    it.add(store);
  });
  const auto memory = connect(node.url("Store")).memory("plain");
  const auto grow = [&] { node.ask([&](Node&) { plain->items.resize(400); }); };
  grow();  // 200 for the client's question, 100 for its request
  CHECK(error_of([&] { memory.read({0}, {101}); }).code == ErrorCode::out_of_range);
  grow();
  CHECK(error_of([&] { memory.write({100}, Value(std::vector<std::int32_t>{1})); }).code == ErrorCode::out_of_range);
  grow();
  CHECK(memory.read({0}, {100}).to_items<std::int32_t>().value().size() == 100);
}

TEST_CASE("handlers see ranges that are within the memory, and may fail") {
  std::vector<std::uint8_t> written;
  RunningNode node([&](Node& it) {
    auto store = make_store();
    MemoryHandlers computed;
    computed.dimensions = [] { return MemoryShape{1'000'000'000'000}; };
    computed.read = [](const MemoryRange& range) {
      if (range.position[0] == 13) throw ServiceException("not this one", ErrorCode::io_error);
      return Value(std::vector<std::uint8_t>(range.count[0], static_cast<std::uint8_t>(range.position[0])));
    };
    store->memory("computed", computed);
    MemoryHandlers sink;
    sink.dimensions = [] { return MemoryShape{10}; };
    sink.write = [&written](const MemoryRange&, const Value& items) {
      const auto bytes = items.to_items<std::uint8_t>().value();
      written.insert(written.end(), bytes.begin(), bytes.end());
    };
    store->memory("sink", sink);
    it.add(store);
  });
  const auto store = connect(node.url("Store"));
  CHECK(store.memory("computed").read({77}, {2}) == Value(std::vector<std::uint8_t>{77, 77}));
  CHECK(error_of([&] { store.memory("computed").read({13}, {2}); }).message == "not this one");
  CHECK(error_of([&] { store.memory("computed").read({1'000'000'000'000}, {1}); }).code == ErrorCode::out_of_range);
  store.memory("sink").write({3}, Value(std::vector<std::uint8_t>{1, 2}));
  CHECK(node.ask([&](Node&) { return written; }) == std::vector<std::uint8_t>{1, 2});
  CHECK(error_of([&] { store.memory("sink").read({0}, {1}); }).code == ErrorCode::write_only_member);
  CHECK(error_of([&] { store.memory("missing").dimensions(); }).code == ErrorCode::not_implemented_error);
}

TEST_CASE("memories that do not fit their definition are refused where they are set") {
  const auto store = make_store();
  CHECK_THAT(refusal([&] { store->memory("plain", std::make_shared<NumberMemory<double>>()); }),
             Equals("test.store.Store.plain: is int32[], the memory is of double"));
  CHECK_THAT(refusal([&] { store->memory("vectors", std::make_shared<NumberMemory<float>>()); }), Contains("single"));
  CHECK_THAT(refusal([&] { store->memory("samples", std::make_shared<NumberMemory<double>>()); }), Contains("Sample"));
  CHECK_THAT(refusal([&] { store->memory("plain", std::make_shared<PodMemory>()); }), Contains("pods"));
  CHECK_THAT(refusal([&] { store->memory("plain", MemoryHandlers{}); }), Contains("dimensions"));
  MemoryHandlers handlers;
  handlers.dimensions = [] { return MemoryShape{1}; };
  CHECK_THAT(refusal([&] { store->memory("computed", handlers); }), Contains("no read handler"));
  CHECK_THAT(refusal([&] { store->memory("sink", handlers); }), Contains("no write handler"));
  CHECK_THAT(refusal([&] { store->memory("other", handlers); }), Contains("no member 'other'"));
}
