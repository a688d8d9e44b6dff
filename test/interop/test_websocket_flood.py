"""A client that floods a WebSocket with small frames: others are answered meanwhile, memory is bounded, and who takes none of
the answers is cut."""
import json
import struct
import threading
import time

import pytest

from gateways import running
from http_api import BASE, JSON_PROTOCOL, ask, open_websocket
from load import resident_bytes
from shared_sites import start_service

SECONDS = 3
MOST_LATENCY = 1.0
MOST_MEMORY = 40_000_000
STALL_MS = 1000
CONTINUATION, TEXT, BINARY, PING, PONG = 0, 1, 2, 9, 10
SOCKETS = {"json": (BASE, JSON_PROTOCOL, TEXT), "robot raconteur": ("/devices/interop", "robotraconteur.robotraconteur.com", BINARY)}


def frame(opcode, payload=b"", final=True):
    """With a mask of zeros, which changes nothing."""
    length = bytes([0x80 | len(payload)]) if len(payload) < 126 else b"\xfe" + struct.pack(">H", len(payload))
    return bytes([opcode | (0x80 if final else 0)]) + length + bytes(4) + payload


def request(op):
    return frame(TEXT, json.dumps({"id": 1, "op": op, "path": "p_int32"}).encode())


# What comes once, what comes again and again, and whether there are answers to it, which nobody reads.
FLOODS = {
    "pings": lambda opcode: (b"", frame(PING), True),
    "long pings": lambda opcode: (b"", frame(PING, bytes(125)), True),
    "pongs": lambda opcode: (b"", frame(PONG), False),
    "empty fragments": lambda opcode: (frame(opcode, final=False), frame(CONTINUATION, final=False), False),
    "pings between fragments": lambda opcode: (frame(opcode, final=False), frame(PING) + frame(CONTINUATION, final=False), True),
    "requests": lambda opcode: (b"", request("get"), True),
    "what is none": lambda opcode: (b"", frame(TEXT, b"{}"), True),
}


class Flood:
    """Sends as fast as it can on a thread of its own, until the time is over or it is cut; reads nothing."""

    def __init__(self, port, path, protocol, first, block):
        self.link = open_websocket(port, path, f"Sec-WebSocket-Protocol: {protocol}\r\n")
        self.link.settimeout(SECONDS)
        self.first, self.block = first, block * (65536 // len(block))
        self.sent, self.is_cut = 0, False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        end = time.monotonic() + SECONDS
        try:
            self.link.sendall(self.first)
            while time.monotonic() < end:
                self.sent += self.link.send(self.block)
        except TimeoutError:
            pass  # the gateway takes no more of it
        except OSError:
            self.is_cut = True

    def is_ended(self):
        """Whether the gateway has closed the connection, once what it has said is read."""
        self.link.settimeout(10)
        try:
            while self.link.recv(1 << 20):
                pass
        except TimeoutError:
            return False
        except OSError:
            pass
        return True


@pytest.fixture(scope="module")
def gateway(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flood")
    device, url = start_service(folder)
    with running(folder, {"devices": [{"name": "interop", "url": url, "mode": "shared"}], "timeouts": {"send_stall_ms": STALL_MS}}) as gateway:
        gateway.wait_for("device online", device="interop")
        yield gateway
    device.stop()


@pytest.mark.parametrize("flood", FLOODS)
@pytest.mark.parametrize("face", SOCKETS)
def test_a_flood_of_small_frames_keeps_nobody_waiting(gateway, face, flood):
    path, protocol, opcode = SOCKETS[face]
    if face != "json" and flood in ("requests", "what is none"):
        opcode = TEXT  # which ends the connection there
    first, block, has_answers = FLOODS[flood](opcode)
    assert ask(gateway.port, "GET", BASE + "/p_int32").status == 200
    before = resident_bytes(gateway.process.process.pid)
    flooding = Flood(gateway.port, path, protocol, first, block)
    latencies, most = [], 0
    while flooding.thread.is_alive() or not latencies:
        begun = time.monotonic()
        assert ask(gateway.port, "GET", BASE + "/p_int32").status == 200
        latencies.append(time.monotonic() - begun)
        most = max(most, resident_bytes(gateway.process.process.pid))
        flooding.thread.join(0.02)
    assert len(latencies) > 1 or flooding.is_cut
    assert max(latencies) < MOST_LATENCY
    assert most - before < MOST_MEMORY
    if has_answers:
        time.sleep(2 * STALL_MS / 1000)  # with nobody reading: how long that may last is what is tested
        assert flooding.is_cut or flooding.is_ended()
    flooding.link.close()
    assert ask(gateway.port, "GET", BASE + "/p_int32").status == 200


def test_a_message_of_endless_fragments_ends_at_the_limit_of_messages(gateway):
    link = open_websocket(gateway.port, BASE, f"Sec-WebSocket-Protocol: {JSON_PROTOCOL}\r\n")
    link.settimeout(20)
    link.sendall(frame(TEXT, final=False))
    block = frame(CONTINUATION, bytes(60_000), final=False)
    with pytest.raises(OSError):
        for _ in range(1000):  # 60 MB
            link.sendall(block)
    link.close()
    assert ask(gateway.port, "GET", BASE + "/p_int32").status == 200
