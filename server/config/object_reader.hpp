// Reads one JSON object member by member, collecting findings and the list of options. Layer: server/config.
//
// The members that are asked for are the members that exist: the same code that fills the structs also says, in
// config_options(), what can be set, so the schema can be held against it by a test.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/node_id.hpp"
#include "server/config/finding.hpp"

namespace rrgate {

/// Where one reading puts what it notices.
struct ReadLog {
  std::vector<Finding> findings;
  std::vector<OptionInfo>* options = nullptr;  ///< set: describe instead of read; no findings are made
};

struct IntegerRange {
  std::int64_t minimum;
  std::int64_t maximum;
};

/// What is wrong with a text: "found 'x', expected " and what was.
std::string wrong_text(std::string_view found, std::string_view expected);

class ObjectReader {
 public:
  /// `value` is borrowed; anything but an object is a finding and reads as an empty one.
  ObjectReader(const nlohmann::json& value, std::string path, ReadLog& log);

  /// Each leaves its target alone when the member is missing or wrong.
  void size(std::string_view key, std::size_t& target, IntegerRange range);
  void duration(std::string_view key, std::chrono::milliseconds& target, IntegerRange range);
  void text(std::string_view key, std::string& target);
  void flag(std::string_view key, bool& target);
  /// Any JSON, as its text. `type`  empty: of any type.
  void json(std::string_view key, std::string_view type, std::string& target);
  void choice(std::string_view key, std::string& target, std::vector<std::string> choices);
  /// `read` turns the text into something else and returns what is wrong with it, or "".
  using ReadText = std::function<std::string(const std::string&)>;
  void required_text(std::string_view key, const ReadText& read);
  /// Any text, also an empty one.
  void required_text(std::string_view key, std::string& target);
  void texts(std::string_view key, bool is_required, const ReadText& read);
  /// A UUID that is not all zeros. Returns   whether there is a text, right or wrong.
  bool node_id(std::string_view key, rr::NodeId& target);
  /// Names of files, none of them empty.
  void required_file(std::string_view key, std::string& target);
  void files(std::string_view key, std::vector<std::string>& target);
  /// Two numbers by any name each, the first at most the second.
  using ReadRange = std::function<void(const std::string& name, double least, double most)>;
  void ranges(std::string_view key, const ReadRange& read);
  using ReadObject = std::function<void(ObjectReader&)>;
  void object(std::string_view key, const ReadObject& read);
  void objects(std::string_view key, bool is_required, const ReadObject& read);

  /// Reports the members that nobody asked for.
  void finish();
  const std::string& path() const { return path_; }
  void finding(std::string_view key, std::string text);

 private:
  const nlohmann::json* find(std::string_view key, std::string_view type, OptionInfo description);
  void integer(std::string_view key, IntegerRange range, std::int64_t current,
               const std::function<void(std::int64_t)>& store);
  void item_text(const nlohmann::json& value, const std::string& path, const ReadText& read);
  bool describes() const { return log_.options != nullptr; }

  const nlohmann::json& value_;
  std::string path_;
  ReadLog& log_;
  std::vector<std::string> known_;
};

}  // namespace rrgate
