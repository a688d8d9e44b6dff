// Recordings that the gateway makes: list, begin, stop, download, play, delete. Layer: server/http/endpoints. See
// docs/recording.md.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

Handler recordings_endpoint(GatewayState& gateway);
Handler begin_recording_endpoint(GatewayState& gateway);
/// Of a recording, by its name; or one of its files.
Handler recording_endpoint(GatewayState& gateway);
/// To stop a recording, or to play it or one of its files.
Handler recording_action_endpoint(GatewayState& gateway);
/// Of a recording; or of what plays it.
Handler delete_recording_endpoint(GatewayState& gateway);

}  // namespace rrgate
