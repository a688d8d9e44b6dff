#include "core/support/fifo.hpp"

#include <catch2/catch.hpp>
#include <memory>
#include <unordered_map>

#include "core/support/spare_node.hpp"

using namespace rr;

TEST_CASE("items come out in the order in which they went in, however many wait") {
  Fifo<std::unique_ptr<int>> queue;
  CHECK_FALSE(queue.poll());
  int next_in = 0;
  int next_out = 0;
  for (int round = 0; round < 200; ++round) {
    for (int i = 0; i < round % 7; ++i) queue.push(std::make_unique<int>(next_in++));
    CHECK(queue.size() == static_cast<std::size_t>(next_in - next_out));
    if (!queue.empty()) CHECK(*queue.back() == next_in - 1);
    for (int i = 0; i < round % 5 && !queue.empty(); ++i) CHECK(**queue.poll() == next_out++);
  }
  while (auto item = queue.poll()) CHECK(**item == next_out++);
  CHECK(next_out == next_in);
  CHECK(queue.empty());
}

TEST_CASE("an item that comes after another has gone takes over its node") {
  using Map = std::unordered_map<int, std::shared_ptr<int>>;
  Map map;
  SpareNode<Map> spare;
  const auto value = std::make_shared<int>(7);
  spare.insert(map, 1, value);
  const auto* place = &map.at(1);
  CHECK(spare.take(map.extract(1)) == value);
  CHECK(value.use_count() == 1);  // the node keeps nothing of its item
  spare.insert(map, 2, value);
  CHECK(&map.at(2) == place);
  spare.insert(map, 3, value);
  CHECK(map.size() == 2);
}
