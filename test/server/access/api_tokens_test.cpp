#include "server/access/api_tokens.hpp"

#include <catch2/catch.hpp>

#include "server/access/access_text.hpp"

#include "test/support/print.hpp"

using namespace rrgate;

namespace {

std::chrono::system_clock::time_point at(std::string_view day) {
  return *parse_day(day);
}

}  // namespace

TEST_CASE("API tokens: made, kept as a hash, good until their last day") {
  const auto token = make_api_token();
  CHECK(token.size() == 4 + 43);
  CHECK(token != make_api_token());
  const auto file = "# robots of the lab\n\nci " + hash_api_token(token) + " operator,viewer 2030-06-30\n";
  CHECK(file.find(token) == std::string::npos);
  const auto tokens = ApiTokens::from_text(file);
  REQUIRE(tokens);
  CHECK(tokens->size() == 1);
  const auto found = tokens->verify(token, at("2030-06-30") + std::chrono::hours(23));
  REQUIRE(found);
  CHECK(found->name == "ci");
  CHECK(found->roles == std::vector<std::string>{"operator", "viewer"});
  CHECK(found->proof == Proof::token);
  const auto again = tokens->find(found->credential, at("2030-06-30"));
  REQUIRE(again);
  CHECK(*again == *found);
  CHECK_FALSE(tokens->find("", at("2030-06-30")));
  const auto late = tokens->verify(token, at("2030-07-01"));
  REQUIRE_FALSE(late);
  CHECK(late.error().code == rr::ErrorCode::authentication_error);
  CHECK_FALSE(tokens->verify(token + "x", at("2030-01-01")));
  CHECK_FALSE(tokens->verify("", at("2030-01-01")));
  CHECK_FALSE(tokens->verify(hash_api_token(token), at("2030-01-01")));
}

TEST_CASE("API tokens: a last day that the clock cannot count to is none") {
  const auto token = make_api_token();
  for (const auto* day : {"2262-04-10", "2262-04-11", "2262-04-12", "2300-01-01", "2900-06-01", "9999-12-31"}) {
    INFO(day);
    const auto tokens = ApiTokens::from_text("ci " + hash_api_token(token) + " operator " + day + "\n");
    REQUIRE(tokens);
    const auto found = tokens->verify(token, at("2030-01-01"));
    REQUIRE(found);
    CHECK(found->ends > at("2262-04-01"));
  }
  for (const auto* day : {"0000-01-01", "1600-01-01", "1677-09-20", "1970-01-01"}) {
    INFO(day);
    CHECK_FALSE(ApiTokens::from_text("ci " + hash_api_token(token) + " operator " + day + "\n")
                    ->verify(token, at("2030-01-01")));
  }
}

TEST_CASE("API tokens: what is wrong with a file") {
  const std::string hash(64, 'a');
  const auto problem = [](const std::string& text) {
    const auto tokens = ApiTokens::from_text(text);
    return tokens ? std::string("good") : tokens.error().message;
  };
  CHECK(problem("a " + hash + " _ _") == "good");
  CHECK_THAT(problem("\na " + hash + " _"), Catch::StartsWith("line 2: has 3 fields"));
  CHECK_THAT(problem("a secret _ _"), Catch::Contains("SHA-256") && !Catch::Contains("secret"));
  CHECK_THAT(problem("a " + std::string(64, 'A') + " _ _"), Catch::Contains("lower-case"));
  CHECK_THAT(problem("a " + hash + " _ 2030-02-30"), Catch::Contains("expected a day"));
  CHECK_THAT(problem("a " + hash + " x:y _"), Catch::Contains("role"));
}

TEST_CASE("days as text") {
  for (const auto* day : {"1970-01-01", "2028-02-29", "2030-12-31"}) CHECK(format_day(*parse_day(day)) == day);
  for (const auto* text : {"", "2030-1-1", "2030-13-01", "2029-02-29", "2030/01/01", "+030-01-01", "2030-01-01 ",
                           "2030-1x-01", "2030-01-1x"})
    CHECK_FALSE(parse_day(text));
}

TEST_CASE("lines of users and tokens: added, replaced, taken out; all others stay") {
  const std::string file = "# a\nalice h1 _\n\nbob h2 _\nalice h3 _";
  CHECK(find_line(file, "bob") == "bob h2 _");
  CHECK(find_line(file, "b").empty());
  CHECK(with_line(file, "alice", "alice new x") == "# a\nalice new x\n\nbob h2 _\n");
  CHECK(with_line(file, "carol", "carol h _") == file + "\ncarol h _\n");
  CHECK(with_line(file, "bob", "") == "# a\nalice h1 _\n\nalice h3 _\n");
  CHECK(with_line("", "a", "a h _") == "a h _\n");
  CHECK(*parse_roles("a,b") == std::vector<std::string>{"a", "b"});
  CHECK(parse_roles("_")->empty());
  CHECK_FALSE(parse_roles("a,b c"));
  CHECK_FALSE(check_name("user name", "a:b"));
  CHECK_FALSE(check_name("user name", "a b"));
  CHECK_FALSE(check_name("user name", ""));
  CHECK(check_name("user name", "alice@example.org"));
}
