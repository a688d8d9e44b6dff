#include "core/robdef/model/cycles.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/support/sort.hpp"

namespace rr {

namespace {

/// Tarjan's strongly connected components with a stack of its own. Components come dependencies first.
class ComponentSearch {
 public:
  explicit ComponentSearch(const Graph& graph) : graph_(graph), states_(graph.size()) {}

  std::vector<std::vector<std::size_t>> run() {
    for (std::size_t node = 0; node < graph_.size(); ++node) {
      if (states_[node].index == unvisited) visit(node);
    }
    return std::move(components_);
  }

 private:
  static constexpr std::size_t unvisited = std::numeric_limits<std::size_t>::max();

  struct State {
    std::size_t index = unvisited;
    std::size_t lowest = 0;
    std::size_t next_edge = 0;
    bool is_open = false;
  };

  void enter(std::size_t node) {
    states_[node].index = states_[node].lowest = count_++;
    states_[node].is_open = true;
    open_.push_back(node);
    path_.push_back(node);
  }

  void visit(std::size_t root) {
    enter(root);
    while (!path_.empty()) {
      const auto node = path_.back();
      auto& state = states_[node];
      if (state.next_edge < graph_[node].size()) {
        const auto target = graph_[node][state.next_edge++];
        if (states_[target].index == unvisited) {
          enter(target);
        } else if (states_[target].is_open) {
          state.lowest = std::min(state.lowest, states_[target].index);
        }
        continue;
      }
      path_.pop_back();
      if (!path_.empty()) states_[path_.back()].lowest = std::min(states_[path_.back()].lowest, state.lowest);
      if (state.lowest == state.index) close(node);
    }
  }

  void close(std::size_t first) {
    auto& component = components_.emplace_back();
    while (true) {
      const auto node = open_.back();
      open_.pop_back();
      states_[node].is_open = false;
      component.push_back(node);
      if (node == first) return;
    }
  }

  const Graph& graph_;
  std::vector<State> states_;
  std::vector<std::size_t> open_ = {};
  std::vector<std::size_t> path_ = {};
  std::size_t count_ = 0;
  std::vector<std::vector<std::size_t>> components_ = {};
};

}  // namespace

std::vector<std::vector<std::size_t>> find_cycles(const Graph& graph) {
  auto components = ComponentSearch(graph).run();
  const auto is_no_cycle = [&graph](const std::vector<std::size_t>& component) {
    const auto& edges = graph[component.front()];
    return component.size() == 1 && std::find(edges.begin(), edges.end(), component.front()) == edges.end();
  };
  components.erase(std::remove_if(components.begin(), components.end(), is_no_cycle), components.end());
  for (auto& component : components) rr::sort(component);
  rr::sort(components);
  return components;
}

std::vector<std::size_t> dependencies_first(const Graph& graph) {
  std::vector<std::size_t> order;
  order.reserve(graph.size());
  for (const auto& component : ComponentSearch(graph).run()) {
    order.insert(order.end(), component.begin(), component.end());
  }
  return order;
}

}  // namespace rr
