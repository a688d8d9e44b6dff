// A service of generated classes that does a little of everything. Test support.
// The definition: test/definitions/test.words.robdef.
#pragma once

#include "test/node/node/node_fixture.hpp"
#include "test__words.hpp"

namespace test::words {

using namespace rr;

class Friend : public interfaceService {
 public:
  explicit Friend(std::string name, std::shared_ptr<Friend> friend_of_it = nullptr)
      : name_(std::move(name)), friend_(std::move(friend_of_it)) {
    level(7);
  }

 private:
  double get_long() override { return long_; }
  void set_long(double value) override { long_ = value; }
  std::string who() override { return name_; }
  std::shared_ptr<baseService> get_parent() override { return friend_; }
  void set_level(std::int32_t value) override { level(value + 1); }
  void f() override {
    if (name_ == "left") throw delete_("it is gone", "why", Value(3));
    moved(5);
  }

  std::string name_;
  std::shared_ptr<Friend> friend_;
  double long_ = 0;
};

class Everything : public ObjectService {
 public:
  std::optional<union_> received_target;
  std::vector<std::string> lines;
  ClientId last_client = 0;
  std::shared_ptr<MemoryBuffer<double>> numbers = std::make_shared<MemoryBuffer<double>>();

 private:
  std::int32_t get_auto() override {
    last_client = rr_service().current_client();
    return auto_;
  }
  void set_auto(std::int32_t value) override { auto_ = value; }
  Nullable<switch_> get_switch_value() override { return switch__; }
  void set_switch_value(Nullable<switch_> value) override { switch__ = std::move(value); }
  void set_any(Value value) override { auto_ = value.to<std::int32_t>().value(); }
  enumeration get_goto() override { return static_cast<enumeration>(auto_); }
  std::vector<template_> get_pods() override { return pods_; }
  void set_pods(std::vector<template_> value) override { pods_ = std::move(value); }
  union_ get_point() override { return point_; }
  void set_point(union_ value) override { point_ = value; }

  double operator_(double in, std::string delete_, enumeration while_) override {
    explicit_(in, std::vector<std::string>{delete_, "more"});
    return in + static_cast<int>(while_);
  }
  void then(std::int32_t) override { throw more::thrown("other"); }
  std::string toString() override { throw std::runtime_error("no text"); }
  Nullable<switch_> constructor(Nullable<switch_> value, Value) override { return value; }
  void void_function(Map, Nullable<more::Shared> shared) override {
    if (!shared) throw Exception(make_error(ErrorCode::null_value, "nothing shared"));
    happened();
  }

  std::function<std::optional<std::int32_t>()> count(std::int32_t to) override {
    return [to, at = 0]() mutable { return at < to ? std::optional(at++) : std::nullopt; };
  }
  std::function<bool(std::string)> collect() override {
    return [this](const std::string& line) {
      if (line == "broken") throw delete_("it is broken");
      lines.push_back(line);
      return lines.size() < 2;
    };
  }
  std::function<std::optional<double>(double)> both_ways(double first) override {
    return [first](double next) { return next > 0 ? std::optional(first + next) : std::nullopt; };
  }
  std::shared_ptr<MemoryBuffer<double>> get_numbers() override { return numbers; }
  std::shared_ptr<MemoryBuffer<std::uint8_t>> get_image() override { return image_; }
  std::shared_ptr<MemoryBuffer<template_>> get_pod_memory() override { return pod_memory_; }
  std::shared_ptr<MemoryBuffer<union_>> get_points() override { return points_; }

  void set_samples(const PipeEndpoint& from, std::vector<double> packet) override {
    packet.push_back(from.index());
    if (!from.send(pack_value(packet))) throw std::runtime_error("the client reads too slowly");
  }
  void set_commands(const PipeEndpoint&, Value packet) override {
    Nullable<switch_> frame = switch_{};
    frame->anything = std::vector<Value>{packet};
    frames(frame);
  }

  std::shared_ptr<baseService> get_friend() override { return friend_; }
  std::shared_ptr<interfaceService> get_many(std::int32_t index) override {
    return index < 3 ? std::make_shared<Friend>("many " + std::to_string(index)) : nullptr;
  }
  std::shared_ptr<interfaceService> get_numbered(std::int32_t index) override {
    return std::make_shared<Friend>("number " + std::to_string(index));
  }
  std::shared_ptr<ObjectService> get_named(std::string) override { return std::make_shared<Everything>(); }
  std::shared_ptr<ServiceStub> get_whatever() override { return friend_; }
  void set_target(union_ value) override {
    received_target = value;
    position(value.this_one);
  }
  void set_status(Nullable<switch_> value) override { status(value); }

  std::shared_ptr<MemoryBuffer<std::uint8_t>> image_ =
      std::make_shared<MemoryBuffer<std::uint8_t>>(MemoryBuffer<std::uint8_t>{{2, 3}, {1, 2, 3, 4, 5, 6}});
  std::shared_ptr<MemoryBuffer<template_>> pod_memory_ =
      std::make_shared<MemoryBuffer<template_>>(MemoryBuffer<template_>{{2}, std::vector<template_>(2)});
  std::shared_ptr<MemoryBuffer<union_>> points_ =
      std::make_shared<MemoryBuffer<union_>>(MemoryBuffer<union_>{{2, 1}, std::vector<union_>(2)});
  std::int32_t auto_ = 0;
  Nullable<switch_> switch__;
  std::vector<template_> pods_;
  union_ point_;
  std::shared_ptr<Friend> friend_ = std::make_shared<Friend>("friend", std::make_shared<Friend>("left"));
};

inline template_ make_pod(std::int32_t number) {
  template_ pod;
  pod.new_ = number;
  pod.corners[1] = {{1.5, 2.5}, 3.5};
  pod.some = {1, 2, 3};
  pod.grid.data = {1, 2, 3, 4};
  pod.many[1999] = 7;
  pod.flag = true;
  return pod;
}

inline switch_ make_struct() {
  switch_ value;
  value.next = switch_{};
  value.next->enumeration = enumeration::private_;
  value.children = std::vector<Nullable<switch_>>{switch_{}, nullptr};
  value.by_name = std::map<std::string, Nullable<switch_>>{{"a", switch_{}}, {"b", nullptr}};
  value.shared = more::Shared{5};
  value.enumeration = enumeration::while_;
  value.pod_one = make_pod(1);
  value.pods = {make_pod(2), make_pod(3)};
  value.pod_grid = {{1, 2}, {make_pod(4), make_pod(5)}};
  value.held = {make_pod(6), {make_pod(7), make_pod(8)}, {make_pod(9)}};
  value.points = {{{1, 2}, 3}, {{4, 5}, 6}};
  value.point_grid = {{2, 1}, value.points};
  value.nest.b[1].this_one = 9;
  value.nests[1] = value.nest;
  value.by_number = std::map<std::int32_t, enumeration>{{-5, enumeration::while_}, {7, enumeration(99)}};
  value.complex_array = {{1, 2}, {3, 4}};
  value.complex_grid = {{1, 1}, {{5, 6}}};
  value.bools = {true, false, true};
  value.bool_grid = {{2, 1}, {false, true}};
  value.texts = std::vector<std::string>{"one", ""};
  value.grids = std::vector<MultiDim<std::int64_t>>{{{1, 2}, {3, -4}}};
  value.fixed_grid.data[5] = 0.5;
  value.anything = std::vector<Value>{Value(std::vector<std::int32_t>{1}), Value("text"), Value()};
  return value;
}

}  // namespace test::words
