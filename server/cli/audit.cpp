// rrgate audit: reads the audit log, and checks that it is as it was written. Layer: server/cli.
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <optional>
#include <thread>

#include "server/access/audit_tail.hpp"
#include "server/access/audit_trail.hpp"
#include "server/cli/command.hpp"
#include "server/cli/printable.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

struct AuditOptions {
  std::vector<std::string> files;
  AuditFilter filter;
  bool follows = false;
  bool as_json = false;
  bool verifies = false;
};

constexpr std::chrono::milliseconds follow_period{200};

volatile std::sig_atomic_t is_audit_interrupted = 0;

void interrupt_audit(int) {
  is_audit_interrupted = 1;
}

/// "15m", "2h", "7d" ago, or a time as records have it, or its beginning. nullopt: neither.
std::optional<std::string> parse_since(const std::string& text) {
  const bool is_time = text.size() >= 4 && std::all_of(text.begin(), text.end(), [](char c) {
                         return std::string_view("0123456789-:.TZ").find(c) != std::string_view::npos;
                       });
  if (is_time || text.empty()) return text;
  const auto count = text.substr(0, text.size() - 1);
  if (count.empty() || count.size() > 6 || count.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  const auto unit = text.back();
  const auto seconds = unit == 's' ? 1 : unit == 'm' ? 60 : unit == 'h' ? 3600 : unit == 'd' ? 86'400 : 0;
  if (seconds == 0) return std::nullopt;
  return format_audit_time(std::chrono::system_clock::now() - std::chrono::seconds(std::stoll(count) * seconds));
}

std::string text_of(const rr::Json& record, const char* key) {
  const auto found = record.find(key);
  return found != record.end() && found->is_string() ? found->get<std::string>() : std::string();
}

class Reader {
 public:
  explicit Reader(const AuditOptions& options) : options_(options) {}

  /// Prints it if it is wanted. False: it is no record.
  bool take(const std::string& line) const {
    const auto record = rr::read_json(line);
    if (!record || !record->is_object()) return false;
    if (options_.filter.fits(*record)) std::cout << (options_.as_json ? line : describe(*record)) << "\n";
    return true;
  }

 private:
  /// time, outcome, event, who, from where, to what, why. JSON had control characters escaped.
  static std::string describe(const rr::Json& record) {
    const auto get = [&](const char* key) { return printable(text_of(record, key)); };
    const auto or_dash = [](std::string text) { return text.empty() ? "-" : text; };
    auto who = get("user");
    if (const auto user = get("device_user"); !user.empty()) who += (who.empty() ? "" : " ") + ("(" + user + ")");
    auto what = get("device");
    for (const auto* key : {"path", "member"})
      if (const auto part = get(key); !part.empty()) what += (what.empty() ? "" : " ") + part;
    auto out = get("time") + "  " + or_dash(get("outcome")) + "  " + get("event") + "  " + or_dash(who) + "  " +
               or_dash(get("proof")) + "  " + or_dash(get("face")) + "  " + or_dash(get("client")) + "  " +
               or_dash(what);
    if (const auto detail = get("detail"); !detail.empty()) out += "  " + detail;
    return out;
  }

  const AuditOptions& options_;
};

ino_t file_number(const std::string& file) {
  struct stat about {};
  return ::stat(file.c_str(), &about) == 0 ? about.st_ino : 0;
}

/// Goes on with what is added, also when the file is renamed and a new one begun, until a signal comes.
void follow(const std::string& file, std::ifstream in, const Reader& reader) {
  std::signal(SIGINT, interrupt_audit);
  std::signal(SIGTERM, interrupt_audit);
  auto number = file_number(file);
  std::string line;
  const auto read_rest = [&] {
    in.clear();
    for (char c = 0; in.get(c);) {
      if (c != '\n') {
        line += c;
        continue;
      }
      reader.take(line);
      line.clear();
    }
    std::cout.flush();
  };
  while (is_audit_interrupted == 0 && std::cout) {
    read_rest();
    if (const auto now = file_number(file); now != 0 && now != number) {
      read_rest();
      in = std::ifstream(file);
      number = now;
      line.clear();
      continue;
    }
    std::this_thread::sleep_for(follow_period);
  }
}

/// How many lines are no records. One that the gateway has not written to its end is none of them.
std::size_t read_audit_file(std::ifstream in, const Reader& reader) {
  std::size_t out = 0;
  for (std::string line; std::getline(in, line);)
    if (!reader.take(line) && !(in.eof() && line.starts_with('{'))) ++out;
  return out;
}

int verify(const AuditOptions& options) {
  const auto trail = verify_audit_files(options.files);
  if (!trail) {
    report_failure("audit", trail.error().message);
    return exit_unreadable;
  }
  for (const auto& each : trail->findings)
    std::cerr << each.file << (each.line > 0 ? ":" + std::to_string(each.line) : "") << ": found " << each.found
              << ", expected " << each.expected << "\n";
  if (trail->unchained > 0)
    std::cerr << trail->unchained << " lines before record 1 are of a version without a chain: nothing proves them\n";
  if (trail->records == 0)
    std::cout << "no records\n";
  else
    std::cout << trail->records << " records, " << trail->first << " to " << trail->last.seq << ", the last with hash "
              << trail->last.hash << ": "
              << (trail->findings.empty() ? "as they were written" : "NOT as they were written") << "\n";
  return trail->findings.empty() ? exit_ok : exit_failed;
}

int read_audit(const AuditOptions& given) {
  auto options = given;
  const auto since = parse_since(given.filter.since);
  if (!since)
    return usage_error("audit", "--since " + rr::quote(given.filter.since) +
                                    ": expected a time as 2030-01-31T12:00, or as 15m, 2h or 7d how long ago");
  options.filter.since = *since;
  if (options.verifies) return verify(options);
  const auto files = sort_audit_files(options.files);
  if (!files) {
    report_failure("audit", files.error().message);
    return exit_unreadable;
  }
  const Reader reader(options);
  int code = exit_ok;
  for (const auto& file : *files) {
    std::ifstream in(file);
    if (options.follows && file == files->back()) {
      follow(file, std::move(in), reader);
      break;
    }
    if (const auto strange = read_audit_file(std::move(in), reader); strange > 0) {
      std::cerr << file << ": " << strange << (strange == 1 ? " line is no record" : " lines are no records") << "\n";
      code = exit_unreadable;
    }
  }
  return code;
}

}  // namespace

void add_audit(Commands& commands) {
  const auto [app, options] = commands.add("audit", "Read and verify the audit log", read_audit);
  app.footer(
      "Exit codes: 0 done; 1 the chain is broken; 2 wrong options or arguments; 3 a file can't be read, or not all "
      "of it");
  app.add_option("FILE", options.files, "The file of the option \"audit\", and rotated files; in any order")
      ->required()
      ->option_text("...");
  auto* verifies = app.add_flag("--verify", options.verifies, "Verify the chain of all records in all files");
  const auto add_filter = [&app = app, verifies](const char* name, std::string& value, const char* summary) {
    return app.add_option(name, value, summary)->option_text("PATTERN")->excludes(verifies);
  };
  add_filter("--user", options.filter.user, "User of the gateway or of a device; '*' and '?' as in rules");
  add_filter("--device", options.filter.device, "Device");
  add_filter("--member", options.filter.member, "Member");
  add_filter("--since", options.filter.since, "Since this time: 2030-01-31T12:00 (UTC), or 15m, 2h, 7d ago")
      ->option_text("TIME");
  add_filter("--outcome", options.filter.outcome, "ok, error or refused")
      ->check(CLI::IsMember({"ok", "error", "refused"}))
      ->option_text("OUTCOME");
  add_filter("--face", options.filter.face, "native, websocket, rest, stream or json")
      ->check(CLI::IsMember({"native", "websocket", "rest", "stream", "json", "mcp"}))
      ->option_text("FACE");
  app.add_flag("--follow", options.follows, "Continue with new records, until Ctrl-C")->excludes(verifies);
  app.add_flag("--json", options.as_json, "Print the records as they are in the file")->excludes(verifies);
}

}  // namespace rrgate
