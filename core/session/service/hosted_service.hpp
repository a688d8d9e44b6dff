// The services of a node, as sessions see them. Layer: session. Source: sessions spec sections 2.3, 2.4, 2.5, 2.16.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/connection.hpp"
#include "core/session/service/authenticator.hpp"
#include "core/session/service/endpoint_numbers.hpp"
#include "core/session/service/monitor_locks.hpp"
#include "core/session/service/object_locks.hpp"
#include "core/types/type_registry.hpp"
#include "core/types/value.hpp"

namespace rr {

/// One object of a service: its type and the way to its children. What its members do is the application's business:
/// a session hands requests out as events that name the object.
class ServiceObject {
 public:
  virtual ~ServiceObject() = default;

  /// The qualified object type, "com.x.Robot"; the same for the object's whole life.
  virtual const std::string& type_name() const = 0;
  /// The object behind an objref. Sessions cache it by path until the path is released.
  /// `index`  the decoded index where the objref is indexed (for int32 checked to be a decimal number).
  /// Errors   object_not_found; service_error "Requested object is null".
  virtual Result<std::shared_ptr<ServiceObject>> find_child(const MemberDefinition& objref,
                                                            const std::optional<std::string>& index) = 0;
  /// Whether clients may take turns at this object by its monitor lock.
  virtual bool is_monitor_lockable() const { return false; }
};

/// A direct base of `type` as peers expect its name: objects of the same definition without it, all others with theirs
/// (also where the definition names them by an alias).
std::string_view implements_name(const EntityDefinition& type, const ImplementsDefinition& base);

/// What the objref's type says about the index, which is decoded: required or not, number or text.
/// Errors   invalid_argument.
Result<> check_index(const MemberDefinition& objref, const std::optional<std::string>& index);

/// The definitions of `types` that the one of `root_type` does not import.
std::vector<std::string> unimported_definitions(const TypeRegistry& types, std::string_view root_type);

/// Whether objects that are found stay for others.
enum class RememberObjects : std::uint8_t { no, yes };

/// One service of a node.
class HostedService {
 public:
  /// `types` holds the root type's definition and everything that it imports. `extra_imports` are others of them that
  /// clients get when they connect: for what a varvalue holds.
  /// Errors   service_definition_error: the root type is not an object in `types`; invalid_argument: a bad name.
  static Result<std::shared_ptr<HostedService>> make(std::string name, std::shared_ptr<ServiceObject> root,
                                                     std::shared_ptr<const TypeRegistry> types,
                                                     MapString attributes = {},
                                                     std::vector<std::string> extra_imports = {});

  const std::string& name() const { return name_; }
  const TypeRegistry& types() const { return *types_; }
  const std::shared_ptr<const TypeRegistry>& shared_types() const { return types_; }
  const EntityDefinition& root_type() const { return *root_type_; }
  const std::string& root_type_name() const { return root_->type_name(); }
  /// A MapString of numbers and texts.
  const Value& attributes() const { return attributes_; }
  /// Who may do what. Another authenticator holds for the next login, the rest is to be set before clients come.
  const SecurityPolicy& policy() const { return policy_; }
  void set_policy(SecurityPolicy policy) { policy_ = std::move(policy); }
  LoginLimit& login_limit() { return login_limit_; }
  SessionId next_session_id() { return ++last_session_id_; }
  /// The objects are another node's: what they are takes time to find out, so that sessions ask for them (ObjectWanted)
  /// and for locks (LockWanted). To be set before clients come.
  bool is_remote() const { return is_remote_; }
  void set_remote() { is_remote_ = true; }
  ObjectLocks& object_locks() { return object_locks_; }
  MonitorLocks& monitor_locks() { return monitor_locks_; }
  /// As what a client of this level sees an object of `type`: the type, else the first that it implements, whose
  /// definition is of that level at most. nullptr: the client knows none of them.
  const EntityDefinition* type_for_client(const EntityDefinition& type, const Version& client) const;
  /// The one that holds `type`.
  const ServiceDefinition& definition_of(const EntityDefinition& type) const;
  /// The extra imports that a client of this level can read.
  std::vector<std::string_view> extra_imports_for_client(const Version& client) const;
  /// What a client needs that sees the root as `root`: its definition, its extra imports and all that these import; in
  /// order of names.
  std::vector<const ServiceDefinition*> definitions_for_client(const EntityDefinition& root,
                                                               const Version& client) const;

  struct Found {
    std::shared_ptr<ServiceObject> object;
    const EntityDefinition* type = nullptr;
  };
  /// Walks the path from the root and remembers what it finds, so that it is the same for all. Where there is no room,
  /// a path that no client uses is forgotten for it. Errors   those of parse_service_path; object_not_found (not this
  /// service, null object); member_not_found;
  ///          invalid_argument (a missing or malformed index); out_of_system_resource.
  Result<Found> find_object(std::string_view path, RememberObjects remembers = RememberObjects::yes);
  /// The path of an object that was found is remembered for as long as its caller has this, unless it is released.
  std::shared_ptr<const void> use_object(std::string_view path);
  bool has_object(std::string_view path) const { return objects_.contains(path); }
  /// An object of a remote service that was found. Where there is no room, a path that no client uses is forgotten for
  /// it. Errors   service_definition_error: its type is not known; out_of_system_resource.
  Result<> add_object(const std::string& path, std::shared_ptr<ServiceObject> object);
  /// Forgets `path`, its other spellings and everything below, and frees what is locked of these. Returns the spellings
  /// that clients have used.
  std::vector<std::string> forget_path(std::string_view path);
  /// All paths under which `object` is known.
  std::vector<std::string> paths_of(const ServiceObject& object) const;

 private:
  struct Known : Found {
    explicit Known(Found found) : Found(std::move(found)) {}
    std::shared_ptr<const void> use = nullptr;  ///< shared with whoever uses the path; null: nobody has yet
  };
  using Objects = std::map<std::string, Known, std::less<>>;

  HostedService() = default;
  void remember(std::string path, Found found);
  bool make_room(std::string_view path);
  static Error no_room(std::string_view path);
  Objects::iterator forget(Objects::iterator object);

  std::string name_;
  std::shared_ptr<ServiceObject> root_;
  std::shared_ptr<const TypeRegistry> types_;
  const EntityDefinition* root_type_ = nullptr;
  Value attributes_;
  std::vector<std::string> extra_imports_;
  SecurityPolicy policy_;
  LoginLimit login_limit_;
  SessionId last_session_id_ = 0;
  ObjectLocks object_locks_;
  MonitorLocks monitor_locks_;
  bool is_remote_ = false;
  Objects objects_;
  std::set<std::pair<const ServiceObject*, std::string_view>> paths_;  ///< the same by object; the keys of objects_
  static constexpr std::size_t max_cached_objects = 4096;  ///< hostile paths may not grow it; the root always stays
};

/// Another node that a service index tells of.
struct KnownNode {
  NodeIdentity node;
  std::vector<std::string> index_urls;  ///< of its service index
  std::string known_as = {};            ///< as what ServiceSessionOptions::admit is asked about it
};

/// Identity and services of one node; outlives its sessions.
class ServiceDirectory {
 public:
  explicit ServiceDirectory(NodeIdentity identity);

  const NodeIdentity& identity() const { return identity_; }
  /// Errors   invalid_argument: the name is taken.
  Result<> add(std::shared_ptr<HostedService> service);
  bool remove(std::string_view name);
  std::shared_ptr<HostedService> find(std::string_view name) const;  ///< nullptr where there is none
  /// In order of names; the service index is one of them.
  const std::map<std::string, std::shared_ptr<HostedService>, std::less<>>& services() const { return services_; }
  /// Nodes that this one leads to, and those that it has discovered, for the service index; asked with the URL of the
  /// connection that the question came by.
  using ListNodes = std::function<std::vector<KnownNode>(std::string_view base_url)>;
  void set_routed_nodes(ListNodes list) { routed_ = std::move(list); }
  void set_detected_nodes(ListNodes list) { detected_ = std::move(list); }
  std::vector<KnownNode> routed_nodes(std::string_view base_url) const {
    return routed_ ? routed_(base_url) : std::vector<KnownNode>();
  }
  std::vector<KnownNode> detected_nodes(std::string_view base_url) const {
    return detected_ ? detected_(base_url) : std::vector<KnownNode>();
  }
  /// Of the node's half of its sessions.
  EndpointNumbers& endpoints() { return endpoints_; }

 private:
  NodeIdentity identity_;
  std::map<std::string, std::shared_ptr<HostedService>, std::less<>> services_;
  EndpointNumbers endpoints_;
  ListNodes routed_;
  ListNodes detected_;
};

}  // namespace rr
