#include "node/service/password_hash.hpp"

#include <catch2/catch.hpp>

#include "test/support/print.hpp"

using namespace rr;

namespace {
constexpr ScryptCost cheap{4, 1, 1};
}

TEST_CASE("scrypt: the vector of RFC 7914") {
  const auto hash =
      PasswordHash::parse("$scrypt$ln=14,r=8,p=1$U29kaXVtQ2hsb3JpZGU$cCO9yzr9c0hGHAbNgf046/2o+7qQT44+qbVD9lRdofI");
  REQUIRE(hash);
  CHECK(hash->matches("pleaseletmein"));
  CHECK_FALSE(hash->matches("pleaseletmeiN"));
  CHECK_FALSE(hash->matches(""));
}

TEST_CASE("MD5, as the reference's files have it") {
  const auto hash = PasswordHash::parse("5ebe2294ecd0e0f08eab7690d2a6ee69");
  REQUIRE(hash);
  CHECK(hash->scheme() == PasswordScheme::md5);
  CHECK(hash->matches("secret"));
  CHECK_FALSE(hash->matches("Secret"));
  CHECK(hash->text() == "5ebe2294ecd0e0f08eab7690d2a6ee69");
}

TEST_CASE("a new hash has its own salt, is read back, and knows its password") {
  for (const std::string_view password : {"", "x", "correct horse battery staple", "p\xc3\xa4ss"}) {
    const auto first = PasswordHash::make_scrypt(password, cheap);
    const auto second = PasswordHash::make_scrypt(password, cheap);
    REQUIRE(first);
    REQUIRE(second);
    CHECK(first->text() != second->text());
    const auto read = PasswordHash::parse(first->text());
    REQUIRE(read);
    CHECK(read->text() == first->text());
    CHECK(read->matches(password));
    CHECK_FALSE(read->matches(std::string(password) + " "));
  }
}

TEST_CASE("broken hashes are refused without repeating them") {
  for (const std::string_view text :
       {"", "secret", "5ebe2294ecd0e0f08eab7690d2a6ee6", "5ebe2294ecd0e0f08eab7690d2a6ee6g",
        "$scrypt$ln=14,r=8,p=1$U29kaXVtQ2hsb3JpZGU$", "$scrypt$ln=14,r=8$U29kaXVtQ2hsb3JpZGU$cCO9",
        "$scrypt$ln=14,r=8,p=1$U29kaXVtQ2hsb3JpZGU$cCO9yzr9c0hGHAbNgf046/2o+7qQT44+qbVD9lRdofIAAAA",
        "$scrypt$ln=14,r=8,p=1$!!!!!!!!!!!!$cCO9yzr9c0hGHAbNgf046/2o+7qQT44+qbVD9lRdofI",
        "$scrypt$ln=99999999999,r=8,p=1$U29kaXVtQ2hsb3JpZGU$cCO9yzr9c0hGHAbNgf046/2o+7qQT44+qbVD9lRdofI"}) {
    INFO(text);
    const auto hash = PasswordHash::parse(text);
    REQUIRE_FALSE(hash);
    CHECK(hash.error().message == "password hash: expected $scrypt$ln=N,r=N,p=N$SALT$HASH or 32 hex digits (MD5)");
  }
  for (const std::string_view cost :
       {"ln=0,r=8,p=1", "ln=24,r=64,p=1", "ln=63,r=8,p=1", "ln=14,r=0,p=1", "ln=14,r=8,p=99"})
    CHECK_FALSE(PasswordHash::parse("$scrypt$" + std::string(cost) +
                                    "$U29kaXVtQ2hsb3JpZGU$cCO9yzr9c0hGHAbNgf046/2o+7qQT44+qbVD9lRdofI"));
}
