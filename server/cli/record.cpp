// rrgate record: what happens at services, into a file. Layer: server/cli.
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <utility>

#include "server/cli/ls.hpp"
#include "server/cli/progress.hpp"
#include "server/cli/remote_service.hpp"
#include "server/config/version.hpp"
#include "server/record/recorder.hpp"

namespace rrgate {

namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using std::chrono::steady_clock;

struct RecordOptions : RemoteOptions {
  std::vector<std::string> urls;
  std::string type;
  std::string output;
  std::vector<std::string> members = {"*"};
  double interval = 1;           ///< in s
  double duration = 0;           ///< in s; 0: until Ctrl-C
  double max_size = 0;           ///< in MB; 0: no limit
  std::uint32_t kept_files = 0;  ///< 0: all
  bool replaces = false;
};

[[noreturn]] void throw_failure(const rr::Error& error) {
  if (error.code == rr::ErrorCode::invalid_argument) throw NotUnderstood(error.message);            // of --members
  if (error.code == rr::ErrorCode::system_resource_error) throw std::runtime_error(error.message);  // of the file
  throw rr::ClientException(error);
}

/// Services as the command line names them: by themselves, as all of a gateway's device, or by their type.
std::vector<std::string> find_services(const RecordOptions& options) {
  if (options.urls.empty() && options.type.empty()) throw NotUnderstood("expected URLs, or --type");
  const auto find_at = [&](const std::string& url) {
    auto where = static_cast<RemoteOptions>(options);
    where.url = url;
    auto found = list_service_urls(where, options.type);
    if (found.empty())
      throw rr::ClientException(rr::make_error(rr::ErrorCode::service_not_found,
                                               (url.empty() ? "around here" : url) + ": no service" +
                                                   (options.type.empty() ? "" : " of type " + options.type)));
    return found;
  };
  if (options.urls.empty()) return find_at({});
  std::vector<std::string> out;
  for (const auto& written : options.urls) {
    const auto url = address_of_page(written);
    if (url.find("#/devices/") != std::string::npos)
      throw NotUnderstood(rr::quote(url) + " is the page of an object; expected that of its service or its device");
    const bool is_device = url.starts_with("http") && url.find("service=") == std::string::npos;
    const auto found = options.type.empty() && !is_device ? std::vector{url} : find_at(url);
    out.insert(out.end(), found.begin(), found.end());
  }
  return out;
}

/// Records until its time is over, somebody ends it, or the file can't be written.
class RecordRun {
 public:
  RecordRun(const RecordOptions& options, RecordingWriter& writer)
      : options_(options),
        writer_(writer),
        progress_("recording", static_cast<std::uint64_t>(options.duration * 1000)),
        signals_(io_, SIGINT, SIGTERM),
        timer_(io_) {}

  void run() {
    start_recorders();
    signals_.async_wait([this](const auto& error, int) {
      if (!error) is_over_ = true;
    });
    tick();
    while (!is_over_) io_.run_one();
    for (const auto& recorder : recorders_) recorder->close();
    timer_.cancel();
    signals_.cancel();
    io_.restart();
    io_.run_for(std::chrono::milliseconds(500));
    if (const auto closed = writer_.close(); !closed && !failure_) failure_ = closed.error();
    if (failure_) throw_failure(*failure_);
  }
  double seconds() const { return begin_ ? std::chrono::duration<double>(steady_clock::now() - *begin_).count() : 0; }

 private:
  void start_recorders() {
    RecordListener listener;
    listener.begun = [this](const rr::Result<>& outcome) {
      if (!outcome) return fail(outcome.error());
      if (++begun_ != recorders_.size()) return;
      begin_ = steady_clock::now();
      tell_least_size();
    };
    listener.problem = [](const std::string& problem) { std::cerr << "rrgate record: " << problem << "\n"; };
    listener.failed = [this](const rr::Error& error) { fail(error); };
    const RecorderOptions how{options_.members,
                              std::chrono::milliseconds(static_cast<std::int64_t>(options_.interval * 1000))};
    for (const auto& url : find_services(options_)) {
      auto remote = static_cast<RemoteOptions>(options_);
      remote.url = url;
      const auto address = remote_address(remote);
      if (const auto parsed = rr::parse_url(address.url); !parsed)
        throw NotUnderstood(parsed.error().message + "; rrgate ls lists services");
      recorders_.push_back(std::make_shared<Recorder>(io_, writer_, address.url, how, listener));
      recorders_.back()->start(address.options);
    }
  }
  void tell_least_size() const {
    const auto least = static_cast<double>(writer_.least_file_bytes()) / 1e6;
    if (options_.max_size == 0 || options_.max_size >= least) return;
    std::cerr << "rrgate record: --max-size " << options_.max_size << ": files become " << std::fixed
              << std::setprecision(3) << least
              << " MB large, as the definitions and schemas alone, which each of them has, take most of that\n"
              << std::defaultfloat;
  }
  void fail(const rr::Error& error) {
    if (!failure_) failure_ = error;
    is_over_ = true;
  }
  /// What waits for its chunk reaches the file, so that a process that is killed loses a second at most.
  void tick() {
    if (const auto flushed = writer_.flush(); !flushed) return fail(flushed.error());
    progress_.show(options_.duration == 0 ? writer_.size() : static_cast<std::uint64_t>(seconds() * 1000));
    const std::chrono::duration<double> left(options_.duration - seconds());
    if (begin_ && options_.duration != 0 && left.count() <= 0) {
      is_over_ = true;
      return;
    }
    auto period = std::chrono::duration<double>(begin_ ? 1.0 : 0.1);
    if (begin_ && options_.duration != 0) period = std::min(period, left);
    timer_.expires_after(std::chrono::duration_cast<std::chrono::nanoseconds>(period));
    timer_.async_wait([this](const auto& error) {
      if (!error) tick();
    });
  }

  const RecordOptions& options_;
  RecordingWriter& writer_;
  Progress progress_;
  asio::io_context io_{1};
  asio::signal_set signals_;
  asio::steady_timer timer_;
  std::vector<std::shared_ptr<Recorder>> recorders_;
  std::size_t begun_ = 0;
  std::optional<steady_clock::time_point> begin_;  ///< once all are recorded
  std::optional<rr::Error> failure_;
  bool is_over_ = false;
};

std::string summary(const RecordingWriter& writer, double seconds) {
  std::ostringstream out;
  out << writer.message_count() << " messages of " << writer.topics().size() << " members in " << std::fixed
      << std::setprecision(1) << seconds << " s, " << static_cast<double>(writer.size()) / 1e6 << " MB";
  return out.str();
}

/// What is to be replaced is kept aside until there is something to replace it with; else it comes back.
class FormerFile {
 public:
  explicit FormerFile(const std::string& path) : path_(path), aside_(path + ".before") {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return;
    if (fs::exists(fs::symlink_status(aside_, error)))
      throw NotUnderstood(aside_ +
                          " is there: what an interrupted recording was to replace, or another file; move it away");
    fs::rename(path, aside_, error);
    if (error) throw std::runtime_error(path + ": can't be kept as " + aside_ + ": " + error.message());
    is_aside_ = true;
  }
  FormerFile(const FormerFile&) = delete;
  FormerFile& operator=(const FormerFile&) = delete;
  ~FormerFile() {
    std::error_code ignored;
    if (is_aside_) fs::rename(aside_, path_, ignored);
  }
  void drop() {
    std::error_code ignored;
    if (std::exchange(is_aside_, false)) fs::remove(aside_, ignored);
  }

 private:
  std::string path_;
  std::string aside_;
  bool is_aside_ = false;
};

int run_record(const RecordOptions& options) {
  const auto place = options.urls.size() == 1 ? options.urls.front() : options.output;
  return run_remote("record", place, [&] {
    std::error_code error;
    if (!options.replaces && fs::exists(options.output, error))
      throw NotUnderstood(options.output + " is there already; --force replaces it");
    RecordingOptions how;
    how.max_bytes = static_cast<std::uint64_t>(options.max_size * 1e6);
    how.kept_files = options.kept_files;
    how.replaces = options.replaces;
    how.library = "rrgate " + std::string(version);
    FormerFile former(options.output);
    auto writer = RecordingWriter::create(options.output, how);
    if (!writer) throw_failure(writer.error());
    RecordRun run(options, *writer);
    try {
      run.run();
    } catch (const std::exception&) {
      if (writer->message_count() > 0)
        former.drop();
      else if (fs::is_regular_file(options.output, error))
        fs::remove(options.output, error);
      throw;
    }
    former.drop();
    if (options.is_json)
      print_json_line({{"file", options.output},
                       {"messages", writer->message_count()},
                       {"members", writer->topics().size()},
                       {"seconds", run.seconds()},
                       {"bytes", writer->size()}});
    else
      std::cerr << summary(*writer, run.seconds()) << "\n";
  });
}

CLI::Option* add_positive(CLI::App& app, const std::string& name, double& number, const std::string& summary,
                          const std::string& unit) {
  return app.add_option(name, number, summary)
      ->check([](const std::string& text) {
        double found = 0;
        const bool is_good = CLI::detail::lexical_cast(text, found) && found > 0 && found <= 1e9;
        return is_good ? std::string() : "found " + rr::quote(text) + ", expected a number above 0";
      })
      ->option_text(unit);
}

}  // namespace

void add_record(Commands& commands) {
  const auto [app, options] = commands.add("record", "Record the data of services", run_record);
  takes_websocket_url(
      app.add_option(
          "URL", options.urls,
          "Services, as \"rrgate ls\" prints them, or a gateway's http(s)://HOST:PORT/devices/NAME for a whole device"))
      ->option_text("...");
  app.add_option("--type", options.type,
                 "Record the services of this type, or that implement it, of the URLs' nodes and gateways; without "
                 "URLs, of all nodes that are found")
      ->option_text("TYPE");
  app.add_option("-o", options.output, "MCAP file to write")->required()->option_text("FILE");
  app.add_option("--members", options.members, "Paths of members, with commas between: \"state,axes/0/*\"")
      ->delimiter(',')
      ->option_text("MEMBERS [*]");
  add_positive(app, "--interval", options.interval, "Time between two reads of a property", "SECONDS [1]");
  add_positive(app, "--duration", options.duration, "Stop after this time", "SECONDS");
  add_positive(app, "--max-size", options.max_size, "Size at which the next file begins: FILE-2, FILE-3, ...", "MB");
  add_count(app, "--keep", options.kept_files, "Number of files to keep; older ones are deleted")->needs("--max-size");
  app.add_flag("--force", options.replaces, "Overwrite existing files");
  app.add_flag("--json", options.is_json, "Print what was recorded as one line of JSON");
  add_connection_options(app, options);
}

}  // namespace rrgate
