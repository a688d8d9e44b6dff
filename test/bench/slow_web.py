#!/usr/bin/env python3
"""What bench_slow measures, for clients that come by HTTP and by JSON sockets: a call of one while the handler of another takes 5 s,
against what it takes without. Prints results as lines of JSON: slow_web.py NAME PORT, of a gateway in front of `bench_peer service`."""
import contextlib
import json
import pathlib
import sys
import threading
import time

import agents

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))

from http_api import fetch  # noqa: E402
from json_sockets import Socket  # noqa: E402

SECONDS = 5
SERVICE = "/api/v1/devices/device/interop"
ARGUMENTS = {"nothing": {}, "wait": {"seconds": SECONDS}}


def main():
    name, port = sys.argv[1], int(sys.argv[2])
    while json.loads(fetch(port, "/readyz")[2])["devices_online"] == 0:
        time.sleep(0.05)
    for face, connected in (("HTTP", by_http), ("JSON socket", by_socket)):
        with connected(port) as call, connected(port) as other:
            measure(f"{name}, {face}", call, other)


@contextlib.contextmanager
def by_http(port):
    """Calls over connections of its own."""
    askers = {name: agents.asker(port, f"{SERVICE}/{name}", arguments) for name, arguments in ARGUMENTS.items()}
    yield lambda name: askers[name]()


@contextlib.contextmanager
def by_socket(port):
    with Socket(port, SERVICE) as socket:
        yield lambda name: socket.ask("call", name, args=ARGUMENTS[name])


def measure(name, call, other):
    for _ in range(500):
        call("nothing")
    slow = threading.Thread(target=other, args=("wait",))
    begin = time.monotonic()
    slow.start()
    beside = calls_while(call, slow.is_alive)
    slow.join()
    assert time.monotonic() - begin >= SECONDS, f"{name}: the slow call has failed"
    end = time.monotonic() + SECONDS
    alone = calls_while(call, lambda: time.monotonic() < end)
    print(json.dumps({"name": name, "ours": agents.figures(beside), "yardstick": agents.figures(alone)}))


def calls_while(call, goes_on):
    """Nanoseconds of one call each millisecond, from when it is due: what holds one up is seen in all that should have followed."""
    taken, due = [], time.perf_counter_ns()
    while goes_on():
        time.sleep(max(0, due - time.perf_counter_ns()) / 1e9)
        call("nothing")
        taken.append(time.perf_counter_ns() - due)
        due += 1_000_000
    return taken


if __name__ == "__main__":
    main()
