// Services that ask who comes: logins over real connections, judged beside the node's thread.
#include <catch2/catch.hpp>
#include <condition_variable>
#include <mutex>

#include "test/node/node/node_fixture.hpp"
#include "test/support/print.hpp"

using namespace rr;

namespace {

const std::vector<std::string> definition{R"(service experimental.guarded
stdver 0.10
object Vault
  property double level
  function string who()
end
)"};

/// alice with "secret"; "slow" waits until it is released.
class TestAuthenticator final : public Authenticator {
 public:
  Result<AuthenticatedUser> authenticate(const LoginAttempt& attempt) const override {
    const auto* password = attempt.credentials.find("password");
    if (attempt.username == "broken") throw std::runtime_error("secret detail");
    if (attempt.username == "odd") throw 5;
    if (attempt.username == "slow") {
      std::unique_lock lock(mutex_);
      is_waiting_ = true;
      news_.notify_all();
      news_.wait(lock, [this] { return is_released_; });
    }
    if (password && *password == Value("secret")) return AuthenticatedUser{attempt.username, {"objectlock"}, {}};
    return make_error(ErrorCode::authentication_error, "Invalid username or password");
  }
  void wait_until_asked() const {
    std::unique_lock lock(mutex_);
    news_.wait(lock, [this] { return is_waiting_; });
  }
  void release() const {
    const std::lock_guard lock(mutex_);
    is_released_ = true;
    news_.notify_all();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable news_;
  mutable bool is_waiting_ = false;
  mutable bool is_released_ = false;
};

std::shared_ptr<Service> make_vault(const std::string& name, SecurityPolicy policy) {
  auto service = Service::from_text(definition, name, "Vault");
  service->property("level").get([] { return 1.5; }).set([](double) {});
  service->function("who", [weak = std::weak_ptr(service)] {
    const auto caller = weak.lock()->current_caller();
    return caller.user + "/" + (caller.endpoint != 0 && caller.id != 0 ? "there" : "not there");
  });
  service->root().allow_monitor();
  service->set_security(std::move(policy));
  return service;
}

struct Vaults {
  std::shared_ptr<const TestAuthenticator> authenticator = std::make_shared<TestAuthenticator>();
  RunningNode node{[this](Node& target) {
    SecurityPolicy policy;
    policy.authenticator = authenticator;
    target.add(make_vault("public", policy));
    policy.allow_object_lock = true;
    target.add(make_vault("shared", policy));
    policy.allow_object_lock = false;
    policy.require_valid_user = true;
    target.add(make_vault("vault", policy));
  }};
};

}  // namespace

TEST_CASE("a handler knows who calls") {
  Vaults vaults;
  const auto alice = connect(vaults.node.url("vault"), "alice", "secret");
  CHECK(alice.call("who") == Value("alice/there"));
  const auto anybody = connect(vaults.node.url("public"));
  CHECK(anybody.call("who") == Value("/there"));
  anybody.connection().authenticate("bob", "secret");
  CHECK(anybody.call("who") == Value("bob/there"));
  CHECK(error_of([&] { anybody.connection().authenticate("bob", "guess"); }).message == "Invalid username or password");
  CHECK(anybody.call("who") == Value("bob/there"));
  anybody.connection().logout();
  CHECK(anybody.call("who") == Value("/there"));
}

TEST_CASE("without the right password there is no way in") {
  Vaults vaults;
  const auto url = vaults.node.url("vault");
  for (const auto& error :
       {error_of([&] { connect(url, "alice", "guess"); }), error_of([&] { connect(url); }),
        error_of([&] { connect(url, "broken", "secret"); }), error_of([&] { connect(url, "odd", "secret"); })}) {
    CHECK(error.code == ErrorCode::authentication_error);
    CHECK(error.message == "connect to 'vault': Authentication Failed");
  }
  CHECK(connect(url, "alice", "secret").call("who") == Value("alice/there"));
}

TEST_CASE("a slow login holds nobody up") {
  Vaults vaults;
  const auto anybody = connect(vaults.node.url("public"));
  Value who;
  std::thread slow([&] { who = connect(vaults.node.url("vault"), "slow", "secret").call("who"); });
  vaults.authenticator->wait_until_asked();
  CHECK(anybody.get("level") == Value(1.5));
  vaults.authenticator->release();
  slow.join();
  CHECK(who == Value("slow/there"));
}

TEST_CASE("object locks over real connections") {
  Vaults vaults;
  const auto alice = connect(vaults.node.url("vault"), "alice", "secret");
  const auto bob = connect(vaults.node.url("vault"), "bob", "secret");
  CHECK(error_of([&] { alice.lock(); }).code == ErrorCode::permission_denied);
  const auto open = connect(vaults.node.url("shared"));
  open.connection().authenticate("alice", "secret");
  open.lock();
  const auto other = connect(vaults.node.url("shared"));
  CHECK(error_of([&] { other.get("level"); }).message == "Object locked by alice");
  CHECK(error_of([&] { other.unlock(); }).code == ErrorCode::authentication_error);
  open.unlock();
  CHECK(other.get("level") == Value(1.5));
}

TEST_CASE("a client that waits for a monitor is told when it is free") {
  Vaults vaults;
  const auto first = connect(vaults.node.url("public"));
  const auto second = connect(vaults.node.url("public"));
  std::optional<Result<Value>> entered;
  {
    const auto guard = first.enter_monitor();
    second.connection().asynchronous().enter_monitor(second.path(), std::chrono::milliseconds(-1),
                                                     [&](Result<Value> result) { entered = std::move(result); });
    CHECK(error_of([&] { (void)second.get("level"); }).code == ErrorCode::invalid_operation);
    CHECK_FALSE(entered);
  }
  // Well below the 5 s after which it would be told that it still has to wait.
  CHECK(second.connection().run_until([&] { return entered.has_value(); }, std::chrono::seconds(4)));
  CHECK(*entered);
  CHECK(error_of([&] { (void)first.get("level"); }).code == ErrorCode::invalid_operation);
}

TEST_CASE("a service that nobody could use is refused") {
  auto service = Service::from_text(definition, "vault", "Vault");
  SecurityPolicy policy;
  policy.require_valid_user = true;
  CHECK_THROWS_WITH(service->set_security(policy),
                    "service 'vault' requires a user, but has no authenticator: nobody could log in");
}
