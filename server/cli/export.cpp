// rrgate export: the messages of a recorded member as comma-separated values. Layer: server/cli.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <set>

#include "server/cli/command.hpp"
#include "server/cli/csv.hpp"
#include "server/record/recording.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_columns = 10'000;

struct ExportOptions {
  std::string file;
  std::string member;
  std::string output;
  bool is_csv = false;
  bool is_json = false;
};

/// What the member told: of an event its arguments.
const rr::Json& value_of(const RecordedMember& member, const rr::Json& document) {
  return member.kind == rr::MemberKind::event ? document : document["value"];
}

/// "/value/x" of {"value": {"x": 1}} is "/x", as `rrgate watch --csv` has it.
rr::Json cells_of(const RecordedMember& member, const rr::Json& document) {
  const auto flat = value_of(member, document).flatten();
  return flat.is_object() ? flat : rr::Json{{"", flat}};
}

class CsvExport {
 public:
  CsvExport(Recording& recording, const RecordedMember& member) : recording_(recording), member_(member) {}

  rr::Result<> write(std::ostream& out) {
    auto looked = for_each([this](const McapMessage&, const rr::Json& cells) { add_columns(cells); });
    if (!looked) return looked;
    if (columns_.size() > max_columns)
      return rr::make_error(rr::ErrorCode::out_of_range,
                            member_.topic + " has more than " + std::to_string(max_columns) + " columns");
    out << "time";
    for (const auto& column : columns_) out << "," << csv_cell(column.empty() ? "value" : column);
    out << "\n";
    return for_each([&](const McapMessage& message, const rr::Json& cells) {
      out << mcap_time_text(message.publish_time);
      for (const auto& column : columns_) {
        const auto cell = cells.find(column);
        out << "," << (cell == cells.end() ? "" : csv_cell(*cell));
      }
      out << "\n";
    });
  }

 private:
  /// In the order in which they are met, so that a longer array adds its columns behind.
  void add_columns(const rr::Json& cells) {
    for (const auto& [column, cell] : cells.items())
      if (columns_.size() <= max_columns && known_.insert(column).second) columns_.push_back(column);
  }
  rr::Result<> for_each(const std::function<void(const McapMessage&, const rr::Json& cells)>& take) {
    return recording_.for_each(member_, [&](const McapMessage& message) -> rr::Result<> {
      const auto document = recording_.read_document(message);
      if (!document) return document.error();
      take(message, cells_of(member_, *document));
      return {};
    });
  }

  Recording& recording_;
  const RecordedMember& member_;
  std::vector<std::string> columns_;
  std::set<std::string> known_;
};

/// A line for each message, as `rrgate watch --json` has it: {"time": ..., "value": ...}.
rr::Result<> write_json_lines(Recording& recording, const RecordedMember& member, std::ostream& out) {
  return recording.for_each(member, [&](const McapMessage& message) -> rr::Result<> {
    const auto document = recording.read_document(message);
    if (!document) return document.error();
    auto line = rr::OrderedJson::object();
    line["time"] = mcap_time_text(message.publish_time);
    line["value"] = value_of(member, *document);
    out << line.dump() << "\n";
    return {};
  });
}

std::string topics_of(const Recording& recording) {
  std::string out;
  for (const auto& [channel, member] : recording.members()) out += (out.empty() ? "" : ", ") + member.topic;
  return out.empty() ? "none" : out;
}

const RecordedMember* find_member(const Recording& recording, const std::string& name) {
  const RecordedMember* found = nullptr;
  for (const auto& [channel, member] : recording.members()) {
    if (member.topic == name) return &member;
    if (!name.empty() && !member.topic.ends_with("/" + name)) continue;
    if (found) return nullptr;  // two by the same name
    found = &member;
  }
  return found;
}

int run_export(const ExportOptions& options) {
  if (!options.is_csv && !options.is_json) return usage_error("export", "expected --csv or --json");
  std::error_code error;
  if (std::filesystem::equivalent(options.file, options.output, error))
    return usage_error("export", options.output + " is the recording itself; -o takes another file");
  auto recording = Recording::open(options.file);
  if (!recording) return report_failure("export", recording.error().message);
  const auto* member = find_member(*recording, options.member);
  if (!member)
    return usage_error(
        "export", options.file + ": " +
                      (options.member.empty() ? "more than one member" : "no one member " + rr::quote(options.member)) +
                      "; --member takes one of: " + topics_of(*recording));
  std::ofstream file;
  if (!options.output.empty()) file.open(options.output, std::ios::binary | std::ios::trunc);
  auto& out = options.output.empty() ? std::cout : static_cast<std::ostream&>(file);
  const auto written =
      options.is_json ? write_json_lines(*recording, *member, out) : CsvExport(*recording, *member).write(out);
  if (!written) return report_failure("export", written.error().message);
  return out.flush() ? exit_ok : report_failure("export", options.output + ": can't be written");
}

}  // namespace

void add_export(Commands& commands) {
  const auto [app, options] = commands.add("export", "Write a member of a recording as a table", run_export);
  app.add_option("FILE", options.file, "A file of \"rrgate record\"")->required()->option_text(" ");
  auto* csv = app.add_flag("--csv", options.is_csv, "One line for each message, one column for each number");
  app.add_flag("--json", options.is_json, "One line of JSON for each message")->excludes(csv);
  app.add_option("--member", options.member, "Member, as \"rrgate info FILE\" lists it: \"/Create/state\", \"state\"")
      ->option_text("MEMBER");
  app.add_option("-o", options.output, "File to write; default: standard output")->option_text("OUT");
}

}  // namespace rrgate
