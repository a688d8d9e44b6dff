#include "node/service/password_file.hpp"

#include <catch2/catch.hpp>

#include "test/support/print.hpp"

using namespace rr;

namespace {

// The passwords: secret, hunter2.
constexpr std::string_view reference_file =
    "alice 5ebe2294ecd0e0f08eab7690d2a6ee69 objectlock,drive\r\n\n"
    "  bob\t2ab96390c7dbe3439de74d0c9b0b1767  _ {11111111-0200-0000-0000-000000000000}\n"
    "alice 2ab96390c7dbe3439de74d0c9b0b1767 _\n";

LoginAttempt attempt(std::string username, std::string_view password) {
  LoginAttempt out;
  out.username = std::move(username);
  out.credentials.items.emplace_back("password", Value(password));
  return out;
}

auto read(std::string_view text, bool accepts_md5 = true, bool requires_verified_client = false) {
  return PasswordFileAuthenticator::from_text(text, {accepts_md5, requires_verified_client});
}

std::string refusal(const Authenticator& users, const LoginAttempt& login) {
  const auto result = users.authenticate(login);
  if (result) return "let in " + result->name;
  CHECK(result.error().code == ErrorCode::authentication_error);
  return result.error().message;
}

}  // namespace

TEST_CASE("the reference's file: users, privileges, the first line of a name counts") {
  const auto file = read(reference_file);
  REQUIRE(file);
  const auto& users = **file;
  CHECK(users.user_count() == 2);
  const auto alice = users.authenticate(attempt("alice", "secret"));
  REQUIRE(alice);
  CHECK(alice->name == "alice");
  CHECK(alice->has_privilege("objectlock"));
  CHECK(alice->has_privilege("drive"));
  CHECK_FALSE(alice->has_privilege("objectlockoverride"));
  const auto bob = users.authenticate(attempt("bob", "hunter2"));
  REQUIRE(bob);
  CHECK(bob->privileges.empty());
}

TEST_CASE("what is refused does not tell which part was wrong") {
  const auto file = read(reference_file);
  REQUIRE(file);
  for (const auto& login : {attempt("alice", "hunter2"), attempt("bob", "secret"), attempt("mallory", "secret"),
                            attempt("", ""), attempt("alice", ""), attempt("alice", std::string(2000, 'x'))})
    CHECK(refusal(**file, login) == "Invalid username or password");
  LoginAttempt nothing;
  nothing.username = "alice";
  CHECK(refusal(**file, nothing) == "Password not supplied in credentials");
  nothing.credentials.items.emplace_back("password", Value(5));
  CHECK(refusal(**file, nothing) == "Password not supplied in credentials");
  const auto empty = read("");
  REQUIRE(empty);
  CHECK(refusal(**empty, attempt("alice", "secret")) == "Invalid username or password");
}

TEST_CASE("scrypt lines, and MD5 only where it is allowed") {
  const auto hash = PasswordHash::make_scrypt("secret", {4, 1, 1});
  REQUIRE(hash);
  const auto file = read("alice " + hash->text() + " objectlock\n", false);
  REQUIRE(file);
  CHECK((*file)->authenticate(attempt("alice", "secret")));
  CHECK(refusal(**file, attempt("alice", "Secret")) == "Invalid username or password");
  const auto old = read(reference_file, false);
  REQUIRE_FALSE(old);
  CHECK(old.error().code == ErrorCode::invalid_configuration);
  CHECK(old.error().message ==
        "password file, line 1: user 'alice' has an MD5 hash, which must be allowed; use scrypt");
}

TEST_CASE("verified clients, and those of a line's nodes alone") {
  const auto file = read(reference_file, true, true);
  REQUIRE(file);
  auto login = attempt("alice", "secret");
  CHECK(refusal(**file, login) == "Client identity is not verified");
  login.peer.id = NodeId{{1}};  // what the client says of itself vouches for nothing
  CHECK(refusal(**file, login) == "Client identity is not verified");
  login.verified_node_id = NodeId{{1}};
  CHECK((*file)->authenticate(login));
  login = attempt("bob", "hunter2");
  login.verified_node_id = NodeId{{1}};
  CHECK(refusal(**file, login) == "User may not log in from this node");
  login.verified_node_id = NodeId{{0x11, 0x11, 0x11, 0x11, 2}};
  CHECK((*file)->authenticate(login));
  login = attempt("bob", "guess");  // who may come from where is not told to those without password
  CHECK(refusal(**file, login) == "Invalid username or password");
}

TEST_CASE("a broken file is refused with its line, never with the hash") {
  for (const auto& [text, why] : {std::pair{"alice 5ebe2294ecd0e0f08eab7690d2a6ee69", "has 2 fields"},
                                  std::pair{"\n\nalice nosuchhash _", "line 3: password hash: expected"},
                                  std::pair{"alice 5ebe2294ecd0e0f08eab7690d2a6ee69 _ nonode", "line 1: "},
                                  std::pair{"alice 5ebe2294ecd0e0f08eab7690d2a6ee69 _ {0} more", "has 5 fields"}}) {
    const auto file = read(text);
    REQUIRE_FALSE(file);
    INFO(file.error().message);
    CHECK(file.error().message.find(why) != std::string::npos);
    CHECK(file.error().message.find("5ebe") == std::string::npos);
    CHECK(file.error().message.find("nosuchhash") == std::string::npos);
  }
  CHECK(PasswordFileAuthenticator::from_file("/nowhere/users").error().code == ErrorCode::io_error);
}
