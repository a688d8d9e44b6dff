#include "node/values/handler.hpp"

#include <catch2/catch.hpp>

using namespace rr;

namespace {

enum class Color : std::int32_t { red = 1, blue = 7 };

TypeDefinition type_of(DataType type, ArrayKind array = ArrayKind::none) {
  TypeDefinition definition;
  definition.type = type;
  definition.array = array;
  return definition;
}

template <class... Args>
Result<Value> call(Handler& handler, Args... arguments) {
  const std::array<Value, sizeof...(Args)> values{Value(arguments)...};
  return handler.call(values);
}

}  // namespace

TEST_CASE("a handler's types are deduced") {
  const Handler handler = make_plain_handler(
      [](std::int16_t, const std::string&, std::vector<double>, bool, Color, const Value&) { return 1.5f; });
  std::vector<std::string> texts;
  for (const auto& parameter : handler.parameters) texts.push_back(handler_type_text(parameter));
  CHECK(texts == std::vector<std::string>{"int16", "string", "double[]", "bool", "int32", "any value"});
  CHECK(handler_type_text(handler.result) == "single");
  CHECK(handler_type_text(make_plain_handler([] {}).result) == "nothing");
}

TEST_CASE("arguments are converted, results become values") {
  Handler add = make_plain_handler([](std::int32_t a, double b) { return a + b; });
  CHECK(call(add, std::int32_t{2}, 0.5).value() == Value(2.5));

  Handler name = make_plain_handler([](std::string_view first, const std::vector<std::uint8_t>& bytes) {
    return std::string(first) + std::to_string(bytes.size());
  });
  CHECK(call(name, "x", std::vector<std::uint8_t>{1, 2, 3}).value() == Value("x3"));

  Handler next = make_plain_handler([](Color color) { return color == Color::red ? Color::blue : Color::red; });
  CHECK(call(next, std::int32_t{1}).value() == Value(std::int32_t{7}));

  int calls = 0;
  Handler count = make_plain_handler([&calls] { ++calls; });
  CHECK(call(count).value().is_null());
  CHECK(calls == 1);
}

TEST_CASE("wrong arguments are errors and the handler is not called") {
  int calls = 0;
  Handler handler = make_plain_handler([&calls](std::int16_t) { ++calls; });
  CHECK(call(handler, "text").error().code == ErrorCode::data_type_mismatch);
  CHECK(call(handler, std::int32_t{40'000}).error().code == ErrorCode::out_of_range);
  CHECK(call(handler).error().code == ErrorCode::invalid_argument);
  CHECK(calls == 0);
}

TEST_CASE("parameters may widen and nothing else") {
  const auto accepted = [](HandlerType handler, TypeDefinition type) { return accepts(handler, type); };
  CHECK(accepted({DataType::int16_t, false}, type_of(DataType::int16_t)));
  CHECK(accepted({DataType::int32_t, false}, type_of(DataType::int16_t)));
  CHECK(accepted({DataType::int32_t, false}, type_of(DataType::uint16_t)));
  CHECK(accepted({DataType::double_t, false}, type_of(DataType::single_t)));
  CHECK(accepted({DataType::int32_t, false}, type_of(DataType::enum_t)));
  CHECK(accepted({DataType::varvalue_t, false}, type_of(DataType::structure_t)));
  CHECK(accepted({DataType::double_t, true}, type_of(DataType::double_t, ArrayKind::fixed)));

  CHECK_FALSE(accepted({DataType::int16_t, false}, type_of(DataType::int32_t)));
  CHECK_FALSE(accepted({DataType::uint16_t, false}, type_of(DataType::int8_t)));
  CHECK_FALSE(accepted({DataType::uint32_t, false}, type_of(DataType::int32_t)));
  CHECK_FALSE(accepted({DataType::double_t, false}, type_of(DataType::int32_t)));
  CHECK_FALSE(accepted({DataType::string_t, false}, type_of(DataType::int32_t)));
  CHECK_FALSE(accepted({DataType::int16_t, true}, type_of(DataType::int16_t)));
  CHECK_FALSE(accepted({DataType::int32_t, true}, type_of(DataType::int16_t, ArrayKind::variable)));
  CHECK_FALSE(accepted({DataType::double_t, true}, type_of(DataType::double_t, ArrayKind::multidim)));
  TypeDefinition list = type_of(DataType::double_t);
  list.container = ContainerKind::list;
  CHECK_FALSE(accepted({DataType::double_t, false}, list));
}

TEST_CASE("results are of the same family") {
  CHECK(returns({DataType::int32_t, false}, type_of(DataType::uint8_t)));
  CHECK(returns({DataType::void_t, false}, type_of(DataType::void_t)));
  CHECK_FALSE(returns({DataType::int32_t, false}, type_of(DataType::void_t)));
  CHECK_FALSE(returns({DataType::void_t, false}, type_of(DataType::int32_t)));
  CHECK_FALSE(returns({DataType::double_t, false}, type_of(DataType::int32_t)));
  CHECK_FALSE(returns({DataType::bool_t, false}, type_of(DataType::uint8_t)));
}
