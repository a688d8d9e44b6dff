"""Who talks to whom: the directions of the interoperability tests."""
import sys
from dataclasses import dataclass

from processes import BUILD, ROOT

PEERS = ROOT / "test" / "interop" / "peers"

# What the two sides agree on; the service decides, clients offer everything.
LEVELS = {
    "v2": ["--robotraconteur-disable-message4=true"],
    "v4": ["--robotraconteur-disable-stringtable=true"],
    "v4+table": ["--robotraconteur-disable-stringtable=false"],
}


@dataclass(frozen=True)
class Direction:
    name: str
    client: str  # reference, ours, node, chromium
    route: str  # direct, direct-ws, local, gateway-tcp, gateway-ws, gateway-ws-local (which reaches the device by rr+local),
    # gateway-shared-tcp, gateway-shared-ws (all clients in one session with the device)
    service: str  # reference, ours
    level: str  # of LEVELS; over all directions of two sides each of them has its turn
    scenarios: tuple = ()  # those that run, if not all that both sides know

    @property
    def schemes(self):
        """Those of the client and, through the gateway, of the device."""
        return {"direct": ["rr+tcp"], "direct-ws": ["rr+ws"], "local": ["rr+local"], "gateway-tcp": ["rr+tcp", "rr+tcp"],
                "gateway-ws": ["rr+ws", "rr+tcp"], "gateway-ws-local": ["rr+ws", "rr+local"],
                "gateway-shared-tcp": ["rr+tcp", "rr+tcp"], "gateway-shared-ws": ["rr+ws", "rr+tcp"]}[self.route]

    @property
    def is_shared(self):
        return self.route.startswith("gateway-shared")

    @property
    def speaks_javascript(self):
        return self.client in ("node", "chromium")

    def knows(self, scenario):
        """Whether the scenario is one of this direction: both sides can do what it asks."""
        language = "javascript" if self.speaks_javascript else self.client
        return language in scenario.clients and self.service in scenario.services and scenario.name in (self.scenarios or [scenario.name])


# The first shows that scenarios and peers are right: the reference talks to itself. A relay reads none of the bytes that pass:
# what could go wrong there depends on their number and their way, not on their meaning.
SMOKE = ("functions",)
RELAYED = ("functions", "large_arrays", "events", "wires", "pipes")
DIRECTIONS = [
    Direction("reference-to-reference", "reference", "direct", "reference", "v4", SMOKE),
    Direction("reference-to-ours", "reference", "direct", "ours", "v4+table"),
    Direction("ours-to-reference", "ours", "direct", "reference", "v4+table"),
    Direction("ours-to-ours", "ours", "direct", "ours", "v4+table"),
    Direction("reference-ws-ours", "reference", "direct-ws", "ours", "v4"),
    Direction("ours-ws-reference", "ours", "direct-ws", "reference", "v4"),
    Direction("ours-ws-ours", "ours", "direct-ws", "ours", "v4"),
    Direction("reference-local-ours", "reference", "local", "ours", "v2"),
    Direction("ours-local-reference", "ours", "local", "reference", "v2"),
    Direction("ours-local-ours", "ours", "local", "ours", "v2"),
    Direction("node-to-reference", "node", "direct-ws", "reference", "v2"),
    Direction("node-to-ours", "node", "direct-ws", "ours", "v2"),
    Direction("chromium-to-reference", "chromium", "direct-ws", "reference", "v4"),
    Direction("chromium-to-ours", "chromium", "direct-ws", "ours", "v4+table"),
    Direction("reference-gateway-tcp-reference", "reference", "gateway-tcp", "reference", "v2", RELAYED),
    Direction("reference-gateway-ws-reference", "reference", "gateway-ws", "reference", "v4+table", RELAYED),
    Direction("reference-gateway-tcp-ours", "reference", "gateway-tcp", "ours", "v4", RELAYED),
    Direction("ours-gateway-tcp-reference", "ours", "gateway-tcp", "reference", "v4+table", RELAYED),
    Direction("ours-gateway-ws-reference", "ours", "gateway-ws", "reference", "v4", RELAYED),
    Direction("ours-gateway-local-reference", "ours", "gateway-ws-local", "reference", "v4", RELAYED),
    Direction("node-gateway-ws-reference", "node", "gateway-ws", "reference", "v4+table", RELAYED),
    Direction("node-gateway-ws-ours", "node", "gateway-ws", "ours", "v4", RELAYED),
    Direction("chromium-gateway-ws-reference", "chromium", "gateway-ws", "reference", "v4+table", RELAYED),
    Direction("chromium-gateway-ws-ours", "chromium", "gateway-ws", "ours", "v4", RELAYED),
    Direction("reference-gateway-shared-tcp-reference", "reference", "gateway-shared-tcp", "reference", "v4"),
    Direction("reference-gateway-shared-ws-ours", "reference", "gateway-shared-ws", "ours", "v4+table"),
    Direction("ours-gateway-shared-tcp-reference", "ours", "gateway-shared-tcp", "reference", "v2"),
    Direction("ours-gateway-shared-tcp-ours", "ours", "gateway-shared-tcp", "ours", "v4"),
    Direction("node-gateway-shared-ws-reference", "node", "gateway-shared-ws", "reference", "v4+table"),
    Direction("node-gateway-shared-ws-ours", "node", "gateway-shared-ws", "ours", "v4"),
]


LOCAL_URL = "rr+local:///?nodename=interop.service&service=interop"
ENABLE_LOCAL = "--robotraconteur-local-enable=true"


def service_command(direction, level, page_origin):
    """`page_origin`: whose pages may connect straight to the service."""
    local = [ENABLE_LOCAL] if direction.route.endswith("local") else []
    if direction.service == "reference":
        return [sys.executable, PEERS / "service.py", *LEVELS[level], *local, f"--robotraconteur-tcp-ws-add-origins={page_origin}"]
    return [BUILD / "test/interop/cpp/rr-test-service", *LEVELS[level], *local, f"--allow-origin={page_origin}"]
