#include "core/robdef/model/constant_value.hpp"

#include <catch2/catch.hpp>
#include <clocale>
#include <cmath>
#include <limits>

#include "core/robdef/model/names.hpp"
#include "core/robdef/parse/statement.hpp"

namespace rr::test {

namespace {

TypeDefinition type_of(std::string_view word, ArrayKind array = ArrayKind::none, std::int32_t size = 0) {
  TypeDefinition type;
  type.type = builtin_type(word);
  if (type.type == DataType::namedtype_t) type.name = word;
  type.array = array;
  if (array == ArrayKind::fixed || array == ArrayKind::max) type.sizes = {size};
  return type;
}

Result<ConstantValue> strict(const TypeDefinition& type, std::string_view text) {
  return parse_constant_value(type, text, RobdefMode::strict);
}

Result<ConstantValue> compat(const TypeDefinition& type, std::string_view text) {
  return parse_constant_value(type, text, RobdefMode::compat);
}

double real(std::string_view word, std::string_view text) {
  const auto value = strict(type_of(word), text);
  REQUIRE(value.has_value());
  return std::get<std::vector<double>>(value->data).at(0);
}

std::string string_of(std::string_view text, RobdefMode mode = RobdefMode::strict) {
  const auto value = parse_constant_value(type_of("string"), text, mode);
  REQUIRE(value.has_value());
  return std::get<std::string>(value->data);
}

}  // namespace

TEST_CASE("integers keep to the range of their type", "[robdef]") {
  struct Case {
    const char* word;
    const char* lowest;
    const char* too_low;
    const char* highest;
    const char* too_high;
  };
  for (const auto& item : {
           Case{"int8", "-128", "-129", "127", "128"},
           Case{"uint8", "0", "-1", "255", "256"},
           Case{"int16", "-0x8000", "-0x8001", "0x7fff", "0x8000"},
           Case{"uint16", "-0", "-1", "0xFFFF", "65536"},
           Case{"int32", "-2147483648", "-2147483649", "2147483647", "2147483648"},
           Case{"uint32", "+0", "-1", "4294967295", "0x100000000"},
           Case{"int64", "-9223372036854775808", "-9223372036854775809", "9223372036854775807", "9223372036854775808"},
           Case{"uint64", "0", "-1", "18446744073709551615", "18446744073709551616"},
       }) {
    INFO(item.word);
    const auto type = type_of(item.word);
    CHECK(strict(type, item.lowest).has_value());
    CHECK(strict(type, item.highest).has_value());
    CHECK(strict(type, item.too_low).has_error());
    CHECK(strict(type, item.too_high).has_error());
    CHECK(compat(type, item.too_high).has_error());
  }
  CHECK(std::get<std::vector<std::int64_t>>(strict(type_of("int64"), "-9223372036854775808")->data).at(0) ==
        std::numeric_limits<std::int64_t>::min());
  CHECK(std::get<std::vector<std::uint64_t>>(strict(type_of("uint64"), "0xffffffffffffffff")->data).at(0) ==
        std::numeric_limits<std::uint64_t>::max());
  CHECK(strict(type_of("int16"), "70000").error().message ==
        "constant value: found '70000', expected -32768 to 32767 for int16");
}

TEST_CASE("negative unsigned constants wrap in compat mode", "[robdef]") {
  CHECK(std::get<std::vector<std::uint64_t>>(compat(type_of("uint32"), "-1")->data).at(0) == 0xffffffffu);
  CHECK(std::get<std::vector<std::uint64_t>>(compat(type_of("uint64"), "-2")->data).at(0) == 0xfffffffffffffffeu);
  CHECK(compat(type_of("uint32"), "-4294967296").has_error());
}

TEST_CASE("malformed numbers are refused", "[robdef]") {
  for (const auto* text : {"", "-", "00", "01", "1.0", "1e3", "0x", "0X1", "0xg", "1 2", "--1", "five", "+ 1", "1,"}) {
    INFO(text);
    CHECK(strict(type_of("int32"), text).has_error());
  }
  for (const auto* text :
       {"", ".", "-", "00.5", "0x1", "nan", "inf", "-inf", "1e", "1e+", "e5", "1.5f", "1..2", "1 2"}) {
    INFO(text);
    CHECK(strict(type_of("double"), text).has_error());
  }
}

TEST_CASE("real numbers round once, in their own width", "[robdef]") {
  CHECK(real("double", "2.5") == 2.5);
  CHECK(real("double", "5.") == 5.0);
  CHECK(real("double", "-.5e1") == -5.0);
  CHECK(real("double", "0.1") == 0.1);
  CHECK(real("double", "+1E-3") == 1e-3);
  CHECK(std::signbit(real("double", "-0")));
  CHECK(real("double", "1.7976931348623157e308") == std::numeric_limits<double>::max());
  CHECK(real("double", "1e-400") == 0.0);
  CHECK(real("double", "5e-324") == std::numeric_limits<double>::denorm_min());
  CHECK(strict(type_of("double"), "1e309").has_error());
  CHECK(real("single", "0.1") == static_cast<double>(0.1f));
  CHECK(real("single", "3.4028235677973365e38") == static_cast<double>(std::numeric_limits<float>::max()));
  CHECK(strict(type_of("single"), "3.4028235677973367e38").has_error());
  // Just above the middle of two singles; through double it would land on the middle and round down to even.
  CHECK(real("single", "1.00000005960464477540") == static_cast<double>(std::nextafterf(1.0f, 2.0f)));
}

TEST_CASE("real numbers of any length", "[robdef]") {
  CHECK(real("double", "0." + std::string(5000, '0') + "1e5001") == 1.0);
  CHECK(real("double", "1" + std::string(5000, '0') + "e-5000") == 1.0);
  CHECK(real("double", "1." + std::string(100000, '0') + "1") == 1.0);
  CHECK(real("double", "1e-99999999999999999999") == 0.0);
  CHECK(strict(type_of("double"), "1e99999999999999999999").has_error());
  CHECK(real("double", "0e99999999999999999999") == 0.0);
  // 2^53 + 1 is the middle of two doubles: the last digit decides.
  CHECK(real("double", "9007199254740993." + std::string(2000, '0')) == 9007199254740992.0);
  CHECK(real("double", "9007199254740993." + std::string(2000, '0') + "1") == 9007199254740994.0);
}

TEST_CASE("real numbers do not depend on the locale", "[robdef]") {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  for (const auto* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8", "C"}) {
    if (std::setlocale(LC_ALL, name) == nullptr) continue;
    CHECK(real("double", "2.5") == 2.5);
  }
  std::setlocale(LC_ALL, before.c_str());
}

TEST_CASE("array constants", "[robdef]") {
  const auto open = type_of("int32", ArrayKind::variable);
  const auto value = strict(open, "{ 1 ,0x2,-3 }");
  REQUIRE(value.has_value());
  CHECK(value->is_array);
  CHECK(std::get<std::vector<std::int64_t>>(value->data) == std::vector<std::int64_t>{1, 2, -3});
  CHECK(std::get<std::vector<std::int64_t>>(strict(open, "{}")->data).empty());
  for (const auto* text : {"{1,}", "{,1}", "{1,,2}", "{1 2}", "{1", "1", "{1} x", "{ , }"}) {
    INFO(text);
    CHECK(strict(open, text).has_error());
    CHECK(compat(open, text).has_error());
  }
  CHECK(strict(type_of("double", ArrayKind::fixed, 2), "{1, 2}").has_value());
  CHECK(strict(type_of("double", ArrayKind::fixed, 2), "{1}").has_error());
  CHECK(compat(type_of("double", ArrayKind::fixed, 2), "{1}").has_value());
  CHECK(strict(type_of("double", ArrayKind::max, 2), "{1}").has_value());
  CHECK(strict(type_of("double", ArrayKind::max, 2), "{1,2,3}").has_error());
}

TEST_CASE("string constants", "[robdef]") {
  CHECK(string_of(R"("")").empty());
  CHECK(string_of(R"("a # {b}")") == "a # {b}");
  CHECK(string_of(R"("\"\\\/\b\f\n\r\t")") == "\"\\/\b\f\n\r\t");
  CHECK(string_of(R"("\u0041\u00e9\u20AC\ud83d\ude00")") == "A\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80");
  CHECK(string_of(R"("a\u0000b")") == std::string("a\0b", 3));
  for (const auto* text :
       {R"(a)", R"(")", R"("a)", R"("a"b)", R"("\x41")", R"("\u12")", R"("\u12g4")", R"("\)", R"("\")"}) {
    INFO(text);
    CHECK(strict(type_of("string"), text).has_error());
    CHECK(compat(type_of("string"), text).has_error());
  }
  for (const auto* text : {R"("\ud83d")", R"("\ude00!")", R"("\ud83d\u0041")", "\"a\tb\""}) {
    INFO(text);
    CHECK(strict(type_of("string"), text).has_error());
    CHECK(compat(type_of("string"), text).has_value());
  }
  CHECK(string_of(R"("\ud83d\u0041")", RobdefMode::compat) == "A");
}

TEST_CASE("struct constants", "[robdef]") {
  const auto value = strict(type_of("struct"), "{low : LOW,high:HIGH }");
  REQUIRE(value.has_value());
  CHECK(std::get<std::vector<ConstantField>>(value->data) ==
        std::vector<ConstantField>{{"low", "LOW"}, {"high", "HIGH"}});
  CHECK(std::get<std::vector<ConstantField>>(strict(type_of("Range"), "{}")->data).empty());
  for (const auto* text : {"{a}", "{a:}", "{a:B,}", "{a:1}", "{_a:B}", "{a:B} c", "1"}) {
    INFO(text);
    CHECK(strict(type_of("struct"), text).has_error());
  }
  CHECK(strict(type_of("struct"), "{a:B,a:B}").has_error());
  CHECK(compat(type_of("struct"), "{a:B,a:B}").has_value());
}

TEST_CASE("types that no constant has", "[robdef]") {
  for (const auto* word : {"bool", "cdouble", "csingle", "void", "object", "varobject", "varvalue", "structure"}) {
    INFO(word);
    CHECK(compat(type_of(word), "1").has_error());
    CHECK(compat(type_of(word), "{}").has_error());
  }
  CHECK(compat(type_of("int32", ArrayKind::multidim), "{1}").has_error());
  CHECK(compat(type_of("string", ArrayKind::variable), "\"a\"").has_error());
  auto list = type_of("string");
  list.container = ContainerKind::list;
  CHECK(strict(list, "\"a\"").has_error());
  CHECK(compat(list, "\"a\"").has_value());
}

TEST_CASE("constants of the old form", "[robdef]") {
  const auto constants = option_constants({{"constant int16 DRIVE.STRAIGHT 32767", 4},
                                           {"version 0.5", 5},
                                           {"constantly 5", 6},
                                           {"constant int16 BAD x", 7},
                                           {"constant string S \"a b\"", 8}});
  REQUIRE(constants.size() == 2);
  CHECK(constants[0].name == "DRIVE_STRAIGHT");
  CHECK(constants[0].value_text == "32767");
  CHECK(constants[0].line == 4);
  CHECK(constants[1].value_text == "\"a b\"");
}

}  // namespace rr::test
