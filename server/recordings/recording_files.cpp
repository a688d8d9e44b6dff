#include "server/recordings/recording_files.hpp"

#include <algorithm>
#include <filesystem>

#include "node/platform/utc_time.hpp"
#include "server/access/replay_name.hpp"
#include "server/json/json.hpp"
#include "server/record/recording.hpp"

namespace rrgate {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view extension = ".mcap";

/// "20261125T083000123Z"
std::string name_of_time(std::chrono::system_clock::time_point time) {
  auto text = rr::format_utc(rr::to_time_spec(time), 3);
  std::erase_if(text, [](char c) { return c == '-' || c == ':' || c == '.'; });
  return text;
}

/// The other way; nullopt: it is no such text.
std::optional<std::chrono::system_clock::time_point> time_of_name(std::string_view text) {
  constexpr std::string_view form = "00000000T000000000Z";
  if (text.size() != form.size()) return std::nullopt;
  for (std::size_t i = 0; i < form.size(); ++i)
    if (form[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != form[i]) return std::nullopt;
  const auto number = [text](std::size_t at, std::size_t size) {
    int out = 0;
    for (const char c : text.substr(at, size)) out = out * 10 + (c - '0');
    return out;
  };
  const std::chrono::year_month_day date{std::chrono::year(number(0, 4)),
                                         std::chrono::month(static_cast<unsigned>(number(4, 2))),
                                         std::chrono::day(static_cast<unsigned>(number(6, 2)))};
  if (!date.ok()) return std::nullopt;
  return std::chrono::sys_days(date) + std::chrono::hours(number(9, 2)) + std::chrono::minutes(number(11, 2)) +
         std::chrono::seconds(number(13, 2)) + std::chrono::milliseconds(number(15, 3));
}

}  // namespace

std::string format_recording_name(const RecordingName& name) {
  return name.device + "." + name.service + "." + name_of_time(name.begin);
}

std::optional<RecordingName> parse_recording_name(std::string_view name) {
  const auto said = split_recording_name(name);
  const auto begin = said ? time_of_name(said->begin) : std::nullopt;
  if (!begin || said->device.empty() || said->service.empty()) return std::nullopt;
  return RecordingName{std::string(said->device), std::string(said->service), *begin};
}

std::string first_file_of(std::string_view recording) {
  return std::string(recording) + std::string(extension);
}

namespace {

/// "NAME.mcap" is the first file, "NAME-2.mcap" the second. 0: it is none of these.
std::uint32_t number_of_file(std::string_view file, std::string& name) {
  if (!file.ends_with(extension)) return 0;
  file.remove_suffix(extension.size());
  name = file;
  if (parse_recording_name(name)) return 1;
  const auto dash = file.rfind('-');
  if (dash == std::string_view::npos) return 0;
  name = file.substr(0, dash);
  std::uint32_t number = 0;
  for (const char c : file.substr(dash + 1)) {
    if (c < '0' || c > '9' || number > 100'000'000) return 0;
    number = number * 10 + static_cast<std::uint32_t>(c - '0');
  }
  return number;
}

struct NumberedFile {
  std::uint32_t number = 0;
  RecordingFile file;
};

/// nullopt: it can't be read, or is no file.
std::optional<RecordingFile> look_at(const fs::directory_entry& entry, std::string name) {
  std::error_code error;
  if (!entry.is_regular_file(error) || entry.is_symlink(error)) return std::nullopt;
  RecordingFile out;
  out.name = std::move(name);
  out.bytes = entry.file_size(error);
  if (error) return std::nullopt;
  out.written = std::chrono::file_clock::to_sys(entry.last_write_time(error));
  if (error) return std::nullopt;
  return out;
}

}  // namespace

std::string recording_of_file(std::string_view file) {
  std::string name;
  return number_of_file(file, name) > 0 && parse_recording_name(name) ? name : std::string();
}

std::string replay_of(std::string_view recording) {
  return replay_name(recording);
}

std::string replay_of_file(std::string_view file) {
  std::string name;
  const auto number = number_of_file(file, name);
  return number > 0 ? replay_name(name + "-" + std::to_string(number)) : std::string();
}

std::string recording_of_replay(std::string_view device) {
  return is_replay(device) ? recording_of_file(first_file_of(device.substr(replay_prefix.size()))) : std::string();
}

RecordingFiles look_into(const std::string& folder, std::string_view recording) {
  std::map<std::string, std::vector<NumberedFile>, std::less<>> found;
  std::error_code error;
  RecordingFiles out;
  if (folder.empty()) return out;
  for (auto it = fs::directory_iterator(folder, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    auto file = it->path().filename().string();
    std::string name;
    const auto number = number_of_file(file, name);
    if (number == 0 || (!recording.empty() && name != recording) || !parse_recording_name(name)) continue;
    if (auto seen = look_at(*it, std::move(file))) found[name].push_back({number, std::move(*seen)});
  }
  for (auto& [name, files] : found) {
    std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
    auto& list = out[name];
    for (auto& each : files) list.push_back(std::move(each.file));
  }
  return out;
}

std::string ring_of(const RecordingWish& standing) {
  return standing.kept_files == 0 ? std::string() : rr::write_json(standing.members);
}

std::deque<std::string> find_ring(const std::string& folder, const RecordingWish& wish,
                                  const std::vector<RecordingWish>& standing, const std::set<std::string>& under_way) {
  std::deque<std::string> out;
  const auto own = ring_of(wish);
  if (own.empty()) return out;
  const auto is_of_another = [&](const std::string& ring) {
    return std::any_of(standing.begin(), standing.end(), [&](const RecordingWish& other) {
      return other.device == wish.device && other.service == wish.service && ring_of(other) == ring;
    });
  };
  for (const auto& [name, files] : look_into(folder, {})) {  // of one service in the order of time
    const auto said = parse_recording_name(name);
    if (said->device != wish.device || said->service != wish.service || under_way.contains(name)) continue;
    for (const auto& file : files) {
      auto path = (fs::path(folder) / file.name).string();
      const auto ring = recorded_ring(path);
      if (ring != own && (ring.empty() || is_of_another(ring))) continue;
      std::error_code ignored;
      if (has_recorded_messages(path))
        out.push_back(std::move(path));
      else
        fs::remove(path, ignored);
    }
  }
  return out;
}

}  // namespace rrgate
