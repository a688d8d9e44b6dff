#include "server/config/recording_options.hpp"

#include "server/config/object_reader.hpp"

namespace rrgate {

namespace {

constexpr std::int64_t longest_interval_ms = 3'600'000;

void read_wish(ObjectReader& in, RecordingWish& wish) {
  const auto name = [](std::string& target) {
    return [&target](const std::string& text) -> std::string {
      target = text;
      return text.empty() ? "empty; expected a name" : "";
    };
  };
  in.required_text("device", name(wish.device));
  in.required_text("service", name(wish.service));
  std::vector<std::string> members;
  in.texts("members", false, [&](const std::string& text) -> std::string {
    members.push_back(text);
    return text.empty() ? "empty; expected a path as \"state\" or \"axes/0/*\"" : "";
  });
  if (!members.empty()) wish.members = std::move(members);
  in.duration("interval_ms", wish.interval, {10, longest_interval_ms});
  in.size("max_file_bytes", wish.max_file_bytes, {0, 1'000'000'000'000});
  in.size("kept_files", wish.kept_files, {0, 1'000'000});
  if (wish.kept_files > 0 && wish.max_file_bytes == 0)
    in.finding("kept_files", "there is one file; expected max_file_bytes beside it");
}

}  // namespace

void read_recordings(ObjectReader& in, RecordingsConfig& recordings) {
  in.required_text("folder", [&](const std::string& text) -> std::string {
    recordings.folder = text;
    return text.empty() ? "empty; expected a folder that the gateway may write" : "";
  });
  in.size("max_bytes", recordings.max_bytes, {1'000'000, 1'000'000'000'000'000});
  in.size("at_once", recordings.at_once, {0, 1000});
  in.objects("record", false, [&](ObjectReader& item) { read_wish(item, recordings.standing.emplace_back()); });
}

}  // namespace rrgate
