// rrgate watch: values of a wire, packets of a pipe, events, one line each. Layer: server/cli.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <ctime>
#include <functional>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/session/service_path.hpp"
#include "node/driver/clocks.hpp"
#include "node/platform/utc_time.hpp"
#include "server/cli/csv.hpp"
#include "server/cli/remote_service.hpp"
#include "server/json/arguments.hpp"

namespace rrgate {

namespace {

using std::chrono::steady_clock;

constexpr std::chrono::seconds print_limit{10};

volatile std::sig_atomic_t is_interrupted = 0;

void interrupt(int) {
  is_interrupted = 1;
}

enum class WatchForm : std::uint8_t { text, json, csv };

/// "15:00:00.000", by the clock on the wall.
std::string local_time(rr::TimeSpec time) {
  const auto seconds = static_cast<std::time_t>(time.seconds);
  std::tm parts{};
  ::localtime_r(&seconds, &parts);
  char text[40];
  const auto size = std::strftime(text, sizeof(text), "%H:%M:%S", &parts);
  char fraction[8];
  std::snprintf(fraction, sizeof(fraction), ".%03d", static_cast<int>(time.nanoseconds / 1'000'000));
  return std::string(text, size) + fraction;
}

/// In s; negative where the device's clock is ahead of this machine's.
double age_of(rr::TimeSpec then, rr::TimeSpec now) {
  return static_cast<double>(now.seconds - then.seconds) + 1e-9 * (now.nanoseconds - then.nanoseconds);
}

std::string age_text(double age) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.6f", age);
  return text;
}

/// How many rows wait for a value that tells which columns the table has.
constexpr std::size_t max_waiting_rows = 1000;

/// A table with a column for each number of the first value that has any, named by its place: "/position/0".
class CsvTable {
 public:
  /// `times`  first cells of the row, whose columns are called `time_names`.
  void print(const rr::Json& value, const std::string& time_names, const std::string& times) {
    const auto cells = value.flatten();
    std::ptrdiff_t left = std::count_if(cells.begin(), cells.end(), [](const auto& cell) { return !cell.is_null(); });
    if (columns_.empty()) {
      time_names_ = time_names;
      // Of an empty list, or null: the next one may have numbers.
      if (left == 0 && may_have_numbers_ && waiting_.size() < max_waiting_rows) return waiting_.push_back(times);
      begin(cells);
    }
    std::cout << times;
    for (const auto& column : columns_) {
      const auto cell = cells.find(column);
      std::cout << ",";
      if (cell == cells.end() || cell->is_null()) continue;
      std::cout << csv_cell(*cell);
      --left;
    }
    std::cout << std::endl;
    without_column_ += static_cast<std::uint64_t>(left);
  }
  /// Each row is shown as it comes.
  void expect_no_numbers() { may_have_numbers_ = false; }
  void end() {
    if (columns_.empty() && !waiting_.empty()) begin(rr::Json(nullptr).flatten());
    if (without_column_ > 0) std::cerr << "numbers without a column: " << without_column_ << "; --json has all\n";
  }

 private:
  void begin(const rr::Json& cells) {
    std::cout << time_names_;
    for (const auto& [place, cell] : cells.items()) {
      columns_.push_back(place);
      std::cout << "," << csv_cell(place.empty() ? "value" : place);
    }
    std::cout << "\n";
    for (const auto& times : std::exchange(waiting_, {}))
      std::cout << times << std::string(columns_.size(), ',') << "\n";
    std::cout << std::flush;
  }

  bool may_have_numbers_ = true;
  std::string time_names_;
  std::vector<std::string> columns_;
  std::vector<std::string> waiting_;  ///< rows without a number, before the columns are known
  std::uint64_t without_column_ = 0;  ///< numbers of longer values
};

/// Prints what comes, and counts it. Values of wires have the time at which the device sent them, and their age.
class ValuePrinter {
 public:
  ValuePrinter(WatchForm form, std::uint64_t limit) : form_(form), limit_(limit) {}

  void print(const rr::OrderedJson& value, std::optional<rr::TimeSpec> sent = std::nullopt) {
    if (is_done()) return;
    ++count_;
    const auto now = rr::read_clocks().utc;
    if (form_ == WatchForm::csv) return print_csv(value, now, sent);
    if (form_ == WatchForm::text) {
      std::cout << local_time(now);
      if (sent) std::cout << "  sent " << local_time(*sent) << ", age " << age_text(age_of(*sent, now)) << " s";
      std::cout << "  " << text_for_output(rr::write_json(value)) << std::endl;
      return;
    }
    auto line = rr::OrderedJson::object();
    line["time"] = rr::format_utc(now, 3);
    if (sent) {
      line["device_time"] = rr::format_utc(*sent, 3);
      line["age"] = std::round(age_of(*sent, now) * 1e6) / 1e6;
    }
    line["value"] = value;
    std::cout << rr::write_json(line) << std::endl;
  }
  void expect_no_numbers() { table_.expect_no_numbers(); }
  /// Nothing comes any more.
  void end() { table_.end(); }
  std::uint64_t count() const { return count_; }
  bool is_done() const { return limit_ != 0 && count_ >= limit_; }

 private:
  void print_csv(const rr::OrderedJson& value, rr::TimeSpec now, std::optional<rr::TimeSpec> sent) {
    auto times = rr::format_utc(now, 3);
    if (sent) times += "," + rr::format_utc(*sent, 3) + "," + age_text(age_of(*sent, now));
    table_.print(rr::Json::parse(rr::write_json(value)), sent ? "time,device_time,age" : "time", times);
  }

  WatchForm form_;
  std::uint64_t limit_;
  std::uint64_t count_ = 0;
  CsvTable table_;
};

/// Returns  whether the service still has open what is watched.
std::function<bool()> begin_watching(const RemoteMember& found, ValuePrinter& printer) {
  using enum rr::MemberKind;
  expect_kind(found, {wire, pipe, event}, "watch");
  const auto& member = *found.member;
  if (member.direction() == rr::MemberDirection::writeonly)
    throw NotUnderstood(std::string(rr::member_kind_name(member.kind)) + " " + rr::quote(member.name) +
                        " is writeonly: the device sends nothing");
  const auto json_of = [&member, types = &found.types()](const rr::Value& value) {
    return to_json(value, member.type, *types);
  };
  const auto is_closed = std::make_shared<bool>(false);
  auto& connection = found.object.connection().asynchronous();
  if (member.kind == wire) {
    // First: the service may close the wire right behind its answer.
    connection.on_wire_closed(found.object.path(), member.name, [is_closed] { *is_closed = true; });
    found.object.connect_wire(member.name, [&printer, json_of](const rr::Value& value, rr::TimeSpec sent) {
      printer.print(json_of(value), sent);
    });
  } else if (member.kind == pipe) {
    const auto packets = found.object.connect_pipe(
        member.name, [&printer, json_of](const rr::Value& value) { printer.print(json_of(value)); });
    return [packets] { return packets.is_open(); };
  } else {
    connection.on_path_released([is_closed, path = found.object.path()](const std::string& released) {
      if (rr::is_within(path, released)) *is_closed = true;
    });
    if (member.parameters.empty()) printer.expect_no_numbers();
    found.object.on_event(member.name, [&printer, &member, types = &found.types()](std::span<const rr::Value> values) {
      const auto json = rr::arguments_to_json(values, member, *types, {});
      if (!json) throw rr::ClientException(json.error());
      printer.print(*json);
    });
  }
  return [is_closed] { return !*is_closed; };
}

void watch(const RemoteMember& found, ValuePrinter& printer, std::optional<steady_clock::time_point> until) {
  auto& connection = found.object.connection();
  const auto begin = steady_clock::now();
  const auto end = std::make_shared<std::string>("the connection was lost");
  connection.asynchronous().on_closed([end](const rr::Error& reason) { *end += ": " + reason.message; });
  const auto is_open = begin_watching(found, printer);
  is_interrupted = 0;
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  const auto is_over = [&] {
    return is_interrupted || printer.is_done() || connection.is_closed() || !is_open() || !std::cout ||
           (until && steady_clock::now() >= *until);
  };
  while (!is_over()) connection.run_until(is_over, std::chrono::milliseconds(100));
  if (!is_open() || connection.is_closed())
    connection.run_until([] { return true; }, print_limit);  // what came before the end
  printer.end();
  const std::chrono::duration<double> seconds = steady_clock::now() - begin;
  std::cerr << printer.count() << " values in " << std::fixed << std::setprecision(1) << seconds.count() << " s, "
            << static_cast<double>(printer.count()) / seconds.count() << " /s\n";
  if (is_open() && !connection.is_closed()) return;
  if (!connection.is_closed()) *end = "the service has closed it";
  if (!printer.is_done()) throw rr::ClientException(rr::make_error(rr::ErrorCode::connection_error, *end));
}

struct WatchOptions : RemoteOptions {
  std::string member;
  bool is_csv = false;
  std::uint32_t count = 0;    ///< 0: without end
  std::uint32_t seconds = 0;  ///< the same
};

int run_watch(const WatchOptions& options) {
  return run_remote("watch", options.url, [&] {
    auto form = options.is_json ? WatchForm::json : WatchForm::text;
    if (options.is_csv) form = WatchForm::csv;
    ValuePrinter printer(form, options.count);
    const auto found = find_member(open_service(remote_address(options)), options.member);
    std::optional<steady_clock::time_point> until;
    if (options.seconds != 0) until = steady_clock::now() + std::chrono::seconds(options.seconds);
    watch(found, printer, until);
  });
}

}  // namespace

void add_watch(Commands& commands) {
  const auto [app, options] = commands.add("watch", "Print values of a wire, packets of a pipe, events", run_watch);
  add_url(app, options)->required();
  app.add_option("MEMBER", options.member, "\"position\", or through objrefs \"axes/0/position\"")
      ->required()
      ->option_text(" ");
  add_count(app, "--count", options.count, "Stop after this number of values");
  add_count(app, "--for", options.seconds, "Stop after this number of seconds");
  auto* json = add_json(app, options);
  app.add_flag("--csv", options.is_csv, "One line for each value, one column for each number")->excludes(json);
  add_connection_options(app, options);
}

}  // namespace rrgate
