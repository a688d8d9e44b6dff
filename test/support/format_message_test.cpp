#include "test/support/format_message.hpp"

#include <catch2/catch.hpp>

#include "core/wire/codec.hpp"
#include "test/core/wire/vectors.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

std::string format_vector(const std::string& name) {
  const auto& vector = message_vector(name);
  Message message;
  REQUIRE(decode(vector.bytes, {.string_table = vector.string_table}, message));
  return format_message(message);
}

}  // namespace

TEST_CASE("recorded messages read as one line") {
  CHECK(format_vector("property_get_request_v2") == "v2 | ep 1>2000 | PropertyGetReq path=svc member=d1 req=5");
  CHECK(format_vector("stringtable_both_wire_v4") ==
        "v4 | (no routing) | WirePacket path=svc member=w1 meta=\"unreliable\\n\" "
        "{packettime:structure<RobotRaconteur.TimeSpec>{seconds:int64=[1700000000], nanoseconds:int32=[500]}, "
        "packet:double=[1.5]}");
  CHECK(format_vector("stringtable_both_error_v4") ==
        "v4 | (no routing) | FunctionCallRes path=svc member=f1 req=9 ERROR 19 OperationFailed "
        "{errorname:string=\"RobotRaconteur.OperationFailed\", errorstring:string=\"boom\"}");
  CHECK(format_vector("stringtable_both_list_v4") ==
        "v4 | (no routing) | PropertyGetRes path=svc member=d1 req=5 {value:list{#0:string=\"x\", #1:void=null}}");
  CHECK(format_vector("two_entries_v4") ==
        "v4 | ep 1>2000 | PropertyGetReq path=svc member=d1 req=1 | FunctionCallReq path=svc.o1 member=f1 req=2 "
        "{a:double=[1.0]}");
  CHECK(format_vector("entry_unknown_type_v4") == "v4 | ep 1>2000 | 9999 path=svc member=d1 req=5");
  CHECK(format_vector("zero_entries_v4") == "v4 | ep 1>2000");
}

TEST_CASE("items of every type show") {
  const auto value_of = [](const std::string& name) {
    const auto line = format_vector(name);
    return line.substr(line.find('=', line.find("{value:")) + 1);
  };
  CHECK(value_of("scalar_int8_min_v4") == "[-128]}");
  CHECK(value_of("scalar_uint16_max_v4") == "[65535]}");
  CHECK(value_of("scalar_int64_min_v4") == "[-9223372036854775808]}");
  CHECK(value_of("scalar_uint64_max_v4") == "[18446744073709551615]}");
  CHECK(value_of("scalar_double_pi_v4") == "[3.141592653589793]}");
  CHECK(value_of("scalar_double_minus_zero_v4") == "[-0.0]}");
  CHECK(value_of("scalar_double_highest_v4") == "[1.7976931348623157e+308]}");
  CHECK(value_of("scalar_double_nan_payload_v4") == "[NaN]}");
  CHECK(value_of("scalar_single_minus_inf_v4") == "[-Infinity]}");
  CHECK(value_of("scalar_single_pi_v4") == "[3.1415927]}");
  CHECK(value_of("scalar_cdouble_v4") == "[[1.0, -2.0]]}");
  CHECK(value_of("scalar_csingle_v4") == "[[1.0, -2.0]]}");
  CHECK(value_of("array_bool_v4") == "[true, false, false, true, true]}");
  CHECK(value_of("array_int32_empty_v4") == "[]}");
  CHECK(value_of("string_newlines_v4").find('\n') == std::string::npos);
}

TEST_CASE("numbers of ordinary size are written without an exponent") {
  Message message;
  message.begin_entry(EntryType::null, "", "");
  for (const double value : {10.0, 123456789.0, 0.1, 0.00125, 1e15, 1e16, 1e-7})
    message.add_scalar("x", DataType::double_t, value);
  CHECK(format_message(message) ==
        "v4 | ep 0>0 | Null {x:double=[10.0], x:double=[123456789.0], x:double=[0.1], x:double=[0.00125], "
        "x:double=[1000000000000000.0], x:double=[1e+16], x:double=[1e-07]}");
}

TEST_CASE("long texts, arrays and lists are cut and say so") {
  Message message;
  message.begin_entry(EntryType::null, "", "");
  message.add_text("text", "0123456789");
  message.add("array", DataType::uint8_t, 5, message.store(ByteSpan(Bytes{1, 2, 3, 4, 5})));
  message.begin_nested("list", DataType::list_t);
  for (int i = 0; i < 5; ++i) message.add_numbered(i, DataType::void_t, 0, {});
  message.end_nested();
  message.add_text("fourth", "");
  CHECK(format_message(message, {.max_items = 3, .max_text = 6}) ==
        "v4 | ep 0>0 | Null {text:string=\"012345...\", array:uint8=[1, 2, 3, ...], "
        "list:list{#0:void=null, #1:void=null, #2:void=null...}...}");
  const auto shortened = format_message(message, {.max_size = 30});
  CHECK(shortened.size() <= 33);
  CHECK(shortened.substr(shortened.size() - 3) == "...");
}

TEST_CASE("credentials do not show") {
  Message message;
  message.begin_entry(EntryType::connect_client_combined, "svc", "", 1);
  message.add_text("username", "alice");
  message.begin_nested("credentials", DataType::map_string_t);
  message.add_text("password", "secret");
  message.add_text("token", "secret");
  message.end_nested();
  message.add_text("password", "secret");
  CHECK(format_message(message) ==
        "v4 | ep 0>0 | ConnectClientCombined path=svc req=1 {username:string=\"alice\", "
        "credentials:dictionary{password:string=***, token:string=***}, password:string=***}");
}

TEST_CASE("names cannot break the line") {
  Message message;
  message.begin_entry(EntryType::null, "a\nb", "c\x1b");
  message.add_text("d\r", "e");
  CHECK(format_message(message) == "v4 | ep 0>0 | Null path=a\\nb member=c\\u001b {d\\u000d:string=\"e\"}");
}

TEST_CASE("one element is formatted with its descendants only") {
  Message message;
  message.begin_entry(EntryType::null, "", "");
  message.begin_nested("s", DataType::structure_t, "t.S");
  message.add_text("x", "quote \" and \x01");
  message.end_nested();
  message.add_text("after", "");
  CHECK(format_element(message, message.elements[0]) == "s:structure<t.S>{x:string=\"quote \\\" and \\u0001\"}");
}
