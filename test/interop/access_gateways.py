"""Gateways with users and rights, and what is open for somebody there."""
import contextlib
import json
import time

import websockets.sync.client

from gateways import Gateway
from http_api import BASE, JSON_PROTOCOL, Stream, ask, open_websocket


@contextlib.contextmanager
def running(folder, device, access, **more):
    gateway = Gateway(folder, {"devices": [{"name": "interop", "url": device}], "access": access, **more})
    gateway.folder = folder
    try:
        gateway.wait_for("device online", device="interop")
        yield gateway
    finally:
        assert gateway.process.stop() == 0, gateway.process.description()


def audit_of(gateway, is_there=lambda records: True):
    """What others than the audit log itself are recorded with, once it is there: it is written a moment later."""
    found = []

    def read():
        lines = (gateway.folder / "audit").read_text().splitlines()
        found[:] = [each for each in map(json.loads, lines) if each["event"] not in ("started", "stopped")]
        return is_there(found)

    gateway.process.wait_until(read)
    return found


NATIVE_CLIENT = """
import sys
import RobotRaconteur as RR
with RR.ClientNodeSetup():
    try:
        print(RR.RobotRaconteurNode.s.ConnectService(sys.argv[1]).p_double)
    except Exception as error:
        print(type(error).__name__, error)
"""


def cookie_of(answer):
    assert answer.status == 201, answer.body
    return answer.headers["Set-Cookie"].split(";")[0]


def ends(link):
    """Waits for the end of a connection, however it comes. Returns after how many seconds."""
    began = time.monotonic()
    link.settimeout(10)
    with contextlib.suppress(ConnectionError):
        while link.recv(4096):
            pass
    return time.monotonic() - began


@contextlib.contextmanager
def sessions_of_all_kinds(port, proof, protocol="Sec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\n"):
    """{name: socket} of what stays open for somebody: relayed, shared and JSON sessions, streams; and one that is let in
    by a ticket for the same proof."""
    header = "".join(f"{name}: {value}\r\n" for name, value in proof.items())
    ticket = ask(port, "POST", "/api/v1/tickets", headers=proof).json["ticket"]
    links = {
        "relay": open_websocket(port, "/devices/relayed", header),
        "shared": open_websocket(port, "/devices/interop", header + protocol),
        "json": open_websocket(port, BASE, header + f"Sec-WebSocket-Protocol: {JSON_PROTOCOL}\r\n"),
        "ticket": open_websocket(port, f"/devices/interop?ticket={ticket}", protocol),
    }
    stream = Stream(port, BASE + "/cleared", proof)
    links["stream"] = stream.connection.sock or stream.response.fp.raw._sock
    try:
        yield links
    finally:
        stream.close()
        for link in links.values():
            link.close()


def json_socket(port, headers={}, path=BASE):
    return websockets.sync.client.connect(f"ws://127.0.0.1:{port}{path}", additional_headers=headers,
                                          subprotocols=[JSON_PROTOCOL], proxy=None)
