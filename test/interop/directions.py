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
    client: str  # reference, ours, browser
    route: str  # direct, gateway-tcp, gateway-ws
    service: str  # reference, ours
    levels: tuple = tuple(LEVELS)


# The first shows that scenarios and peers are right: the reference talks to itself.
DIRECTIONS = [
    Direction("reference-to-reference", "reference", "direct", "reference"),
    Direction("reference-to-ours", "reference", "direct", "ours"),
    Direction("ours-to-reference", "ours", "direct", "reference"),
    Direction("ours-to-ours", "ours", "direct", "ours"),
    Direction("browser-to-reference", "browser", "direct", "reference"),
    Direction("reference-gateway-tcp-reference", "reference", "gateway-tcp", "reference"),
    Direction("reference-gateway-ws-reference", "reference", "gateway-ws", "reference"),
    Direction("reference-gateway-tcp-ours", "reference", "gateway-tcp", "ours"),
    Direction("ours-gateway-tcp-reference", "ours", "gateway-tcp", "reference"),
    Direction("browser-gateway-ws-reference", "browser", "gateway-ws", "reference"),
    Direction("browser-gateway-ws-ours", "browser", "gateway-ws", "ours"),
]


def service_command(service, level):
    if service == "reference":
        return [sys.executable, PEERS / "service.py", *LEVELS[level]]
    return [BUILD / "test/interop/cpp/rr-test-service", *LEVELS[level]]


def client_command(direction, port):
    if direction.client == "browser":
        path = "" if direction.route == "direct" else "devices/interop"  # a node takes WebSockets on its own port
        return ["node", ROOT / "test/interop/js/client.mjs", f"ws://127.0.0.1:{port}/{path}?service=interop"]
    url = {
        "direct": f"rr+tcp://127.0.0.1:{port}/?service=interop",
        # A native client names the device that it wants; the gateway is only the way to it.
        "gateway-tcp": f"rr+tcp://127.0.0.1:{port}/?nodename=interop.service&service=interop",
        "gateway-ws": f"rr+ws://127.0.0.1:{port}/devices/interop?service=interop",
    }[direction.route]
    if direction.client == "reference":
        return [sys.executable, PEERS / "client.py", url, "--robotraconteur-disable-stringtable=false"]
    return [BUILD / "test/interop/cpp/rr-test-client", url]
