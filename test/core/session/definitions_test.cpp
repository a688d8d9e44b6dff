// What a service tells its clients of definitions and of the types of objects.
#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"

using namespace rr;
using namespace rr::test;

namespace {

const std::vector<std::string> level_definitions{
    "service x.base\nstdver 0.9\nobject Base\nend\n",
    "service x.top\nstdver 0.10\nimport x.base\n"
    "object Top\nimplements x.base.Base\nobjref Top other\nobjref Part part\nend\nobject Part\nend\n"};

class NewObject final : public PlainObject {
 public:
  NewObject() : PlainObject("x.top.Top") {}
  Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition& objref,
                                                    const std::optional<std::string>&) override {
    if (objref.name == "part") return std::shared_ptr<ServiceObject>(std::make_shared<PlainObject>("x.top.Part"));
    return std::shared_ptr<ServiceObject>(std::make_shared<NewObject>());
  }
};

/// A client that speaks by hand, to a service `top`.
class LeveledClient {
 public:
  explicit LeveledClient(std::string level, const std::vector<std::string>& definitions = level_definitions)
      : level_(std::move(level)) {
    auto types = std::make_shared<TypeRegistry>();
    types->add(definitions, RobdefMode::strict).value();
    auto extra_imports = unimported_definitions(*types, "x.top.Top");
    auto service = HostedService::make("top", std::make_shared<NewObject>(), types, {}, std::move(extra_imports));
    pair_.directory.add(std::move(*service)).value();
    pair_.lose_requests();
  }

  /// The texts of an element of the answer, lists of them in order, or the error's.
  std::vector<std::string> ask(EntryType type, std::string_view path, std::string_view element,
                               std::string_view wants_definitions = "true") {
    const auto endpoint = pair_.service->endpoint();
    pair_.forge(*pair_.client, [&](Message& message) {
      message.header.receiver_endpoint = endpoint;
      message.begin_entry(type, path, "", 7);
      message.add_text("clientversion", level_);
      message.add_text("returnservicedefs", wants_definitions);
    });
    pair_.carry(*pair_.client, *pair_.service, 1u << 20);
    Bytes bytes;
    for (const auto slice : pair_.service->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    pair_.service->handle_transmitted(bytes.size(), pair_.now);
    Message answer;
    decode(bytes, {}, answer).value();
    const auto& entry = answer.entries.front();
    const bool has_failed = entry.error != ErrorCode::none;
    const auto* found = answer.elements_of(entry).find(has_failed ? "errorstring" : element);
    if (!found) return {};
    if (found->type == DataType::string_t) return {std::string(found->text())};
    std::vector<std::string> texts;
    for (const auto& each : answer.children_of(*found)) texts.emplace_back(each.text());
    return texts;
  }

 private:
  std::string level_;
  Loopback pair_;
};

using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("clients are told of the newest type that they know, with its definitions alone") {
  SECTION("newer than all") {
    LeveledClient client("1.2.8");
    CHECK(client.ask(EntryType::get_service_desc, "top", "servicedef") == Texts{level_definitions[1]});
    CHECK(client.ask(EntryType::object_type_name, "top", "objecttype") == Texts{"x.top.Top"});
    CHECK(client.ask(EntryType::object_type_name, "top.part", "objecttype") == Texts{"x.top.Part"});
    CHECK(client.ask(EntryType::connect_client_combined, "top", "servicedefs") == level_definitions);
    CHECK(client.ask(EntryType::object_type_name, "top.other", "objecttype") == Texts{"x.top.Top"});
  }
  SECTION("as new as the base") {
    LeveledClient client("0.9");
    CHECK(client.ask(EntryType::get_service_desc, "top", "servicedef") == Texts{level_definitions[0]});
    CHECK(client.ask(EntryType::object_type_name, "top", "objecttype") == Texts{"x.base.Base"});
    CHECK(client.ask(EntryType::object_type_name, "top.other", "objecttype") == Texts{"x.base.Base"});
    CHECK(client.ask(EntryType::object_type_name, "top.part", "objecttype") == Texts{"Object not found"});
    SECTION("combined") {
      CHECK(client.ask(EntryType::connect_client_combined, "top", "servicedefs") == Texts{level_definitions[0]});
    }
    SECTION("step by step") {
      CHECK(client.ask(EntryType::connect_client, "top", "").empty());
    }
    CHECK(client.ask(EntryType::object_type_name, "top", "objecttype") == Texts{"x.base.Base"});
    CHECK(client.ask(EntryType::object_type_name, "top.other", "objecttype") == Texts{"x.base.Base"});
    CHECK(client.ask(EntryType::object_type_name, "top.part", "objecttype") ==
          Texts{"Service requires newer client version"});
  }
  SECTION("older than all") {
    LeveledClient client("0.8");
    CHECK(client.ask(EntryType::get_service_desc, "top", "servicedef") == Texts{"Service not found"});
    CHECK(client.ask(EntryType::object_type_name, "top", "objecttype") == Texts{"Object not found"});
    CHECK(client.ask(EntryType::connect_client_combined, "top", "servicedefs") == Texts{"Service not found"});
    CHECK(client.ask(EntryType::connect_client, "top", "").empty());
    CHECK(client.ask(EntryType::object_type_name, "top", "objecttype") ==
          Texts{"Service requires newer client version"});
  }
}

TEST_CASE("what the root's definition does not import is an extra import, which clients get as well") {
  const std::string unit = "service x.unit\nstdver 0.10\nstruct Unit\nfield string name\nend\n";
  const std::string value = "service x.value\nstdver 0.10\nimport x.unit\nstruct Value\nfield x.unit.Unit unit\nend\n";
  LeveledClient client("1.2.8", {level_definitions[0], level_definitions[1], unit, value});
  CHECK(client.ask(EntryType::get_service_desc, "top", "extraimports") == Texts{"x.unit", "x.value"});
  CHECK(client.ask(EntryType::connect_client_combined, "top", "servicedefs") ==
        Texts{level_definitions[0], level_definitions[1], unit, value});
}

TEST_CASE("clients of an older level get those extra imports that they can read") {
  const std::string unit = "service x.unit\nstdver 0.10\nstruct Unit\nfield string name\nend\n";
  const std::string value = "service x.value\nstdver 0.9\nstruct Value\nfield string name\nend\n";
  LeveledClient client("0.9", {level_definitions[0], level_definitions[1], unit, value});
  CHECK(client.ask(EntryType::get_service_desc, "top", "extraimports") == Texts{"x.value"});
  CHECK(client.ask(EntryType::connect_client_combined, "top", "servicedefs") == Texts{level_definitions[0], value});
}

TEST_CASE("a service's attributes are told by the path of any of its objects") {
  LeveledClient client("1.2.8");
  CHECK(client.ask(EntryType::get_service_attributes, "top", "return").empty());
  CHECK(client.ask(EntryType::get_service_attributes, "top.part", "return").empty());
  CHECK(client.ask(EntryType::get_service_attributes, "other.part", "return") == Texts{"Service not found"});
}

TEST_CASE("definitions stay away however a client says that it does not want them") {
  const std::string_view no = GENERATE("false", "FALSE", "fAlse", " False ", "0", "\t0");
  CHECK(LeveledClient("1.2.8").ask(EntryType::connect_client_combined, "top", "servicedefs", no).empty());
  const std::string_view yes = GENERATE("true", "1", "no", "");
  CHECK(LeveledClient("1.2.8").ask(EntryType::connect_client_combined, "top", "servicedefs", yes) == level_definitions);
}
