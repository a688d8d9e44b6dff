// What is paid for clients and objects that have nothing to do with what a device does, and for a call: allocations,
// and values that are handed out. Service and clients run on one loop.
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "node/client/client_connection.hpp"
#include "node/service/node.hpp"
#include "test/support/count_allocations.hpp"

using namespace rr;
using namespace rr::test;

namespace {

constexpr const char* definition = R"(service test.plant
stdver 0.10
object Part
    wire double level [readonly]
end
object Plant
    wire double level [readonly]
    function void nothing()
    objref Part{int32} parts
end
)";

class Plant {
 public:
  Plant() : node_(io_, "test.plant") {
    service->objref("parts", [this](std::string_view index) {
      const auto part = service->make_object("Part");
      parts.push_back(part);
      part->set_wire("level", std::stod(std::string(index)));
      return part;
    });
    service->function("nothing", [] {});
    service->set_wire("level", 0.0);
    node_.add(service);
    port_ = node_.listen("rr+tcp://127.0.0.1:0");
  }
  ~Plant() {
    for (const auto& client : clients) client->disconnect();
    node_.stop();
    io_.restart();
    io_.run_for(std::chrono::seconds(2));
  }

  void run_until(const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!is_so() && std::chrono::steady_clock::now() < end) {
      io_.restart();
      io_.run_one_for(std::chrono::milliseconds(50));
    }
    REQUIRE(is_so());
  }
  ClientConnection& connect() {
    const auto before = clients.size();
    const auto url = "rr+tcp://127.0.0.1:" + std::to_string(port_) + "/?service=plant";
    opening_ = ClientConnection::open(io_, url, {}, [this](Result<std::shared_ptr<ClientConnection>> opened) {
      if (opened) clients.push_back(*opened);
    });
    run_until([&] { return clients.size() > before; });
    return *clients.back();
  }
  void call_nothing(ClientConnection& client) {
    bool is_done = false;
    client.call("plant", "nothing", {}, [&](const Result<Value>& result) { is_done = result.has_value(); });
    while (!is_done && io_.run_one() > 0) continue;
  }
  std::string find_part(ClientConnection& client, std::size_t index) {
    const auto path = "plant.parts[" + std::to_string(index) + "]";
    std::optional<Result<Value>> found;
    client.find_object(path, [&](Result<Value> result) { found = std::move(result); });
    run_until([&] { return found.has_value(); });
    REQUIRE(found->has_value());
    return path;
  }
  /// Finds so many objects, and connects the wire of each.
  void follow_parts(ClientConnection& client, std::size_t count) {
    std::size_t joined = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto path = find_part(client, i);
      client.connect_wire(
          path, "level",
          [this](const Value& value, TimeSpec) {
            ++values;
            newest = value.to<double>().value();
          },
          [&](const Result<Value>& done) { joined += done ? 1 : 0; });
    }
    run_until([&] { return joined == count; });
  }

  std::shared_ptr<Service> service = Service::from_text({definition}, "plant", "Plant");
  std::vector<std::shared_ptr<Object>> parts;
  std::vector<std::shared_ptr<ClientConnection>> clients;
  std::size_t values = 0;  ///< that clients were handed
  double newest = 0;       ///< of them

 private:
  boost::asio::io_context io_{1};
  Node node_;
  std::uint16_t port_ = 0;
  std::shared_ptr<ClientOpening> opening_;
};

/// What a hundred values of a wire allocate, without those of the first one.
std::size_t cost_of(Object& object) {
  object.set_wire("level", 0.5);
  const auto before = allocation_count;
  for (int i = 0; i < 100; ++i) object.set_wire("level", 0.5);
  return allocation_count - before;
}

}  // namespace

TEST_CASE("a value of a wire that nobody follows costs the same with one client and with a hundred") {
  Plant plant;
  plant.connect();
  const auto with_one = cost_of(plant.service->root());
  while (plant.clients.size() < 100) plant.connect();
  CHECK(cost_of(plant.service->root()) == with_one);
}

TEST_CASE("a value of one object costs the same where its client follows 4,000 others, and reaches nobody else") {
  Plant plant;
  auto& client = plant.connect();
  plant.follow_parts(client, 1);
  plant.run_until([&] { return plant.values >= 1; });
  const auto alone = cost_of(*plant.parts.front());
  constexpr std::size_t count = 4000;
  Plant full;
  auto& other = full.connect();
  full.follow_parts(other, count);
  full.run_until([&] { return full.values >= count; });
  CHECK(cost_of(*full.parts.front()) == alone);
  const auto set_and_wait = [&](Object& object, double value) {
    object.set_wire("level", value);
    full.run_until([&] { return full.newest == value; });
  };
  set_and_wait(*full.parts.front(), -1.0);  // behind whatever is on its way
  full.values = 0;
  set_and_wait(*full.parts.back(), -2.0);
  CHECK(full.values == 1);
}

TEST_CASE("a value of a wire costs no more than one text for each path of its object") {
  Plant plant;
  auto& client = plant.connect();
  const auto part = plant.service->make_object("Part");
  plant.service->objref("parts", [&](std::string_view) { return part; });
  plant.find_part(client, 1000);
  const auto by_one = cost_of(*part);
  for (std::size_t i = 1; i <= 64; ++i) plant.find_part(client, 1000 + i);
  CHECK((cost_of(*part) - by_one) / 100 < 2 * 64);
}

TEST_CASE("an empty call allocates less than twice on both sides together, once a few were made") {
  Plant plant;
  auto& client = plant.connect();
  for (int i = 0; i < 100; ++i) plant.call_nothing(client);
  const auto before = allocation_count;
  for (int i = 0; i < 1000; ++i) plant.call_nothing(client);
  CHECK((allocation_count - before) / 1000 < 2);
}
