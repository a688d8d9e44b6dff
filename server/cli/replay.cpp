// rrgate replay: a recording as devices. Layer: server/cli.
#include "server/record/replay.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "server/cli/command.hpp"

namespace rrgate {

namespace {

struct ReplayCommandOptions {
  std::vector<std::string> files;
  std::string listen = "rr+tcp://127.0.0.1:0";
  double speed = 1;
  double start = 0;
  bool loops = false;
  bool is_paused = false;
  bool keeps_ids = false;
  bool is_json = false;
};

void serve(Replay& replay, boost::asio::io_context& io, const ReplayCommandOptions& options) {
  auto& player = replay.player();
  player.set_speed(options.speed);
  player.set_loops(options.loops);
  player.seek(options.start);
  if (!options.is_paused) player.play();
  for (const auto& url : replay.urls()) {
    if (options.is_json)
      print_json_line({{"url", url}});
    else
      std::cout << "rrgate replay: " << url << std::endl;
  }
  bool is_over = false;
  boost::asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&is_over](const auto& error, int) {
    if (!error) is_over = true;
  });
  while (!is_over) io.run_one();
  replay.stop();
  io.run_for(std::chrono::milliseconds(500));
}

int run_replay(const ReplayCommandOptions& options) {
  auto recording = Recording::open(options.files);
  if (!recording) return report_failure("replay", recording.error().message);
  if (!recording->cut().empty())
    std::cerr << "rrgate replay: " << recording->name() << " was cut: " << recording->cut()
              << "; all before that is played\n";
  ReplayOptions how;
  how.listen = options.listen;
  how.keeps_ids = options.keeps_ids;
  how.report = [](const std::string& problem) { std::cerr << "rrgate replay: " << problem << "\n"; };
  try {
    boost::asio::io_context io(1);
    Replay replay(io, std::move(*recording), how);
    serve(replay, io, options);
    return exit_ok;
  } catch (const std::exception& failure) {
    return report_failure("replay", failure.what());
  }
}

}  // namespace

void add_replay(Commands& commands) {
  const auto [app, options] =
      commands.add("replay", "Serve a recording as if it were the recorded devices", run_replay);
  app.add_option("FILE", options.files, "A file of \"rrgate record\", or all files of one recording")
      ->required()
      ->option_text("...");
  app.add_option("--speed", options.speed, "Speed as a factor: 2 is twice as fast")
      ->check(CLI::Range(Player::min_speed, Player::max_speed))
      ->option_text("N [1]");
  app.add_option("--start", options.start, "Start at this time after the first message")
      ->check(CLI::Range(0.0, 1e10))
      ->option_text("SECONDS [0]");
  app.add_flag("--loop", options.loops, "Start again after the last message");
  app.add_flag("--paused", options.is_paused, "Wait until a client of the service \"replay\" calls play");
  app.add_option("--listen", options.listen, "Address of the first node; others use the next ports")
      ->option_text("URL [rr+tcp://127.0.0.1:0]");
  app.add_flag("--keep-ids", options.keeps_ids, "Use the recorded NodeIDs; the recorded nodes must not run");
  app.add_flag("--json", options.is_json, "Print each URL as one line of JSON");
}

}  // namespace rrgate
