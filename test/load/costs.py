"""What clients cost the gateway: processor time of a delivery, memory of a connection. Rows for measure.py."""
import contextlib
import json
import pathlib
import re
import selectors
import socket
import subprocess
import sys
import time
import urllib.request

import RobotRaconteur as RR

from load import PROGRAMS, Clients, Device, Gateway, running
from rows import Row

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop" / "peers"))

import quiet_node  # noqa: E402

RATE = 100
FOLLOWERS = 200
SECONDS = 8
IDLE_BYTES = 16384  # of a client that is connected and does nothing
CLIENTS, ROUNDS = 1000, 10
LARGE = 7_000_000
DEADLINE = 30.0
FOLLOW = b"GET /api/v1/devices/load/Load/state HTTP/1.1\r\nHost: localhost\r\nAccept: text/event-stream\r\n\r\n"
SENDERS = {"wire": ({"rate": RATE}, {"wire": "state"}),
           "event": ({"rate": 0, "event_rate": RATE}, {"wire": "", "event": "moved"}),
           "pipe": ({"rate": 0, "packet_rate": RATE, "packet_bytes": 80}, {"wire": "", "pipe": "packets"})}


def deliveries(folder, mode):
    """What one value costs for one of many clients; the yardstick is a bare send() of as many bytes, before and after it. Where
    bytes are passed on, the gateway reads them once for each client too: then it is for information."""
    for scheme in ("rr+tcp", "rr+ws"):
        for kind, (sends, listens) in SENDERS.items():
            with running(Device(folder, **sends)) as device, running(Gateway(folder, device.url, mode)) as gateway:
                size = delivery(folder, gateway, scheme, listens, seconds=2)[1]
                before = bare_send(size)
                ours = delivery(folder, gateway, scheme, listens)[0]
            yield Row(f"CPU of the gateway for a delivery of {size} bytes, {kind} at {RATE} Hz to {FOLLOWERS} clients by {scheme}, "
                      "against a bare send", ours, (before + bare_send(size)) / 2, "us",
                      1.3 if mode else None)


def delivery(folder, gateway, scheme, listens, seconds=SECONDS):
    """Microseconds, and bytes on the socket."""
    with running(Clients(folder, gateway.url(scheme), FOLLOWERS, "--seconds", seconds + 2, **listens)) as clients:
        ready = clients.wait_until_ready()
        assert ready["ready"] == FOLLOWERS, ready
        time.sleep(1)  # what is kept for who comes late is on its way
        began, cpu, bytes_before, messages_before = time.monotonic(), gateway.cpu_seconds(), *sent(gateway)
        time.sleep(seconds)
        share = (gateway.cpu_seconds() - cpu) / (time.monotonic() - began)
        bytes_after, messages_after = sent(gateway)
        end = clients.report()
    payload = round((bytes_after - bytes_before) / (messages_after - messages_before))
    rate = (end["values"] + end["packets"]) / end["window_seconds"]
    header = 0 if scheme == "rr+tcp" else 2 if payload < 126 else 4
    return share / rate * 1e6, payload + header


def json_deliveries(folder, mode):
    """The same for those who follow a wire as JSON, by an event stream."""
    with running(Device(folder, rate=RATE)) as device, running(Gateway(folder, device.url, mode)) as gateway:
        with contextlib.ExitStack() as stack, selectors.DefaultSelector() as streams:
            for _ in range(FOLLOWERS):
                stream = stack.enter_context(socket.create_connection(("127.0.0.1", gateway.port)))
                stream.sendall(FOLLOW)
                streams.register(stream, selectors.EVENT_READ)
            values_in(streams, 1)  # all are there
            cpu = gateway.cpu_seconds()
            count, size = values_in(streams, SECONDS)
            ours = (gateway.cpu_seconds() - cpu) / count * 1e6
    yield Row(f"CPU of the gateway for a value of {size} bytes as JSON, wire at {RATE} Hz to {FOLLOWERS} event streams, against a "
              "bare send", ours, bare_send(size), "us")


def values_in(streams, seconds):
    """How many came in this time, and the bytes of one."""
    count = received = 0
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        for key, _ in streams.select(left):
            news = key.fileobj.recv(65536)
            assert news, "the gateway has ended a stream"
            count += news.count(b"data: ")
            received += len(news)
    return count, round(received / max(count, 1))


def sent(gateway):
    """Bytes and messages that clients were sent."""
    with urllib.request.urlopen(f"http://127.0.0.1:{gateway.port}/metrics", timeout=10) as answer:
        text = answer.read().decode()
    return [float(re.search(rf'rrgate_relayed_{what}_total{{[^}}]*direction="to_clients"[^}}]*}} (\S+)', text)[1])
            for what in ("bytes", "messages")]


def bare_send(size):
    done = subprocess.run([PROGRAMS / "bare_send", *map(str, (FOLLOWERS, size, RATE, SECONDS))], stdout=subprocess.PIPE, check=True)
    result = json.loads(done.stdout)
    return result["cpu_seconds"] / result["sends"] * 1e6


def memory(folder, mode):
    """Of clients that come, stay and go, and of one large message."""
    with running(Device(folder, rate=0)) as device, running(Gateway(folder, device.url, mode)) as gateway:
        with connected(folder, gateway, 1):
            pass
        files, empty, rounds = gateway.open_files(), gateway.resident_bytes(), []
        for _ in range(ROUNDS):
            with connected(folder, gateway, CLIENTS):
                held = gateway.resident_bytes()
            wait_until(lambda: gateway.open_files() <= files)
            rounds.append((held, gateway.resident_bytes()))
        left = gateway.open_files() - files
        before = gateway.resident_bytes()
        with robot(gateway) as client:
            assert len(client.many(LARGE)) == LARGE
            after = gateway.resident_bytes()
    yield Row(f"memory of an idle WebSocket client, {CLIENTS} of them", (rounds[0][0] - empty) / CLIENTS, None, "B",
              promise=IDLE_BYTES)
    yield Row(f"memory that the last half of {ROUNDS} rounds of {CLIENTS} clients that come and go added",
              (rounds[-1][1] - rounds[ROUNDS // 2 - 1][1]) / 1e6, None, "MB", promise=1)
    yield Row("memory after the last round, against that after the first", rounds[-1][1] / 1e6, rounds[0][1] / 1e6, "MB", 1.1)
    yield Row(f"descriptors after {ROUNDS} rounds, more than before", left, None, "", promise=0)
    yield Row(f"memory after a message of {LARGE // 1_000_000} MB, more than before", (after - before) / 1e6, None, "MB", promise=1)


@contextlib.contextmanager
def connected(folder, gateway, count):
    with running(Clients(folder, gateway.url("rr+ws"), count, wire="")) as clients:
        ready = clients.wait_until_ready()
        assert ready["ready"] == count, ready
        yield


@contextlib.contextmanager
def robot(gateway):
    with RR.ClientNodeSetup(argv=quiet_node.arguments(server=False)):
        client = RR.RobotRaconteurNode.s.ConnectService(gateway.url())
        yield client
        RR.RobotRaconteurNode.s.DisconnectService(client)


def wait_until(is_done):
    until = time.monotonic() + DEADLINE
    while not is_done() and time.monotonic() < until:
        time.sleep(0.05)
