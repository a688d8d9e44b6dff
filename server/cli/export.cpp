// rrgate export: the messages of a recorded member as comma-separated values. Layer: server/cli.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>
#include <set>

#include "server/cli/command.hpp"
#include "server/cli/csv.hpp"
#include "server/cli/progress.hpp"
#include "server/record/recording.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_columns = 10'000;

struct ExportOptions {
  std::vector<std::string> files;
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
rr::Json cells_of(const rr::Json& value) {
  const auto flat = value.flatten();
  return flat.is_object() ? flat : rr::Json{{"", flat}};
}

/// The messages of a member, which may be passed through several times.
class MessagePasses {
 public:
  /// `shows_progress`  not where that would stand among what is written.
  MessagePasses(Recording& recording, const RecordedMember& member, std::uint64_t passes, bool shows_progress)
      : recording_(recording), member_(member) {
    if (shows_progress) progress_.emplace("exporting", passes * member.message_count);
  }

  /// Calls `take` with each message, and what the member told.
  rr::Result<> for_each(const std::function<void(const McapMessage&, const rr::Json& value)>& take) {
    return recording_.for_each(member_, [&](const McapMessage& message) -> rr::Result<> {
      const auto document = recording_.read_document(message);
      if (!document) return document.error();
      take(message, value_of(member_, *document));
      if (progress_) progress_->show(++done_);
      return {};
    });
  }

 private:
  Recording& recording_;
  const RecordedMember& member_;
  std::optional<Progress> progress_;
  std::uint64_t done_ = 0;
};

class CsvExport {
 public:
  CsvExport(Recording& recording, const RecordedMember& member, bool shows_progress)
      : topic_(member.topic), messages_(recording, member, 2, shows_progress) {}

  rr::Result<> write(std::ostream& out) {
    auto looked =
        messages_.for_each([this](const McapMessage&, const rr::Json& value) { add_columns(cells_of(value)); });
    if (!looked) return looked;
    if (columns_.size() > max_columns)
      return rr::make_error(rr::ErrorCode::out_of_range,
                            topic_ + " has more than " + std::to_string(max_columns) + " columns");
    out << "time";
    for (const auto& column : columns_) out << "," << csv_cell(column.empty() ? "value" : column);
    out << "\n";
    return messages_.for_each([&](const McapMessage& message, const rr::Json& value) {
      const auto cells = cells_of(value);
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

  const std::string& topic_;
  MessagePasses messages_;
  std::vector<std::string> columns_;
  std::set<std::string> known_;
};

/// A line for each message, as `rrgate watch --json` has it: {"time": ..., "value": ...}.
rr::Result<> write_json_lines(Recording& recording, const RecordedMember& member, bool shows_progress,
                              std::ostream& out) {
  MessagePasses messages(recording, member, 1, shows_progress);
  return messages.for_each([&](const McapMessage& message, const rr::Json& value) {
    auto line = rr::OrderedJson::object();
    line["time"] = mcap_time_text(message.publish_time);
    line["value"] = value;
    out << line.dump() << "\n";
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
  for (const auto& file : options.files) {
    std::error_code error;
    if (std::filesystem::equivalent(file, options.output, error))
      return usage_error("export", options.output + " is the recording itself; -o takes another file");
  }
  auto recording = Recording::open(options.files);
  if (!recording) return report_failure("export", recording.error().message);
  if (!recording->cut().empty())
    std::cerr << "rrgate export: " << recording->name() << " was cut: " << recording->cut() << "\n";
  const auto* member = find_member(*recording, options.member);
  if (!member)
    return usage_error(
        "export", recording->name() + ": " +
                      (options.member.empty() ? "more than one member" : "no one member " + rr::quote(options.member)) +
                      "; --member takes one of: " + topics_of(*recording));
  std::ofstream file;
  if (!options.output.empty()) file.open(options.output, std::ios::binary | std::ios::trunc);
  auto& out = options.output.empty() ? std::cout : static_cast<std::ostream&>(file);
  const bool shows_progress = !options.output.empty() || !::isatty(STDOUT_FILENO);
  const auto written = options.is_json ? write_json_lines(*recording, *member, shows_progress, out)
                                       : CsvExport(*recording, *member, shows_progress).write(out);
  if (!written) return report_failure("export", written.error().message);
  return out.flush() ? exit_ok : report_failure("export", options.output + ": can't be written");
}

}  // namespace

void add_export(Commands& commands) {
  const auto [app, options] = commands.add("export", "Write a member of a recording as a table", run_export);
  app.add_option("FILE", options.files, "A file of \"rrgate record\", or all files of one recording")
      ->required()
      ->option_text("...");
  auto* csv = app.add_flag("--csv", options.is_csv, "One line for each message, one column for each number");
  app.add_flag("--json", options.is_json, "One line of JSON for each message")->excludes(csv);
  app.add_option("--member", options.member, "Member, as \"rrgate info FILE\" lists it: \"/Create/state\", \"state\"")
      ->option_text("MEMBER");
  app.add_option("-o", options.output, "File to write; default: standard output")->option_text("OUT");
}

}  // namespace rrgate
