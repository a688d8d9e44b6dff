// Memory of sessions: what a large message took is given back, and a steady stream of calls takes none.

#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/count_allocations.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

constexpr std::size_t read_size = 64 * 1024;  // as a stream's driver reads

Value pose(std::size_t joints) {
  return Structure{"experimental.loopback.Pose",
                   {{"x", Value(1.0)}, {"joints", Value(std::vector<double>(joints, 2.0))}}};
}

/// Carries a pose to the service and another back.
void exchange(Loopback& pair, std::size_t joints) {
  pair.client->set_property("arm", "pose", pose(joints), pair.now);
  pair.pump(read_size);
  pair.service->reply(pair.next_service<Called>().id, Value{}, pair.now);
  pair.pump(read_size);
  REQUIRE(pair.next_client<Completed>().result);
  pair.client->get_property("arm", "pose", pair.now);
  pair.pump(read_size);
  pair.service->reply(pair.next_service<Called>().id, pose(joints), pair.now);
  pair.pump(read_size);
  REQUIRE(pair.next_client<Completed>().result);
}

}  // namespace

TEST_CASE("what a large message took on both sides of a session is given back") {
  Loopback pair;
  pair.connect();
  exchange(pair, 10);
  const auto before = live_bytes;
  exchange(pair, 900'000);  // 7.2 MB each way
  CHECK(live_bytes <= before + 64 * 1024);
}

TEST_CASE("a client parses a definition once") {
  std::string text = "service test.large\nobject Large\n";
  for (int i = 0; i < 1000; ++i) text += "  property double number_of_something_" + std::to_string(i) + "\n";
  text += "end\n";
  const auto types = std::make_shared<TypeRegistry>();
  auto before = allocation_count;
  REQUIRE(types->add({text}, RobdefMode::compat));
  const auto once = allocation_count - before;

  Loopback pair;
  pair.directory.add(HostedService::make("large", std::make_shared<PlainObject>("test.large.Large"), types).value())
      .value();
  ClientOptions options;
  options.connection.self = {client_id, "test.client"};
  options.service = "large";
  pair.client = std::make_unique<ClientSession>(options, pair.now);
  before = allocation_count;
  pair.connect();
  CHECK(allocation_count - before < once + once / 10);
}

TEST_CASE("small answers that nobody reads are counted with all that they take of the memory") {
  Loopback pair;
  constexpr std::size_t limit = 2'000'000;
  ServiceSessionOptions options;
  options.connection.max_queued_bytes = limit;
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.connect();
  const auto before = live_bytes;
  std::size_t most = 0;
  while (!pair.service->wants_close()) {
    const auto waited = pair.service->queued_bytes();
    pair.client->call_function("arm", "stop", {}, pair.now);
    pair.carry(*pair.client, *pair.service, read_size);
    pair.service->reply(pair.next_service<Called>().id, Value{}, pair.now);
    most = std::max(most, live_bytes - before);
    REQUIRE((pair.service->wants_close() || pair.service->queued_bytes() > waited));
  }
  // The client's open requests are among it, and buffers that grow by doubling.
  CHECK(most < 2 * limit);
}

TEST_CASE("calls that follow one another allocate nothing on either side") {
  Loopback pair;
  pair.connect();
  Bytes buffer;
  buffer.reserve(read_size);
  const auto carry = [&](auto& from, auto& to) {
    buffer.clear();
    for (const auto slice : from.poll_transmit()) buffer.insert(buffer.end(), slice.begin(), slice.end());
    from.handle_transmitted(buffer.size(), pair.now);
    to.handle_bytes(buffer, pair.now);
  };
  const auto call = [&] {
    pair.client->call_function("arm", "stop", {}, pair.now);
    carry(*pair.client, *pair.service);
    pair.service->reply(pair.next_service<Called>().id, Value{}, pair.now);
    carry(*pair.service, *pair.client);
    return pair.next_client<Completed>().result.has_value();
  };
  for (int i = 0; i < 100; ++i) REQUIRE(call());
  bool is_ok = true;
  const auto before = allocation_count;
  for (int i = 0; i < 100; ++i) is_ok = call() && is_ok;
  CHECK(allocation_count == before);
  CHECK(is_ok);
}
