// One request to an object of a device: which object, which member, in which form. Layer: server/http/endpoints.
// Source: service definitions spec section 5.12, "JSON Schema / OpenAPI".
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "server/http/response_writer.hpp"
#include "server/http/split_path.hpp"
#include "server/json/value_from_json.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

enum class BodyForm : std::uint8_t { json, cbor, bytes };

/// Where a path leads, and what can be asked there. `member` null: to the object itself.
struct Target {
  std::shared_ptr<ValueClient> client;
  std::shared_ptr<const rr::TypeRegistry> registry;
  std::shared_ptr<SharedObject> object;
  const rr::EntityDefinition* type = nullptr;
  const rr::MemberDefinition* member = nullptr;
  bool is_shape = false;  ///< ".../MEMORY/shape"

  const rr::TypeRegistry& types() const { return *registry; }
  const std::string& path() const { return object->path(); }
  MemberPlace place() const { return {path(), member, registry}; }

  /// Asks the device for something of the member. They throw   rr::Exception.
  rr::Called request(rr::CallKind kind) const;
  rr::awaitable<rr::Value> ask(rr::CallKind kind) const;
  rr::awaitable<rr::Value> ask(rr::CallKind kind, rr::Value value) const;
};

/// Whether values of the type are read and written without the registry: it grows, on the gateway's thread, when a
/// client opens an object whose definition comes later. Workers must not look into it.
bool is_apart(const rr::TypeDefinition& type);
/// Those of all parameters.
bool is_apart(const std::vector<rr::ParameterDefinition>& parameters);

/// to_json() of the target, on a worker where the value is large and apart. All are borrowed for the wait.
rr::awaitable<rr::OrderedJson> json_of(const Target& target, const rr::Value& value, const rr::JsonForm& form,
                                       Workers& workers);

/// WWW-Authenticate where it is the device that wants a login.
inline constexpr const char* device_challenge = "Basic realm=\"device\"";

/// Whose session a request uses: user and password of HTTP Basic authentication, where they are not for the gateway.
/// Errors   those of basic_credentials().
rr::Result<SessionKey> session_key(GatewayState& gateway, const Request& request, std::string service);
/// A client of that session, for somebody from there. Where a login has to be judged by the device first, that is
/// bounded and recorded. Errors   those of ValueClients::open() and Logins::begin_at_device().
rr::awaitable<rr::Result<std::shared_ptr<ValueClient>>> open_session(GatewayState& gateway,
                                                                     std::shared_ptr<Device> device, SessionKey key,
                                                                     ClientOrigin from);
/// To do something to what a path leads to. Borrows the target.
AccessRequest access_request(const Target& target, Verb verb);
/// What the query says of the form of values.
rr::JsonForm json_form(const Request& request);

/// Borrows the request.
class ObjectRequest {
 public:
  ObjectRequest(ResponseWriter& writer, GatewayState& gateway);

  ResponseWriter& writer() const { return writer_; }
  GatewayState& gateway() const { return gateway_; }
  const Request& request() const { return writer_.request(); }
  http::verb method() const { return request().message.method(); }
  bool is_read() const { return method() == http::verb::get || method() == http::verb::head; }

  /// Which form the answer has, by Accept: JSON unless CBOR or bytes are named first.
  BodyForm wanted() const { return wanted_; }
  bool wants_events() const { return wants_events_; }
  /// The type of image that the answer has where the value is one, by Accept or ?as=png, ?as=jpeg; empty: none.
  std::string_view wanted_image() const { return wanted_image_; }
  /// Images one after another: multipart/x-mixed-replace, or ?as=mjpeg.
  bool wants_motion() const { return wants_motion_; }
  const rr::JsonForm& form() const { return form_; }
  std::optional<std::string> option(std::string_view name) const;

  /// What `make` makes of the body, read by Content-Type; on a worker where the body is large, which calls `make` as
  /// well where that `is_apart`. Errors   those of `make`; data_serialization_error; invalid_argument: another type;
  /// out_of_system_resource: there is no memory left for it.
  template <class Make>
  rr::awaitable<std::invoke_result_t<Make, const rr::Json&>> from_body(bool is_apart, Make make) const {
    auto room = writer_.memory().sibling();
    if (const auto admitted = co_await admit_body(room); !admitted) co_return admitted.error();
    const auto work = [this, &make]() -> std::invoke_result_t<Make, const rr::Json&> {
      const auto json = read_body();
      if (!json) return json.error();
      return make(*json);
    };
    if (!has_large_body()) co_return work();
    if (is_apart) co_return co_await gateway_.workers().run(work);
    // Named: g++ 12 destroys twice what is made within an expression that waits.
    const auto read = [this] { return read_body(); };
    auto json = co_await gateway_.workers().run(read);
    if (!json) co_return json.error();
    auto made = make(*json);
    auto free = [freed = std::move(*json)] { return freed.size(); };
    co_await gateway_.workers().run(std::move(free));
    co_return made;
  }
  bool has_bytes_body() const;

  rr::awaitable<Response> value_response(rr::OrderedJson json) const;
  /// The same of `value` as JSON, or of an object with that alone; made on a worker where it is large. Borrows for the
  /// wait.
  rr::awaitable<Response> value_response(const Target& target, const rr::Value& value,
                                         std::string_view name = {}) const;
  /// JSON with a line's end, or CBOR; written on a worker where it is large. nullopt: there is no memory left for that.
  rr::awaitable<std::optional<std::string>> write_document(rr::OrderedJson json, bool is_cbor) const;
  Response written_response() const;  ///< 204
  Response error_response(const rr::Error& error, const rr::TypeRegistry* types) const;
  /// 405 with what is possible.
  Response method_response(std::string_view allowed) const;

 private:
  bool has_cbor_body() const;
  bool has_large_body() const;
  rr::awaitable<rr::Result<>> admit_body(MemoryBudget::Charge& room) const;
  rr::Result<rr::Json> read_body() const;

  ResponseWriter& writer_;
  GatewayState& gateway_;
  BodyForm wanted_ = BodyForm::json;
  bool wants_events_ = false;
  std::string_view wanted_image_;
  bool wants_motion_ = false;
  rr::JsonForm form_;
};

/// The HTTP status that says best what a Robot Raconteur error says.
unsigned status_of(rr::ErrorCode code);

/// Whether the asker may look for an object of a service, before the device is asked for it.
using LookJudge = std::function<rr::Result<>(const AccessRequest& object)>;

/// Walks, in a session that is open, from the root object along `segments`, percent-decoded: objrefs by name, an index
/// behind those that have one, at last a member or nothing. Errors   object_not_found, member_not_found, those of the
/// judge. Throws   rr::Exception: what the device says.
rr::awaitable<rr::Result<std::shared_ptr<Target>>> find_target(std::shared_ptr<ValueClient> client,
                                                               std::vector<std::string> segments, LookJudge may_look);

}  // namespace rrgate
