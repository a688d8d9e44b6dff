"""Strangers who make the gateway hold what they send and do not read, while others go on: memory is counted, and bounded."""
import concurrent.futures
import http.client
import json
import os
import socket
import subprocess
import sys
import time

import pytest
import RobotRaconteur as RR

from directions import PEERS
from gateways import running
from http_api import BASE, Stream, ask
from json_sockets import Socket
from shared_sites import is_refused, start_service

MEMORY = 64_000_000
BODY = 8_000_000
SLACK = 60_000_000  # of the process beside the account: sockets, a document while it is read, what malloc() keeps


@pytest.fixture
def gateway(tmp_path):
    device, url = start_service(tmp_path)
    config = {"devices": [{"name": "interop", "url": url, "mode": "shared"}],
              "limits": {"memory": MEMORY, "header_timeout_ms": 60_000}}  # of bodies, too
    with running(tmp_path, config) as gateway:
        gateway.wait_for("device online", device="interop")
        assert add(gateway, 1, 2) == 3
        yield gateway
    device.stop()


def add(gateway, left, right):
    answer = ask(gateway.port, "POST", "/add", {"left": left, "right": right}, base=BASE)
    assert answer.status == 200, answer.body
    return answer.json["result"]


class Stranger:
    """Comes from an address of his own."""

    def __init__(self, gateway, number=2):
        self.link = socket.create_connection(("127.0.0.1", gateway.port), 20, (f"127.0.0.{number}", 0))

    def post(self, told, sent, path="/echo"):
        """A body of `told` bytes, of which so many come."""
        self.link.sendall(f"POST {BASE}{path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                          f"Content-Length: {told}\r\n\r\n".encode())
        try:
            self.link.sendall(b" " * sent)
        except OSError:
            pass  # refused already

    def is_refused(self):
        """Whether he has been answered, with 503."""
        self.link.settimeout(0.05)
        try:
            return self.link.recv(100).startswith(b"HTTP/1.1 503 ")
        except TimeoutError:
            return False
        except OSError:
            return True
        finally:
            self.link.settimeout(20)

    def close(self):
        self.link.close()


def crowd(gateway, count, act, number=2):
    """So many strangers who do the same, at once."""
    strangers = [Stranger(gateway, number) for _ in range(count)]
    with concurrent.futures.ThreadPoolExecutor(16) as pool:
        list(pool.map(act, strangers))
    return strangers


def use_up(gateway):
    """Strangers at many addresses take all that each of them gets, until next to nothing is left."""
    strangers = []
    for number in range(2, 40):
        while True:
            stranger = Stranger(gateway, number)
            left = MEMORY - gateway.metrics()["rrgate_memory_budget_used_bytes"]
            if left < 60_000:
                return strangers
            stranger.post(max(1, min(BODY, left // 2)), 1)
            strangers.append(stranger)
            if stranger.is_refused():
                break
    return strangers


def test_bodies_that_nobody_finishes_are_counted_and_bounded(gateway):
    before = gateway.metrics()["process_resident_memory_bytes"]
    strangers = crowd(gateway, 60, lambda stranger: stranger.post(BODY, BODY - 1))
    metrics = gateway.metrics()
    assert metrics["rrgate_memory_budget_bytes"] == MEMORY
    assert 2 * BODY < metrics["rrgate_memory_budget_used_bytes"] <= MEMORY // 2  # one address gets no more
    assert metrics["rrgate_memory_budget_refusals_total"] >= 50
    assert metrics["process_resident_memory_bytes"] - before < MEMORY // 2 + SLACK
    assert [stranger.is_refused() for stranger in strangers].count(True) >= 50
    assert ask(gateway.port, "POST", "/sum", {"values": [1] * 100_000}, base=BASE).json == {"result": 100_000}
    for stranger in strangers:
        stranger.close()
    deadline = time.monotonic() + 10
    while gateway.metrics()["rrgate_memory_budget_used_bytes"] > 0:
        assert time.monotonic() < deadline


def test_answers_that_nobody_reads_are_counted_and_bounded(gateway):
    """Nine megabytes of text each, more than sockets hold."""
    body = json.dumps({"count": 1_000_000}).encode()
    before = gateway.metrics()
    strangers = []
    for count in range(1, 7):
        strangers.append(Stranger(gateway))
        strangers[-1].link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        strangers[-1].link.sendall(f"POST {BASE}/ramp HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                                   f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
        deadline = time.monotonic() + 20
        while True:
            now = gateway.metrics()
            held = now["rrgate_memory_budget_used_bytes"] // 8_800_000
            if held + now["rrgate_memory_budget_refusals_total"] >= count:
                break
            assert time.monotonic() < deadline, now
    assert held >= 2 and now["rrgate_memory_budget_used_bytes"] <= MEMORY // 2  # one address gets half
    assert held + now["rrgate_memory_budget_refusals_total"] == 6
    assert now["process_resident_memory_bytes"] - before["process_resident_memory_bytes"] < MEMORY + SLACK
    assert add(gateway, 3, 4) == 7
    for stranger in strangers:
        stranger.close()


def test_at_its_end_what_is_new_is_refused_and_what_runs_goes_on(gateway, node):
    stream = Stream(gateway.port, "/changed", base=BASE)
    root = node.ConnectService(f"rr+tcp://127.0.0.1:{gateway.port}/?nodename=interop&service=interop")
    with Socket(gateway.port) as page:
        assert page.ask("call", "add", args={"left": 1, "right": 1}) == 2
        strangers = use_up(gateway)
        refused = ask(gateway.port, "POST", "/add", {"left": 1, "right": 2}, base=BASE)
        assert refused.status == 503 and "no memory left" in refused.json["detail"]
        assert refused.headers["Retry-After"] == "2"
        assert is_refused(RR.ServiceException, lambda: root.add(1, 2))
        page.socket.send(json.dumps({"id": 1, "op": "get", "path": "version"}))
        assert "no memory left" in page.next(id=None)["error"]["message"]
        assert ask(gateway.port, "GET", "/healthz").status == 200
        for stranger in strangers:
            stranger.close()
        deadline = time.monotonic() + 10
        while ask(gateway.port, "POST", "/fire", {"count": 1}, base=BASE).status == 503:
            assert time.monotonic() < deadline
        assert stream.next()[2] is not None
        assert root.add(1, 2) == 3
        assert page.ask("call", "add", args={"left": 1, "right": 1}) == 2
    node.DisconnectService(root)
    stream.close()


def test_documents_of_json_sockets_count_as_what_they_become(gateway):
    """Three megabytes of text become more than half of the account."""
    with Socket(gateway.port) as page:
        page.socket.send(json.dumps({"id": 1, "op": "call", "path": "sum", "args": {"values": [1] * 1_000_000}}))
        error = page.next(id=None)["error"]
        assert error["name"] == "RobotRaconteur.OutOfSystemResource" and "no memory left" in error["message"], error
        assert page.ask("call", "sum", args={"values": [1] * 100_000}) == 100_000
    refused = ask(gateway.port, "POST", "/sum", {"values": [1] * 1_000_000}, base=BASE)
    assert refused.status == 503 and "no memory left" in refused.json["detail"]


def test_events_that_are_kept_count(gateway):
    stream = Stream(gateway.port, "/changed", base=BASE)
    assert gateway.metrics()["rrgate_memory_budget_used_bytes"] == 0
    assert ask(gateway.port, "POST", "/fire", {"count": 300}, base=BASE).status == 200
    for _ in range(300):
        stream.next()
    kept = gateway.metrics()["rrgate_memory_budget_used_bytes"]
    assert ask(gateway.port, "POST", "/fire", {"count": 300}, base=BASE).status == 200
    for _ in range(300):
        stream.next()
    assert 0 < kept == gateway.metrics()["rrgate_memory_budget_used_bytes"]  # 256 of them
    stream.close()


CROWD = int(os.environ.get("RR_CROWD", 2000))  # connections; 10,000 where the machine lets one process have so many descriptors
MOST_EACH = 16_000  # bytes, as docs/deploy.md says
MOST_ADDED = 0.02  # s, of the 99th of 100 answers


def p99_of_answers(connection, count=400):
    times = []
    for _ in range(count):
        begin = time.perf_counter()
        connection.request("POST", BASE + "/add", json.dumps({"left": 1, "right": 2}), {"Content-Type": "application/json"})
        answer = connection.getresponse()
        assert (answer.status, json.loads(answer.read())) == (200, {"result": 3})
        times.append(time.perf_counter() - begin)
        time.sleep(0.002)
    return sorted(times)[count * 99 // 100]


def test_a_crowd_of_strangers_costs_little_memory_and_those_inside_little_time(tmp_path):
    device, url = start_service(tmp_path)
    config = {"devices": [{"name": "interop", "url": url, "mode": "shared"}], "limits": {"clients": CROWD + 100, "clients_per_address": CROWD // 50}}
    with running(tmp_path, config) as gateway:
        gateway.wait_for("device online", device="interop")
        assert add(gateway, 1, 2) == 3
        before = gateway.metrics()["process_resident_memory_bytes"]
        inside = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=20)
        quiet = p99_of_answers(inside)
        flood = subprocess.Popen([sys.executable, PEERS / "flood.py", str(gateway.port), str(CROWD), "50"],
                                 stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        try:
            # Others use the machine as well: the best of three rounds counts.
            added = []
            while len(added) < 3 and (not added or min(added) > MOST_ADDED):
                added.append(p99_of_answers(inside) - quiet)
            assert flood.stdout.readline() == "all have come\n"
            metrics = gateway.metrics()
        finally:
            flood.communicate()
    device.stop()
    assert min(added) < MOST_ADDED, (quiet, added)
    assert metrics["process_resident_memory_bytes"] - before < CROWD * MOST_EACH + 8_000_000
