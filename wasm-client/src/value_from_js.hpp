// JavaScript value -> Value, driven by the definition. Layer: wasm-client/src.
// The table of forms stands in wasm-client/README.md.
#pragma once

#include <optional>

#include "core/types/field_path.hpp"
#include "core/types/type_registry.hpp"
#include "core/types/value.hpp"
#include "wasm-client/src/js_access.hpp"

namespace rr {

/// Reads `js` as a value of `type`. Sizes that the type declares are left to pack(); everything that depends on
/// JavaScript is checked here.
/// `path`   where the value stands, for messages: "set 'pose.q[2]' (com.x.Pose): ..."
/// Errors   data_type_mismatch, data_type_error, out_of_range, null_value, invalid_argument.
Result<Value> from_js(const JsValue& js, const TypeDefinition& type, const TypeRegistry& types, const FieldPath& path);

/// One use, one value; functions return false after the first failure, which take_error() then holds.
class FromJs {
 public:
  explicit FromJs(const TypeRegistry& types) : types_(types) {}

  bool read(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out);
  /// A varvalue: the type comes from rrValue(), from the mark of a received value, or from the value itself.
  bool infer(const FieldPath& path, const JsValue& js, Value& out);
  Error take_error() { return std::move(*error_); }

 private:
  // value_from_js.cpp
  bool read_item(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out);
  bool read_scalar(const FieldPath& path, const JsValue& js, DataType type, Scalar& out);
  bool read_enum(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out);
  bool read_text(const FieldPath& path, const JsValue& js, std::string& out);
  template <class ReadOne>
  bool read_list(const FieldPath& path, const JsValue& js, Value& out, ReadOne read_one);
  template <class ReadOne>
  bool read_map_int32(const FieldPath& path, const JsValue& js, Value& out, ReadOne read_one);
  template <class ReadOne>
  bool read_map_string(const FieldPath& path, const JsValue& js, Value& out, ReadOne read_one);
  bool read_map_items(const FieldPath& path, const JsValue& js, std::vector<std::pair<JsValue, JsValue>>& out);

  // array_from_js.cpp
  bool read_array(const FieldPath& path, const JsValue& js, DataType type, Array& out);
  template <class T>
  bool read_numbers(const FieldPath& path, const JsValue& js, std::size_t count, Array& out);
  bool read_booleans(const FieldPath& path, const JsValue& js, std::size_t count, Array& out);
  bool read_complex(const FieldPath& path, const JsValue& js, DataType type, Array& out);
  bool read_shape(const FieldPath& path, const JsValue& js, std::vector<std::uint32_t>& dims, JsValue& data);
  bool read_length(const FieldPath& path, const JsValue& js, std::size_t& out);

  // named_from_js.cpp
  bool read_named(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out);
  bool read_fields(const FieldPath& path, const JsValue& js, const EntityDefinition& entity, std::string_view type_name,
                   Structure& out);
  bool read_pods(const FieldPath& path, const JsValue& js, const EntityDefinition& entity, std::string_view type_name,
                 PodArray& out);
  bool read_named_arrays(const FieldPath& path, const JsValue& js, const EntityDefinition& entity,
                         std::string_view type_name, Bytes& out);
  bool flatten(const FieldPath& path, const JsValue& js, const EntityDefinition& entity, std::string_view type_name,
               Bytes& out);
  bool check_there(const FieldPath& path, const JsValue& js, const TypeDefinition& type);
  bool check_keys(const FieldPath& path, const JsValue& js, const EntityDefinition& entity, std::string_view type_name);

  // varvalue_from_js.cpp
  bool infer_number(const FieldPath& path, const JsValue& js, Value& out);
  bool infer_array(const FieldPath& path, const JsValue& js, Value& out);
  bool infer_object(const FieldPath& path, const JsValue& js, Value& out);

  bool item_at(const FieldPath& path, const JsValue& js, std::size_t index, std::optional<JsValue>& out);
  bool field_of(const FieldPath& path, const JsValue& js, std::string_view name, std::optional<JsValue>& out);
  bool fail(ErrorCode code, const FieldPath& path, std::string_view text);
  bool fail_mismatch(const FieldPath& path, const JsValue& found, std::string_view expected);
  /// Application code (a getter, a Proxy) threw.
  bool fail_throwing(const FieldPath& path);

  /// Counts how deep read() and infer() are: an object may hold itself.
  struct Level {
    explicit Level(int& level) : level_(++level) {}
    ~Level() { --level_; }
    int& level_;
  };
  static constexpr int max_depth = 256;  // a message nests 128, and a varvalue counts twice
  /// Of arrays that are no TypedArrays; well above what a message may hold.
  static constexpr std::size_t max_items = 16u * 1024 * 1024;

  const TypeRegistry& types_;
  std::optional<Error> error_;
  int depth_ = 0;
};

}  // namespace rr
