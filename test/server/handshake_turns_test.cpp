#include "server/state/handshake_turns.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <memory>
#include <optional>
#include <vector>

using namespace rrgate;

namespace {

/// Clients whose handshakes take as long as they are kept.
struct Clients {
  boost::asio::io_context io;
  HandshakeTurns turns;
  std::vector<std::unique_ptr<HandshakeTurns::Turn>> all = {};
  std::vector<std::optional<bool>> have_come = {};  ///< nullopt: waits

  std::size_t come(const std::string& network, std::chrono::milliseconds timeout = std::chrono::hours(1)) {
    const auto number = all.size();
    all.push_back(std::make_unique<HandshakeTurns::Turn>(turns, network, io.get_executor()));
    have_come.resize(all.size());
    have_come[number].reset();
    boost::asio::co_spawn(
        io,
        [this, number, timeout]() -> rr::awaitable<void> { have_come[number] = co_await all[number]->come(timeout); },
        boost::asio::detached);
    run();
    return number;
  }
  void run() {
    io.restart();
    io.poll();
  }
};

}  // namespace

TEST_CASE("handshakes: few of one network at a time, the others in the order in which they came") {
  Clients clients;
  for (std::size_t i = 0; i < HandshakeTurns::most; ++i) CHECK(clients.have_come[clients.come("a")] == true);
  const auto second = clients.come("a");
  const auto third = clients.come("a");
  CHECK(clients.have_come[second] == std::nullopt);
  CHECK(clients.have_come[clients.come("b")] == true);
  clients.all[0].reset();
  clients.run();
  CHECK(clients.have_come[second] == true);
  CHECK(clients.have_come[third] == std::nullopt);
  clients.all[second].reset();
  clients.run();
  CHECK(clients.have_come[third] == true);
  clients.all.clear();
  for (std::size_t i = 0; i < HandshakeTurns::most; ++i) CHECK(clients.have_come[clients.come("a")] == true);
  clients.all.clear();
}

TEST_CASE("handshakes: who has waited too long, or is told to stop, gets no turn and takes none") {
  Clients clients;
  for (std::size_t i = 0; i < HandshakeTurns::most; ++i) clients.come("a");
  const auto late = clients.come("a", std::chrono::milliseconds(0));
  const auto stopped = clients.come("a");
  const auto patient = clients.come("a");
  clients.all[stopped]->cancel();
  clients.run();
  CHECK(clients.have_come[late] == false);
  CHECK(clients.have_come[stopped] == false);
  clients.all[0].reset();
  clients.run();
  CHECK(clients.have_come[late] == false);
  CHECK(clients.have_come[patient] == true);
  clients.all.clear();
}
