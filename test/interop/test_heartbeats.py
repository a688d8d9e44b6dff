"""When a peer that hears nothing asks whether the other is there, and when it gives up: measured on a line that goes dead.

Quick for our clients; RR_LONG_TESTS=1 also waits for the protocol's own periods, of both sides and of the reference's.
"""
import json
import os
import selectors
import socket
import sys
import threading
import time

import pytest

from clients import without_expectations
from directions import PEERS
from processes import BUILD, Background

IDLE = [{"listen": "cleared"}, *[{"events": "cleared", "count": 1}] * 5]  # waits 10 s for each


def readable(sockets, seconds=None):
    with selectors.DefaultSelector() as selector:  # select() knows no descriptors above 1023
        for each in sockets:
            selector.register(each, selectors.EVENT_READ)
        return [key.fileobj for key, _ in selector.select(seconds)]


class Line:
    """Between a client and a service; dead as soon as nothing was said on it for a second, but not closed."""

    def __init__(self, port):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.heard = {"client": [], "service": []}  # seconds after the last word, of each heartbeat
        self.ended = {}  # likewise, when that side gave up
        self._thread = threading.Thread(target=self._run, args=(port,), daemon=True)
        self._thread.start()

    def _run(self, port):
        client, _ = self._listener.accept()
        service = socket.create_connection(("127.0.0.1", port))
        other = {client: service, service: client}
        while ready := readable(other, 1):
            for side in ready:
                other[side].sendall(side.recv(65536))
        last_word = time.monotonic() - 1
        names = {client: "client", service: "service"}
        while names:
            for side in readable(names):
                try:
                    data = side.recv(65536)
                except ConnectionError:
                    data = b""
                at = round(time.monotonic() - last_word, 2)
                if data:
                    self.heard[names[side]].append(at)
                else:
                    self.ended[names.pop(side)] = at

    def wait(self, side, seconds):
        """Until a side has given up."""
        deadline = time.monotonic() + seconds
        while side not in self.ended:
            assert time.monotonic() < deadline, (self.heard, self.ended)
            time.sleep(0.02)


@pytest.fixture
def line(tmp_path):
    """line(client, service, *options of the client): one between them, with an idle session."""
    running = []

    def make(client, service, *options):
        log = tmp_path / f"{len(running)}.log"
        program = {"reference": [sys.executable, PEERS / "service.py"], "ours": [BUILD / "test/interop/cpp/rr-test-service"]}
        running.append(Background(program[service], log.with_suffix(".service")))
        made = Line(json.loads(running[-1].next_line())["port"])
        program = {"reference": [sys.executable, PEERS / "client.py"], "ours": [BUILD / "test/interop/cpp/rr-test-client"]}
        running.append(Background([*program[client], f"rr+tcp://127.0.0.1:{made.port}/?service=interop", *options], log))
        running[-1].write_line({"steps": without_expectations(IDLE)})
        running[-1].process.stdin.close()
        return made

    yield make
    for process in reversed(running):
        process.stop()


def test_quick_heartbeats(line):
    """A heartbeat after 1.5 s without a word, and 2.25 s for its answer."""
    dead = line("ours", "ours", "--heartbeat-ms=1500")
    dead.wait("client", 15)
    assert len(dead.heard["client"]) >= 1 and 1.4 < dead.heard["client"][0] < 2.6, dead.heard
    assert 3.6 < dead.ended["client"] < 5.5, dead.ended


def periods(line, record_property):
    lines = {"ours": line("ours", "ours"), "reference": line("reference", "reference")}
    for who, dead in lines.items():
        for side in ("client", "service"):
            dead.wait(side, 50)
            record_property(f"{who} {side}", json.dumps({"heartbeats": dead.heard[side], "gave up": dead.ended[side]}))
    print({who: (dead.heard, dead.ended) for who, dead in lines.items()})
    ours = lines["ours"]
    assert 9.5 < ours.heard["client"][0] < 11.5 and 24 < ours.ended["client"] < 27
    assert 9.5 < ours.heard["service"][0] < 13.5 and 24 < ours.ended["service"] < 29


if "RR_LONG_TESTS" in os.environ:
    test_the_periods_of_the_protocol = periods
