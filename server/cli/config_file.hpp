// The configuration's file: read, and read anew when it changes. Layer: server/cli.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <string>

#include "server/gateway/gateway.hpp"

namespace rrgate {

/// What every configuration needs before a gateway gets it: descriptors for its clients, a page to serve.
void complete_config(Config& config);

/// Follows the file that a gateway was configured by. A file that can't be used changes nothing, and the log says why.
class ConfigFile {
 public:
  /// All must outlive it, and it the run() of `io`.
  ConfigFile(boost::asio::io_context& io, Gateway& gateway, std::string path);

  void watch();
  void stop();
  /// Whether the gateway goes on with what the file says now.
  bool reload();

 private:
  void wait();

  Gateway& gateway_;
  std::string path_;
  std::string used_;  ///< as the file looked when it was read
  std::string seen_;  ///< as it looked last
  boost::asio::steady_timer timer_;
};

}  // namespace rrgate
