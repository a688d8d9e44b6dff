// Definitions that a client has from an earlier session: told by a tag, and sent again only where they have changed.
#include "core/session/known_definitions.hpp"

#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

using Known = std::optional<std::vector<KnownDefinitions>>;

const std::string parts = R"(service test.parts
struct Size
  field double width
end
object Part
  property string name
end
)";

std::string hand(std::string_view more = {}) {
  return "service test.hand\nimport test.parts\nobject Hand\n  property test.parts.Size size\n"
         "  objref varobject finger\n" +
         std::string(more) + "end\n";
}

/// Behind `finger`: nothing that the root's definition imports.
const std::string fingers = "service test.fingers\nobject Finger\n  property double bend\nend\n";

class Hand : public PlainObject {
 public:
  Hand() : PlainObject("test.hand.Hand") {}
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition&,
                                                    const std::optional<std::string>&) override {
    return std::shared_ptr<ServiceObject>(std::make_shared<PlainObject>("test.fingers.Finger"));
  }
};

/// A client and a service `hand`, session after session.
struct Sessions : Loopback {
  explicit Sessions(const std::vector<std::string>& texts = {parts, hand(), fingers}) {
    auto types = std::make_shared<TypeRegistry>();
    types->add(texts, RobdefMode::compat).value();
    directory.add(HostedService::make("hand", std::make_shared<Hand>(), types).value()).value();
  }

  /// One more session. Returns whether it came to be.
  bool open(Known known, Features features = {}, std::string_view service_name = "hand") {
    ClientOptions options;
    options.connection.self = {client_id, "test.client"};
    options.connection.features = features;
    options.service = service_name;
    options.known_definitions = std::move(known);
    options.read_definitions = read;
    client = std::make_unique<ClientSession>(options, now);
    service = std::make_unique<ServiceSession>(directory, ServiceSessionOptions{}, now);
    requests.clear();
    answers.clear();
    exchange();
    return client->state() == ClientState::connected;
  }

  /// pump() that remembers.
  void exchange() {
    const auto take = [this](auto& from, auto& to, std::string& seen) {
      Bytes bytes;
      for (const auto slice : from.poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
      seen += as_text(bytes);
      from.handle_transmitted(bytes.size(), now);
      to.handle_bytes(bytes, now);
      return !bytes.empty();
    };
    while (take(*client, *service, requests) || take(*service, *client, answers)) {
    }
    while (const auto event = client->poll_event())
      if (const auto* done = std::get_if<Completed>(&*event))
        why_failed = done->result ? "" : done->result.error().message;
  }

  void find_finger() {
    requests.clear();
    answers.clear();
    client->find_object("hand.finger", now);
    exchange();
  }

  Known known() const { return client->known_definitions(); }
  bool has_sent(std::string_view text) const { return answers.find(text) != std::string::npos; }
  bool has_asked(std::string_view text) const { return requests.find(text) != std::string::npos; }

  std::shared_ptr<ReadDefinitions> read;  ///< null: each session reads its own
  std::string requests;
  std::string answers;
  std::string why_failed;  ///< the last request
};

const Known none_yet{std::in_place};

/// Has what the last session has read.
struct Read : ReadDefinitions {
  bool find(const std::vector<std::string>& texts, TypeRegistry& types) override {
    asked = texts;
    if (kept.definitions().size() != texts.size()) return false;
    types.share(kept);
    return true;
  }
  void keep(const TypeRegistry& types) override { kept = types; }

  std::vector<std::string> asked;
  TypeRegistry kept;
};

}  // namespace

TEST_CASE("a tag names texts in their order, and where each ends") {
  const auto tag = make_definitions_tag({"ab", "c"});
  CHECK(tag.size() == 36);
  CHECK(tag == make_definitions_tag({"ab", "c"}));
  CHECK(tag != make_definitions_tag({"a", "bc"}));
  CHECK(tag != make_definitions_tag({"c", "ab"}));
  CHECK(tag != make_definitions_tag({"ab", "c", ""}));
}

TEST_CASE("definitions that a client has are not sent again") {
  Sessions sessions;
  Features v2_only;
  v2_only.v4 = false;
  const auto features = GENERATE_COPY(Features{}, v2_only);
  REQUIRE(sessions.open(none_yet, features));
  CHECK(sessions.has_sent("object Hand"));
  CHECK(sessions.has_sent("object Part"));
  const auto known = sessions.known();
  REQUIRE(known->size() == 1);
  CHECK(known->front().texts == std::vector<std::string>{hand(), parts});

  REQUIRE(sessions.open(known, features));
  CHECK_FALSE(sessions.has_sent("object "));
  CHECK(sessions.client->object_type("hand")->find_member("size") != nullptr);
  CHECK(sessions.client->types().find_service("test.parts")->text == parts);
  CHECK(sessions.known()->front().texts == known->front().texts);
  CHECK(sessions.known()->front().tag == known->front().tag);
}

TEST_CASE("definitions that have changed are sent, and used") {
  Sessions before;
  REQUIRE(before.open(none_yet));
  Sessions after({parts, hand("  property double force\n"), fingers});
  REQUIRE(after.open(before.known()));
  CHECK(after.has_sent("property double force"));
  CHECK(after.client->object_type("hand")->find_member("force") != nullptr);
  CHECK(after.known()->size() == 1);
  CHECK(after.known()->front().texts.front() == hand("  property double force\n"));

  SECTION("and are known from then on") {
    REQUIRE(after.open(after.known()));
    CHECK_FALSE(after.has_sent("property"));
    CHECK(after.client->object_type("hand")->find_member("force") != nullptr);
  }
  SECTION("and those from before are as new for a service that has them back") {
    REQUIRE(before.open(after.known()));
    CHECK(before.has_sent("object Hand"));
    CHECK(before.client->object_type("hand")->find_member("force") == nullptr);
  }
}

TEST_CASE("what is known of another service is of no use, and does no harm") {
  Sessions sessions;
  REQUIRE(sessions.open(none_yet, {}, "arm"));
  REQUIRE(sessions.open(sessions.known()));
  CHECK(sessions.has_sent("object Hand"));
  CHECK(sessions.client->object_type("hand")->qualified_name == "test.hand.Hand");
}

TEST_CASE("a client that remembers nothing asks for nothing and gets what the reference sends") {
  Sessions sessions;
  REQUIRE(sessions.open(std::nullopt));
  CHECK_FALSE(sessions.has_asked(definitions_element));
  CHECK_FALSE(sessions.has_sent(definitions_element));
  CHECK(sessions.has_sent("object Hand"));
  CHECK_FALSE(sessions.known());
}

TEST_CASE("a peer that connects step by step sends its definitions each time") {
  Sessions sessions;
  Features older;
  older.combined_v2 = older.combined_v4 = false;
  REQUIRE(sessions.open(none_yet));
  REQUIRE(sessions.open(sessions.known(), older));
  CHECK_FALSE(sessions.has_asked(definitions_element));
  CHECK(sessions.has_sent("object Hand"));
}

TEST_CASE("a peer that knows nothing of tags sends its definitions each time") {
  Sessions sessions;
  REQUIRE(sessions.open(none_yet));
  const auto known = sessions.known();
  const bool leaves_them_out = GENERATE(false, true);
  const auto claimed = GENERATE(as<std::string>(), "", "another tag");

  ClientOptions options;
  options.connection.self = {client_id, "test.client"};
  options.service = "hand";
  options.known_definitions = known;
  sessions.client = std::make_unique<ClientSession>(options, sessions.now);
  sessions.service = std::make_unique<ServiceSession>(sessions.directory, ServiceSessionOptions{}, sessions.now);
  while (sessions.client->connection().state() != ConnectionState::open) {
    sessions.carry(*sessions.client, *sessions.service, 1u << 20);
    sessions.carry(*sessions.service, *sessions.client, 1u << 20);
  }
  sessions.lose_requests();
  sessions.forge(*sessions.service, [&](Message& message) {
    message.begin_entry(EntryType::connect_client_combined_ret, "hand", {}, 1);
    message.add_text("objecttype", "test.hand.Hand");
    if (!leaves_them_out) {
      static const std::string newer = hand("  property double force\n");
      message.begin_nested("servicedefs", DataType::list_t);
      message.add_numbered(0, DataType::string_t, static_cast<std::uint32_t>(newer.size()), as_bytes(newer));
      message.add_numbered(1, DataType::string_t, static_cast<std::uint32_t>(parts.size()), as_bytes(parts));
      message.end_nested();
    }
    if (!claimed.empty()) message.add_text(definitions_element, claimed);
  });
  sessions.carry(*sessions.service, *sessions.client, 1u << 20);

  if (leaves_them_out) {
    // Nothing that was not confirmed is used.
    const auto closed = sessions.next_client<SessionClosed>();
    CHECK(closed.reason.code == ErrorCode::service_error);
    CHECK_THAT(closed.reason.message, Catch::Contains("unknown type 'test.hand.Hand'"));
    return;
  }
  sessions.next_client<Connected>();
  CHECK(sessions.client->object_type("hand")->find_member("force") != nullptr);
  CHECK((sessions.known()->front().tag == claimed) == !claimed.empty());
}

TEST_CASE("definitions that were fetched for an object are known in the next session, too") {
  Sessions sessions;
  REQUIRE(sessions.open(none_yet));
  sessions.find_finger();
  CHECK(sessions.has_sent("object Finger"));
  REQUIRE(sessions.known()->size() == 2);
  CHECK(sessions.known()->back().name == "test.fingers");

  REQUIRE(sessions.open(sessions.known()));
  CHECK(sessions.client->types().find_service("test.fingers") == nullptr);
  sessions.find_finger();
  CHECK_FALSE(sessions.has_sent("object "));
  CHECK(sessions.client->object_type("hand.finger")->find_member("bend") != nullptr);

  SECTION("unless they have changed") {
    Sessions after({parts, hand(), "service test.fingers\nobject Finger\n  property double force\nend\n"});
    REQUIRE(after.open(sessions.known()));
    CHECK_FALSE(after.has_sent("object "));
    after.find_finger();
    CHECK(after.has_sent("property double force"));
    CHECK(after.client->object_type("hand.finger")->find_member("force") != nullptr);
  }
}

TEST_CASE("a lookup whose definition is being fetched can be given up, and finds nothing that was released meanwhile") {
  Sessions sessions;
  REQUIRE(sessions.open(none_yet));
  const auto id = sessions.client->find_object("hand.finger", sessions.now);
  sessions.carry(*sessions.client, *sessions.service, 1u << 20);
  sessions.carry(*sessions.service, *sessions.client, 1u << 20);  // the type, whose definition is asked for
  CHECK(sessions.client->pending_requests() == 1);
  SECTION("released") {
    sessions.service->release_path("hand.finger", sessions.now);
    sessions.pump();
    CHECK(sessions.next_client<PathReleased>().path == "hand.finger");
    const auto done = sessions.next_client<Completed>();
    CHECK(done.id == id);
    CHECK(done.result.error().code == ErrorCode::service_error);
  }
  SECTION("given up") {
    sessions.client->cancel(id);
    CHECK(sessions.client->pending_requests() == 0);
    sessions.pump();
    CHECK_FALSE(sessions.client->poll_event());
  }
  CHECK(sessions.client->object_type("hand.finger") == nullptr);
  CHECK(sessions.completion(sessions.client->find_object("hand.finger", sessions.now)));
}

TEST_CASE("a client remembers a bounded number of definitions") {
  Sessions sessions;
  auto many = none_yet;
  for (std::size_t i = 0; i < max_known_definitions; ++i) many->push_back({"test.n" + std::to_string(i), "tag", {""}});
  REQUIRE(sessions.open(many));
  CHECK(sessions.has_sent("object Hand"));
  CHECK(sessions.known()->size() == max_known_definitions);
}

TEST_CASE("a login that takes its time does not cost what the client has") {
  Sessions sessions;
  class Nobody final : public Authenticator {
    Result<AuthenticatedUser> authenticate(const LoginAttempt&) const override {
      return make_error(ErrorCode::internal_error, "not to be asked");
    }
  };
  REQUIRE(sessions.open(none_yet));
  const auto known = sessions.known();
  SecurityPolicy policy;
  policy.authenticator = std::make_shared<Nobody>();
  policy.require_valid_user = true;
  sessions.directory.find("hand")->set_policy(policy);
  ClientOptions options;
  options.connection.self = {client_id, "test.client"};
  options.service = "hand";
  options.username = "alice";
  options.credentials = Value(MapString{});
  options.known_definitions = known;
  sessions.client = std::make_unique<ClientSession>(options, sessions.now);
  sessions.service = std::make_unique<ServiceSession>(sessions.directory, ServiceSessionOptions{}, sessions.now);
  sessions.exchange();
  sessions.service->answer_login(sessions.next_service<LoginRequested>().id, AuthenticatedUser{"alice", {}, {}},
                                 sessions.now);
  sessions.answers.clear();
  sessions.exchange();
  CHECK(sessions.client->state() == ClientState::connected);
  CHECK_FALSE(sessions.has_sent("object Hand"));
}

TEST_CASE("definitions that would take more memory than a service needs are refused before they are read") {
  // Those of the root come before the service is believed, and have less room.
  const auto size = GENERATE(7u, 9u);
  Sessions sessions({parts, hand(), fingers + std::string(size * 1024 * 1024, '#') + "\n"});
  REQUIRE(sessions.open(none_yet));
  sessions.find_finger();
  CHECK((sessions.client->object_type("hand.finger") != nullptr) == (size == 7));
  CHECK(sessions.why_failed.empty() == (size == 7));
  if (size == 9) CHECK_THAT(sessions.why_failed, Catch::EndsWith("or have more than 8 MiB"));
  CHECK(sessions.client->state() == ClientState::connected);
}

TEST_CASE("definitions that another session has read are used as they are") {
  Sessions sessions;
  const auto read = std::make_shared<Read>();
  sessions.read = read;
  REQUIRE(sessions.open(std::nullopt));
  CHECK(read->asked == std::vector<std::string>{hand(), parts});
  CHECK(read->kept.find_service("test.hand") == sessions.client->types().find_service("test.hand"));
  const auto kept = read->kept;

  REQUIRE(sessions.open(std::nullopt));
  CHECK(sessions.client->types().find_service("test.hand") == kept.find_service("test.hand"));
  CHECK(sessions.client->types().find_service("test.parts") == kept.find_service("test.parts"));
  CHECK(sessions.client->object_type("hand") == kept.find_entity("test.hand.Hand"));
  // What an object behind a varobject brings is the session's alone.
  sessions.find_finger();
  CHECK(sessions.why_failed.empty());
  CHECK(sessions.client->types().find_service("test.fingers"));
  CHECK_FALSE(read->kept.find_service("test.fingers"));
}

TEST_CASE("definitions of a service that could not be connected to are not kept") {
  Sessions sessions({parts, hand(), fingers});
  const auto read = std::make_shared<Read>();
  sessions.read = read;
  REQUIRE_FALSE(sessions.open(std::nullopt, {}, "nothing"));
  CHECK(read->kept.definitions().empty());
}
