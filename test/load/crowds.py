"""What strangers cost the gateway and those inside: 10,000 connections from 50 addresses, and TLS handshakes. Rows for measure.py."""
import contextlib
import http.client
import json
import pathlib
import socket
import ssl
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))

from directions import PEERS  # noqa: E402
from gateways import make_web_certificates, running  # noqa: E402
from http_api import BASE  # noqa: E402
from load import connections_to, cpu_seconds, resident_bytes  # noqa: E402
from rows import Row  # noqa: E402
from shared_sites import start_service  # noqa: E402
from users import RULES, basic, make_users  # noqa: E402

CROWD, ADDRESSES = 10_000, 50
ROUNDS, ASKED = 3, 400
HANDSHAKES = 50  # a second


@contextlib.contextmanager
def site(folder, limits={}):
    """A gateway with TLS and users."""
    folder.mkdir(exist_ok=True)
    make_users(folder)
    device, url = start_service(folder)
    try:
        with running(folder, {
            "devices": [{"name": "interop", "url": url, "mode": "shared"}], "tls": make_web_certificates(folder / "web"),
            "access": {"users_file": "users", "rules": RULES},
            "limits": limits,
        }) as gateway:
            gateway.wait_for("device online", device="interop")
            yield gateway
    finally:
        device.stop()


@contextlib.contextmanager
def crowd(gateway, connections, addresses):
    """They are there in the block; gives what waits until all have come once."""
    flood = subprocess.Popen([sys.executable, PEERS / "flood.py", str(gateway.port), str(connections), str(addresses)],
                             stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield flood.stdout.readline
    finally:
        flood.communicate()


class Inside:
    """Somebody who has a connection and a password."""

    def __init__(self, gateway):
        self._connection = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=20)

    def ask(self):
        self._connection.request("POST", BASE + "/add", json.dumps({"left": 1, "right": 2}),
                                 {"Content-Type": "application/json", **basic("root")})
        answer = self._connection.getresponse()
        assert (answer.status, json.loads(answer.read())) == (200, {"result": 3})

    def p99(self, count=ASKED):
        """Milliseconds, of that many answers."""
        times = []
        for _ in range(count):
            begin = time.perf_counter()
            self.ask()
            times.append(time.perf_counter() - begin)
            time.sleep(0.002)
        return sorted(times)[count * 99 // 100] * 1e3


@contextlib.contextmanager
def handshakes(gateway, rate):
    """So many a second, each of a client who leaves behind it."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    done, ends = [], threading.Event()

    def shake():
        due = time.monotonic()
        while not ends.is_set():
            with socket.create_connection(("127.0.0.1", gateway.port), 20, ("127.0.2.1", 0)) as link, context.wrap_socket(link):
                done.append(time.monotonic())
            due += 1 / rate
            ends.wait(max(0, due - time.monotonic()))

    thread = threading.Thread(target=shake)
    thread.start()
    try:
        yield done
    finally:
        ends.set()
        thread.join()


def room(connections, addresses):
    """Limits into which that many fit."""
    return {"clients": connections + 100, "clients_per_address": connections // addresses}


def strangers(folder, _mode):
    """With the limits as they come, and where all may come in."""
    for name, limits in (("the default limits", {}), ("room for all", room(CROWD, ADDRESSES))):
        with site(folder / name.replace(" ", "-"), limits) as gateway:
            inside, pid = Inside(gateway), gateway.process.process.pid
            inside.ask()
            before = resident_bytes(pid)
            quiet = min(inside.p99() for _ in range(ROUNDS))
            with crowd(gateway, CROWD, ADDRESSES) as all_have_come:
                loud = [inside.p99() for _ in range(ROUNDS)]
                all_have_come()
                held, there = resident_bytes(pid), connections_to(pid, gateway.port)
        yield Row(f"memory that {CROWD} strangers of {ADDRESSES} addresses add, {name}, {there} of them inside at the time",
                  (held - before) / 1e6, None, "MB", promise=64 if not limits else None)
        yield Row(f"p99 of an answer to somebody inside that they add, {name}, best of {ROUNDS} rounds", min(loud) - quiet, None, "ms",
                  promise=20)
        yield Row("p99 of an answer to somebody inside, without them", quiet, None, "ms")
    with site(folder / "handshakes") as gateway:
        inside, pid = Inside(gateway), gateway.process.process.pid
        quiet = min(inside.p99() for _ in range(ROUNDS))
        with handshakes(gateway, HANDSHAKES) as done:
            cpu, begin = cpu_seconds(pid), time.monotonic()
            time.sleep(5)
            cpu, seconds = cpu_seconds(pid) - cpu, time.monotonic() - begin
            rate = sum(moment >= begin for moment in done) / seconds
            loud = min(inside.p99() for _ in range(ROUNDS))
        yield Row(f"p99 of an answer to somebody inside that {rate:.0f} TLS handshakes a second add", loud - quiet, None, "ms", promise=20)
        yield Row("processor time of a TLS handshake", cpu / seconds / rate * 1e3, None, "ms")
