#include "server/access/access.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "node/service/password_hash.hpp"
#include "server/access/logins.hpp"
#include "server/access/standing.hpp"
#include "test/server/access/jwt_signer.hpp"
#include "test/support/print.hpp"

using namespace rrgate;

namespace {

/// Files of users and tokens in a folder of its own.
struct Files {
  Files() { std::filesystem::create_directories(folder); }
  ~Files() { std::filesystem::remove_all(folder); }

  std::string path(const std::string& name) const { return (folder / name).string(); }
  /// As programs replace files: nobody sees half of one.
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name + ".new")) << text;
    std::filesystem::rename(path(name + ".new"), path(name));
  }
  static std::string user(const std::string& name, std::string_view password, const std::string& roles) {
    return name + " " + rr::PasswordHash::make_scrypt(password, {4, 1, 1}).value().text() + " " + roles + "\n";
  }
  /// All but what the audit log tells of itself.
  std::vector<nlohmann::json> audit() const {
    std::ifstream in(path("audit"));
    std::vector<nlohmann::json> out;
    for (std::string line; std::getline(in, line);)
      if (auto record = nlohmann::json::parse(line); record["event"] != "started" && record["event"] != "stopped")
        out.push_back(std::move(record));
    return out;
  }
  std::vector<nlohmann::json> audit(Access& access) const {
    REQUIRE(access.audit().flush(std::chrono::seconds(10)));
    return audit();
  }

  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("rrgate-access-" + std::to_string(::getpid()));
};

AccessConfig with_users(const Files& files) {
  AccessConfig out;
  out.users_file = files.path("users");
  out.audit.file = files.path("audit");
  out.rules = {AccessRule{.roles = {"viewer"}, .may = {Verb::read}},
               AccessRule{.roles = {"operator"}, .may = {Verb::read, Verb::write}}};
  return out;
}

rr::Result<rr::AuthenticatedUser> log_in(const Access& access, std::string name, std::string_view password) {
  rr::LoginAttempt attempt;
  attempt.username = std::move(name);
  attempt.credentials.items.emplace_back("password", rr::Value(password));
  return access.authenticator()->authenticate(attempt);
}

const AccessRequest a_write{"arm", "Arm", "Arm", "speed", Verb::write};
const AccessRequest a_read{"arm", "Arm", "Arm", "speed", Verb::read};

}  // namespace

TEST_CASE("until the files are read, nobody may who would have to show who he is") {
  Files files;
  const Access access(with_users(files));
  CHECK_FALSE(access.is_open());
  CHECK_FALSE(access.sees(Identity{}, "arm"));
  CHECK_FALSE(access.authenticator());
  CHECK(Access(AccessConfig{}).is_open());
}

TEST_CASE("a file that can't be used is named, and nothing has changed") {
  Files files;
  Access access(with_users(files));
  CHECK_THAT(access.load().error().message, Catch::Contains("users file '" + files.path("users") + "': can't be read"));
  files.write("users", "alice no-hash _\n");
  CHECK_THAT(access.load().error().message, Catch::Contains(files.path("users")) && Catch::Contains("line 1"));
  CHECK_FALSE(access.authenticator());
  files.write("users", Files::user("alice", "one", "viewer"));
  CHECK(access.load());
  CHECK(log_in(access, "alice", "one"));
  auto config = with_users(files);
  config.tokens_file = files.path("tokens");
  CHECK(load_access(config).error().message.find("tokens file") != std::string::npos);
}

TEST_CASE("users are judged by the file of now, through one authenticator") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  Access access(with_users(files));
  REQUIRE(access.load());
  const auto authenticator = access.authenticator();
  CHECK(log_in(access, "alice", "one").value().privileges == std::vector<std::string>{"viewer"});
  files.write("users", Files::user("alice", "two", "operator") + Files::user("bob", "three", "viewer"));
  CHECK(log_in(access, "alice", "one"));  // nobody has looked yet
  access.reload(false);
  CHECK(access.authenticator() == authenticator);
  CHECK_FALSE(log_in(access, "alice", "one"));
  CHECK(log_in(access, "alice", "two").value().privileges == std::vector<std::string>{"operator"});
  CHECK(log_in(access, "bob", "three"));
  files.write("users", "broken\n");
  access.reload(true);
  CHECK(log_in(access, "bob", "three"));  // what can't be used stays as it was
}

TEST_CASE("tokens are checked with the secret of a file, and with its next one when that has changed") {
  Files files;
  AccessConfig config;
  config.jwt.secret_file = files.path("secret");
  Access access(config);
  CHECK_THAT(access.load().error().message, Catch::Contains("secret '" + files.path("secret") + "': can't be read"));
  files.write("secret", "too short");
  CHECK_THAT(access.load().error().message, Catch::Contains("9 bytes, expected at least 32"));
  const std::string first(32, 'a'), second(32, 'b');
  files.write("secret", first + "\n");
  REQUIRE(access.load());
  const auto knows = [&](const std::string& secret) {
    const auto now = std::chrono::system_clock::now();
    const auto end = std::chrono::duration_cast<std::chrono::seconds>(now.time_since_epoch()).count() + 600;
    return access.state().jwt->verify(test::JwtSigner("HS256", secret).sign({{"sub", "alice"}, {"exp", end}}), now);
  };
  CHECK(knows(first).value().name == "alice");
  CHECK_FALSE(knows(second));
  files.write("secret", second);
  access.reload(false);
  CHECK(knows(second));
  CHECK_FALSE(knows(first));
}

TEST_CASE("what a JSON Web Token has shown ends with its key, its issuer and what it was judged by") {
  Files files;
  files.write("secret", std::string(32, 'a'));
  AccessConfig config;
  config.jwt.secret_file = files.path("secret");
  config.jwt.claims.issuer = "https://id.example";
  Access access(config);
  REQUIRE(access.load());
  const auto now = std::chrono::system_clock::now();
  const auto end = std::chrono::duration_cast<std::chrono::seconds>(now.time_since_epoch()).count() + 600;
  const auto token = test::JwtSigner("HS256", std::string(32, 'a'))
                         .sign({{"sub", "alice"}, {"iss", "https://id.example"}, {"exp", end}});
  const auto alice = access.with_grants(access.state().jwt->verify(token, now).value());
  CHECK(access.renew(alice));
  access.reload(true);
  CHECK(access.renew(alice));
  SECTION("another key") {
    files.write("secret", std::string(32, 'b'));
    access.reload(true);
    CHECK_FALSE(access.renew(alice));
  }
  SECTION("another issuer, audience or claim") {
    auto other = config;
    const auto which = GENERATE(0, 1, 2, 3);
    (which == 0   ? other.jwt.claims.issuer
     : which == 1 ? other.jwt.claims.audience
     : which == 2 ? other.jwt.claims.user_claim
                  : other.jwt.claims.roles_claim) = "other";
    REQUIRE(access.replace(load_access(other).value()));
    CHECK_FALSE(access.renew(alice));
  }
  SECTION("none any more") {
    REQUIRE(access.replace(load_access({}).value()));
    CHECK_FALSE(access.renew(alice));
  }
}

TEST_CASE("roles are those of the file and those that the configuration adds") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  auto config = with_users(files);
  config.anonymous_role = "guest";
  config.grants = {RoleGrant{.users = {"al*"}, .roles = {"operator", "viewer"}},
                   RoleGrant{.users = {"bob"}, .roles = {"admin"}}};
  Access access(config);
  REQUIRE(access.load());
  CHECK(access.anonymous("here:1").roles == std::vector<std::string>{"guest"});
  CHECK_FALSE(access.anonymous("here:1").is_proven());
  const auto alice = access.logged_in(log_in(access, "alice", "one").value(), "here:1");
  CHECK(alice.roles == std::vector<std::string>{"viewer", "operator"});
  CHECK(alice.proof == Proof::password);
  CHECK(alice.client == "here:1");
}

TEST_CASE("who has logged in at a device is nobody's user here, whatever name he has there") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  auto config = with_users(files);
  config.grants = {RoleGrant{.users = {"alice"}, .roles = {"operator"}}};
  config.rules.push_back(AccessRule{.roles = {"*"}, .may = {Verb::lock}});
  Access access(config);
  REQUIRE(access.load());
  const rr::AuthenticatedUser devices{"alice", {"operator"}, {}};
  const auto shown = access.anonymous("here:1");
  const auto at_device = access.in_session(shown, &devices);
  CHECK_FALSE(at_device.is_proven());
  CHECK(at_device.roles.empty());
  CHECK(at_device.device_user == "alice");
  CHECK(at_device.client == "here:1");
  CHECK(access.check(at_device, a_write).error().code == rr::ErrorCode::permission_denied);
  CHECK_FALSE(access.sees(at_device, "arm"));
  const auto ours = log_in(access, "alice", "one").value();
  const auto here = access.in_session(shown, &ours);
  CHECK(here.roles == std::vector<std::string>{"viewer", "operator"});
  CHECK(here.device_user.empty());
  CHECK(access.in_session(here, nullptr) == here);
  CHECK(access.in_session(here, &devices).roles == here.roles);  // what the connection has shown stays
  CHECK_FALSE(subject_of(devices) == subject_of(ours));
  CHECK(subject_of(ours) == here.subject());
}

TEST_CASE("a token that has a user's name gets nothing by that name") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  files.write("tokens", "alice " + hash_api_token("rrg_x") + " viewer _\n");
  auto config = with_users(files);
  config.tokens_file = files.path("tokens");
  config.grants = {RoleGrant{.users = {"*"}, .roles = {"operator"}}};
  Access access(config);
  REQUIRE(access.load());
  const auto token =
      access.with_grants(access.state().tokens->verify("rrg_x", std::chrono::system_clock::now()).value());
  CHECK(token.roles == std::vector<std::string>{"viewer"});
  const auto alice = access.logged_in(log_in(access, "alice", "one").value(), "here:1");
  CHECK(alice.roles == std::vector<std::string>{"viewer", "operator"});
  CHECK_FALSE(token.subject() == alice.subject());
  CHECK(token.subject().key() != alice.subject().key());
}

TEST_CASE("the audit log has what was done and what was refused, and no reads") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer") + Files::user("otto", "two", "operator"));
  Access access(with_users(files));
  REQUIRE(access.load());
  const auto alice = access.logged_in(log_in(access, "alice", "one").value(), "here:1");
  const auto otto = access.logged_in(log_in(access, "otto", "two").value(), "here:2");
  CHECK(access.check(alice, a_read));
  CHECK(access.check(alice, a_write).error().code == rr::ErrorCode::permission_denied);
  REQUIRE(access.check_and_begin(otto, a_write));
  CHECK_FALSE(access.check_whole_device(otto, "arm"));
  CHECK(access.begin(otto, a_read) == nullptr);
  const auto lines = files.audit(access);
  std::vector<std::string> told;
  for (const auto& line : lines)
    told.push_back(line["event"].get<std::string>() + " " + line["user"].get<std::string>());
  CHECK(told == std::vector<std::string>{"refused alice", "write otto", "refused otto"});
  CHECK(lines[1]["member"] == "speed");
  CHECK(lines[1]["outcome"] == "error");
  CHECK(lines[1]["detail"] == "it ended before it was answered");
  std::filesystem::rename(files.path("audit"), files.path("audit.1"));
  access.reload(true);
  const auto entry = access.check_and_begin(otto, a_write, "0af7651916cd43dd8448eb211c80319c").value();
  entry->finish({});
  entry->finish(Outcome::error, "a second time");
  const auto anew = files.audit(access);
  REQUIRE(anew.size() == 1);
  CHECK(anew[0]["outcome"] == "ok");
  CHECK(anew[0]["trace"] == "0af7651916cd43dd8448eb211c80319c");
  CHECK(anew[0]["prev"].is_string());
}

TEST_CASE("what can't be recorded is refused where that is wanted, and goes on where not") {
  Files files;
  files.write("users", Files::user("otto", "two", "operator"));
  auto config = with_users(files);
  config.audit.file = "/dev/full";
  config.audit.fails_closed = GENERATE(false, true);
  Access access(config);
  REQUIRE(access.load());
  const auto otto = access.logged_in(log_in(access, "otto", "two").value(), "here:1");
  Standing standing(access, otto);
  CHECK(access.check(otto, a_read));
  for (const auto& checked : {access.check(otto, a_write), standing.check(a_write, Recorded::first_time),
                              standing.check(a_write, Recorded::first_time), access.check_whole_device(otto, "arm")}) {
    if (checked) continue;
    const bool is_right = checked.error().code == rr::ErrorCode::permission_denied;  // to the whole device
    CHECK((is_right || config.audit.fails_closed));
    if (!is_right) CHECK(checked.error().message.find("No space left on device") != std::string::npos);
  }
  CHECK(access.check(otto, a_write).has_value() == !config.audit.fails_closed);
  CHECK(access.audit().state().refused == (config.audit.fails_closed ? 4u : 0u));
  CHECK(access.audit().state().failure == "No space left on device");
  config.audit.file = files.path("audit");
  REQUIRE(access.replace(load_access(config).value()));
  REQUIRE(access.check(otto, a_write));
  CHECK(access.audit().flush(std::chrono::seconds(10)));
}

TEST_CASE("tokens that are made and revoked are recorded when their file is read anew") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  files.write("tokens", "old " + hash_api_token("rrg_x") + " viewer _\n");
  auto config = with_users(files);
  config.tokens_file = files.path("tokens");
  Access access(config);
  REQUIRE(access.load());
  files.write("tokens", "new " + hash_api_token("rrg_y") + " viewer,operator _\n");
  access.reload(false);
  const auto lines = files.audit(access);
  REQUIRE(lines.size() == 2);
  CHECK(lines[0]["event"] == "token_revoked");
  CHECK(lines[0]["detail"] == "old: roles viewer");
  CHECK(lines[1]["event"] == "token_made");
  CHECK(lines[1]["detail"] == "new: roles viewer,operator");
}

TEST_CASE(
    "a token is known by its hash in the audit log: another one of the same name, other roles, another last day") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  const auto line = [](const std::string& name, const std::string& secret, const std::string& rest) {
    return name + " " + hash_api_token(secret) + " " + rest + "\n";
  };
  const auto same = line("same", "s", "viewer _");
  const auto cell = line("cell", "a", "viewer _");
  files.write("tokens", same + cell);
  auto config = with_users(files);
  config.tokens_file = files.path("tokens");
  Access access(config);
  REQUIRE(access.load());
  std::size_t seen = 0;
  const auto change_to = [&](const std::string& text) {
    files.write("tokens", same + text);
    access.reload(true);
    std::vector<std::string> out;
    const auto lines = files.audit(access);
    for (; seen < lines.size(); ++seen)
      out.push_back(lines[seen]["event"].get<std::string>() + " " + lines[seen]["detail"].get<std::string>());
    return out;
  };
  using Records = std::vector<std::string>;
  CHECK(change_to(cell + line("cell", "b", "operator _")) == Records{"token_made cell: roles operator"});
  CHECK(change_to(line("cell", "b", "operator _")) == Records{"token_revoked cell: roles viewer"});
  CHECK(change_to(line("cell", "c", "operator _")) ==
        Records{"token_revoked cell: roles operator", "token_made cell: roles operator"});
  CHECK(change_to(line("cell", "c", "viewer _")) == Records{"token_changed cell: roles viewer"});
  CHECK(change_to(line("cell", "c", "viewer 2100-01-31")) ==
        Records{"token_changed cell: roles viewer, until 2100-01-31"});
  CHECK(
      change_to(line("hall", "c", "viewer 2100-01-31")) ==
      Records{"token_revoked cell: roles viewer, until 2100-01-31", "token_made hall: roles viewer, until 2100-01-31"});
  CHECK(change_to(line("hall", "c", "viewer 2100-01-31")).empty());
}

TEST_CASE("users that come, go or change are recorded when their file is read anew, without passwords") {
  Files files;
  const auto bob = Files::user("bob", "one", "viewer");
  files.write("users", Files::user("alice", "one", "viewer") + bob + Files::user("carol", "one", "viewer"));
  Access access(with_users(files));
  REQUIRE(access.load());
  files.write("users", Files::user("alice", "two", "viewer") + bob + Files::user("dave", "one", "viewer,operator"));
  access.reload(false);
  const auto lines = files.audit(access);
  REQUIRE(lines.size() == 3);
  CHECK(lines[0]["event"] == "user_removed");
  CHECK(lines[0]["detail"] == "carol: roles viewer");
  CHECK(lines[1]["event"] == "user_changed");
  CHECK(lines[1]["detail"] == "alice: roles viewer, another password");
  CHECK(lines[2]["event"] == "user_added");
  CHECK(lines[2]["detail"] == "dave: roles viewer,operator");
}

namespace {

/// A gateway's logins, of which alice's password is "one".
struct LoginsOfAlice {
  LoginsOfAlice() {
    files.write("users", Files::user("alice", "one", "viewer"));
    REQUIRE(access.load());
  }

  void judge(std::string_view password, ClientOrigin from, Logins::Of of, Logins::Done done) {
    rr::LoginAttempt attempt;
    attempt.username = "alice";
    attempt.credentials.items.emplace_back("password", rr::Value(password));
    logins.judge(std::move(attempt), std::move(from), of, std::move(done));
  }

  Files files;
  Access access{with_users(files)};
  boost::asio::io_context io{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{io.get_executor()};
  Logins logins{io.get_executor(), access};
};

}  // namespace

TEST_CASE("sessions that log in at once with one password are each recorded") {
  LoginsOfAlice alice;
  int answered = 0;
  const auto judge = [&](const std::string& client, Logins::Of of) {
    alice.judge("one", {.client = client, .network = "192.0.2.1", .face = Face::native}, of,
                [&](const Logins::Judged& user) {
                  CHECK(user);
                  ++answered;
                });
  };
  for (const auto* client : {"192.0.2.1:1", "192.0.2.1:2", "192.0.2.1:3"}) judge(client, Logins::Of::session);
  judge("192.0.2.1:4", Logins::Of::request);  // one with each request: those are not recorded
  while (answered < 4 && alice.io.run_one_for(std::chrono::seconds(10)) > 0) continue;
  CHECK(answered == 4);
  std::vector<std::string> clients;
  for (const auto& line : alice.files.audit(alice.access))
    if (line["event"] == "login") clients.push_back(line["client"]);
  CHECK(clients == std::vector<std::string>{"192.0.2.1:1", "192.0.2.1:2", "192.0.2.1:3"});
}

TEST_CASE("a right password does not wait for a flood of others, also while none of them has been judged") {
  LoginsOfAlice alice;
  int refused = 0;
  bool is_in = false;
  const auto judge = [&](const std::string& network, const std::string& password, const Logins::Done& done) {
    alice.judge(password, {.client = network + ":1", .network = network, .face = Face::native}, Logins::Of::request,
                done);
  };
  for (int i = 0; i < 150; ++i)
    judge("192.0.2." + std::to_string(i % 50), "guess " + std::to_string(i),
          [&](const Logins::Judged& user) { refused += user ? 0 : 1; });
  judge("198.51.100.1", "one", [&](const Logins::Judged& user) { is_in = user.has_value(); });
  while (!is_in && refused < 50 && alice.io.run_one_for(std::chrono::seconds(10)) > 0) continue;
  CHECK(is_in);
  CHECK(refused <= 2);  // what was under way, and the turn of those that have failed
}

TEST_CASE("what is asked for too often is recorded once of a network and minute, and the sum of it") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  {
    Access access(with_users(files));
    REQUIRE(access.load());
    const auto alice = access.logged_in(log_in(access, "alice", "one").value(), "192.0.2.1:1");
    for (int i = 0; i < 1000; ++i) access.record_too_much(alice, &a_write, "too many requests of 'alice'");
    access.record_too_much(access.anonymous("192.0.2.2:1"), nullptr, "too many requests from 192.0.2.2");
    const auto lines = files.audit(access);
    REQUIRE(lines.size() == 2);
    CHECK(lines[0]["event"] == "refused");
    CHECK(lines[0]["user"] == "alice");
    CHECK(lines[0]["member"] == "speed");
    CHECK(lines[0]["detail"] == "too many requests of 'alice'");
    CHECK(lines[1]["client"] == "192.0.2.2:1");
    access.tend_audit(true);
  }
  CHECK(files.audit().back()["detail"] == "999 more within a minute, asked for too often");
}

TEST_CASE("another configuration holds for the next request; one whose audit file can't be opened for none") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  Access access(with_users(files));
  REQUIRE(access.load());
  const auto alice = access.logged_in(log_in(access, "alice", "one").value(), "here:1");
  auto next = with_users(files);
  next.rules = {AccessRule{.roles = {"viewer"}, .may = {Verb::write}}};
  next.audit.file = files.path("no such folder/audit");
  CHECK_FALSE(access.replace(load_access(next).value()));
  CHECK(access.check(alice, a_read));
  CHECK_FALSE(access.check(alice, a_write));
  next.audit.file = files.path("audit");
  CHECK(access.replace(load_access(next).value()));
  CHECK_FALSE(access.check(alice, a_read));
  CHECK(access.check(alice, a_write));
}

TEST_CASE("what strangers are refused fills no disk") {
  Files files;
  files.write("users", Files::user("alice", "one", "viewer"));
  {
    Access access(with_users(files));
    REQUIRE(access.load());
    for (int i = 0; i < 20'000; ++i)
      CHECK_FALSE(access.check(access.anonymous("192.0.2.1:" + std::to_string(i + 1)), a_write));
    const auto alice = access.logged_in(log_in(access, "alice", "one").value(), "192.0.2.1:1");
    for (int i = 0; i < 3; ++i) CHECK_FALSE(access.check(alice, a_write));
    CHECK(files.audit(access).size() == 4);
  }
  const auto last = files.audit().back();
  CHECK(last["event"] == "refusals");
  CHECK(last["client"] == "192.0.2.1");
  CHECK(last["detail"] == "19999 more within a minute");
}

TEST_CASE("who was let in stays so by what he has shown, as long as that is good") {
  Files files;
  const auto users = Files::user("alice", "one", "viewer");
  const auto hash = hash_api_token("rrg_x");
  files.write("users", users);
  files.write("tokens", "ci " + hash + " viewer _\n");
  auto config = with_users(files);
  config.tokens_file = files.path("tokens");
  config.grants = {RoleGrant{.users = {"al*"}, .roles = {"operator"}}};
  Access access(config);
  REQUIRE(access.load());
  const auto now = std::chrono::system_clock::now();
  Standing alice(access, access.logged_in(log_in(access, "alice", "one").value(), "here:1"));
  Standing token(access, access.with_grants(access.state().tokens->verify("rrg_x", now).value()));
  Standing stranger(access, access.anonymous("here:2"));
  CHECK(alice.check(a_write));
  CHECK(token.check(a_read));
  SECTION("roles change") {
    files.write("tokens", "ci " + hash + " operator _\n");
    access.reload(false);
    CHECK(token.check(a_write));
    config.grants.clear();
    REQUIRE(access.replace(load_access(config).value()));
    CHECK_FALSE(alice.check(a_write));
    CHECK(alice.check(a_read));
  }
  SECTION("the token is deleted") {
    files.write("tokens", "other " + hash_api_token("rrg_y") + " viewer _\n");
    access.reload(false);
    CHECK_FALSE(token.is_good());
    CHECK(token.check(a_read).error().code == rr::ErrorCode::authentication_error);
    CHECK(token.identity().name.empty());
    CHECK(token.identity().roles.empty());
    files.write("tokens", "ci " + hash + " viewer _\n");
    access.reload(false);
    CHECK_FALSE(token.is_good());  // once gone, for ever
    CHECK(alice.is_good());
    const auto lines = files.audit(access);
    CHECK(std::ranges::count(lines, "ended", [](const auto& line) { return line["event"]; }) == 1);
  }
  SECTION("the token's last day is over") {
    files.write("tokens", "ci " + hash + " viewer 2020-01-01\n");
    access.reload(false);
    CHECK_FALSE(token.is_good());
  }
  SECTION("the password is another one") {
    files.write("users", Files::user("alice", "two", "viewer"));
    access.reload(false);
    CHECK_FALSE(alice.is_good());
    CHECK(token.is_good());
  }
  SECTION("the file says the same once more") {
    files.write("users", "\n" + users);
    access.reload(true);
    CHECK(alice.is_good());
  }
  CHECK(stranger.is_good());
}

TEST_CASE("what was revoked between showing and using is not good") {
  Files files;
  files.write("users", Files::user("otto", "one", "operator") + Files::user("alice", "one", "viewer"));
  Access access(with_users(files));
  REQUIRE(access.load());
  const auto shown = access.logged_in(log_in(access, "otto", "one").value(), "here:1");
  files.write("users", Files::user("alice", "one", "viewer"));
  access.reload(false);
  Standing otto(access, shown);
  CHECK_FALSE(otto.is_good());
  CHECK_FALSE(otto.check(a_write));
}

TEST_CASE("users that a new configuration finds changed are recorded, too") {
  Files files;
  const auto alice = Files::user("alice", "one", "viewer");
  files.write("users", Files::user("otto", "one", "operator") + alice);
  const auto config = with_users(files);
  Access access(config);
  REQUIRE(access.load());
  files.write("users", alice);
  REQUIRE(access.replace(load_access(config).value()));
  const auto lines = files.audit(access);
  REQUIRE(lines.size() == 1);
  CHECK(lines.front()["event"] == "user_removed");
}

TEST_CASE("of a stream of packets the first is recorded") {
  Files files;
  files.write("users", Files::user("otto", "one", "operator"));
  Access access(with_users(files));
  REQUIRE(access.load());
  Standing otto(access, access.logged_in(log_in(access, "otto", "one").value(), "here:1"));
  for (int i = 0; i < 100; ++i) CHECK(otto.check(a_write, Recorded::first_time));
  CHECK(otto.check({"arm", "Arm", "Arm.tool", "speed", Verb::write}, Recorded::first_time));
  CHECK(otto.check(a_write, Recorded::never));
  CHECK(otto.check(a_write));
  CHECK(files.audit(access).size() == 2);
}
