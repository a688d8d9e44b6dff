// A gateway inside a program of somebody else's. Layer: server/gateway (the public C++ gateway API).
//
//   rr::EmbeddedGateway gateway(R"({"listen": ["127.0.0.1:8080"], "devices": []})");
//   std::thread serving([&] { gateway.run(); });
//   ...
//   gateway.stop();
//   serving.join();
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace rr {

/// What `rrgate serve` runs, on one thread of the program. Unlike that, it follows no configuration file, minds no
/// signals, leaves the limit of file descriptors as it is, and has no dashboard unless "web_root" names one. Its log
/// goes to stderr, as "log" says; that is for all gateways of a process.
class EmbeddedGateway {
 public:
  /// Listens from here on; who connects is served while run() runs.
  /// `config`   JSON, comments allowed, as gateway.schema.json describes it
  /// `folder`   that relative paths in it count from; empty: the current one
  /// Throws     std::invalid_argument with a line for each mistake ("/devices/2/url: scheme ..."); std::runtime_error
  ///            where an address can't be listened on, or a file of certificates or users can't be used.
  explicit EmbeddedGateway(std::string_view config, const std::filesystem::path& folder = {});
  EmbeddedGateway(const EmbeddedGateway&) = delete;
  EmbeddedGateway& operator=(const EmbeddedGateway&) = delete;
  /// run() has returned, or was never called: then what is left ends at once.
  ~EmbeddedGateway();

  /// Where it listens, with the true ports: "127.0.0.1:8080", "[::1]:8080".
  const std::vector<std::string>& addresses() const;

  /// Serves until stop(). Once.
  void run();
  /// From any thread. Sessions have "timeouts"."drain_ms" to end by themselves; a second call ends them at once.
  void stop();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace rr
