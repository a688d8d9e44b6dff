// What waits for a slow client of a JSON WebSocket, as subscriptions begin, end and use ids again.
#include "server/limits/outbox.hpp"

#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>

using namespace rrgate;
using Texts = std::vector<std::string>;

namespace {

struct Waiting {
  boost::asio::io_context io;
  MemoryBudget budget{1'000'000};
  std::shared_ptr<Outbox> outbox = std::make_shared<Outbox>(io.get_executor(), budget.charge("one"), "too slow");

  void add_newest(const OutboxOpening& opening, std::string text, std::size_t bytes = 0) {
    outbox->add_newest(opening.token(), bytes, [text = std::move(text)] { return text; });
  }
};

}  // namespace

TEST_CASE("subscriptions that begin and end leave no value behind for a client that does not read") {
  Waiting w;
  const auto value = std::make_shared<const int>(1);
  for (int i = 0; i < 1000; ++i) {
    const OutboxOpening opening(w.outbox);
    w.outbox->add_newest(opening.token(), 100, [value] { return std::to_string(*value); });
    CHECK(w.budget.used() == 100);
  }
  CHECK(value.use_count() == 1);
  CHECK(w.outbox->is_empty());
  CHECK(w.budget.used() == 0);
}

TEST_CASE("what a waiting value keeps is counted until it is sent") {
  Waiting w;
  const OutboxOpening opening(w.outbox);
  w.add_newest(opening, "first", 5000);
  CHECK(w.budget.used() == 5000);
  w.add_newest(opening, "second", 300);
  CHECK(w.budget.used() == 300);
  CHECK(w.outbox->take() == Texts{"second"});
  CHECK(w.budget.used() == 6);
  w.outbox->note_sent();
  CHECK(w.budget.used() == 0);
  w.add_newest(opening, "third", 70);
  w.outbox->close();
  CHECK(w.budget.used() == 0);
}

TEST_CASE("a value of a new subscription takes no place of one that had its id before") {
  Waiting w;
  auto first = std::make_unique<OutboxOpening>(w.outbox);
  w.add_newest(*first, "of the first");
  const auto ended = first->token();
  first.reset();
  w.outbox->add("both answers");
  const OutboxOpening second(w.outbox);
  CHECK(second.token() != ended);
  w.add_newest(second, "of the second");
  w.outbox->add_newest(ended, 0, [] { return "too late"; });
  w.outbox->add(ended, "too late");
  CHECK(w.outbox->take() == Texts{"both answers", "of the second"});
}

TEST_CASE("a value that comes after an outage is sent after the news of it") {
  Waiting w;
  const OutboxOpening opening(w.outbox);
  const OutboxOpening other(w.outbox);
  w.add_newest(opening, "before");
  w.add_newest(other, "of another wire");
  w.outbox->add(opening.token(), "lost");
  w.outbox->add(opening.token(), "connected");
  w.add_newest(opening, "stale");
  w.add_newest(opening, "after");
  CHECK(w.outbox->take() == Texts{"of another wire", "lost", "connected", "after"});
  CHECK(w.outbox->is_empty());
}

TEST_CASE("a client that is too slow has one message left, whatever else waits") {
  Waiting w;
  const OutboxOpening opening(w.outbox);
  w.add_newest(opening, "value", 10);
  w.outbox->add(std::string(900'000, 'x'));
  CHECK(w.outbox->has_overflown());
  w.add_newest(opening, "value", 10);
  const auto left = w.outbox->take();
  REQUIRE(left.size() == 1);
  CHECK_THAT(left.front(), Catch::Contains("too slow"));
}
