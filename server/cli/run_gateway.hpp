// Runs a gateway until it is told to stop. Layer: server/cli.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/gateway/gateway.hpp"

namespace rrgate {

/// Called once the listeners are open; the gateway is not yet serving.
using OnStarted = std::function<void(boost::asio::io_context&, Gateway&, const std::vector<rr::HostPort>& addresses)>;

/// Serves until SIGTERM or SIGINT, then drains; a second signal ends what is left at once. SIGHUP reads `config_file`,
/// where there is one, and certificates anew; the file is followed besides. Returns an exit code.
int run_gateway(Config config, const OnStarted& on_started, const std::string& config_file = {});

/// The dashboard that belongs to this program: beside an installed program (../share/rrgate/web) or in the source tree
/// of a built one (web/dist). Empty when there is none.
std::string find_web_root();

/// Folder of the running program.
std::string program_folder();

}  // namespace rrgate
