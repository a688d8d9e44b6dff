#!/usr/bin/env python3
"""Measures many clients of one device through the gateway: measure.py --report FILE [--mode MODE] [--clients N] [PART...]

Everything is compared with something of the same run, and what is promised to users is held to the promise too: that a
yardstick was as bad is no excuse. Ends with 1 where something is missed. Builds are those of RR_BUILD, build/release where it
is not set.
"""
import argparse
import pathlib
import sys
import tempfile
import time

import costs
import crowds
from load import Clients, Device, Gateway, running
from rows import Row, publish

SECONDS = 10
OLDEST_MS = 50  # what is promised of a value that a thousand clients follow, at the 99th percentile
BULK = {"packet_rate": 50, "packet_bytes": 32768}


def fan_out(folder, mode, count):
    """Many clients of a wire with 100 values a second; the yardstick are one client, and the same many at the device."""
    with running(Device(folder)) as device:
        direct = with_clients(folder, device, device.url, count)
        with running(Gateway(folder, device.url, mode)) as gateway:
            one = with_clients(folder, device, gateway.url(), 1)
            many = with_clients(folder, device, gateway.url(), count)
    yield Row(f"connections of the device, {count} clients", many["connections"], None, "", promise=1)
    yield Row(f"CPU of the device, {count} clients against one", many["cpu"] * 100, one["cpu"] * 100, "%", 1.5)
    yield Row(f"p99 age of values, {count} clients through the gateway against as many at the device",
              many["age_ms"]["p99"], direct["age_ms"]["p99"], "ms", 2, promise=OLDEST_MS)
    yield Row(f"p50 age of values, {count} clients through the gateway against as many at the device",
              many["age_ms"]["p50"], direct["age_ms"]["p50"], "ms")
    yield Row("slowest client's share of the values that it would get alone",
              one["rate"]["median"], many["rate"]["min"], "/s", 2)


def with_clients(folder, device, url, count):
    """The clients' report, with the device's connections and the share of a processor that it took."""
    with running(Clients(folder, url, count, "--seconds", SECONDS)) as clients:
        ready = clients.wait_until_ready()
        if ready["ready"] < count:
            raise SystemExit(f"{url}: {ready}")
        begin, before = time.monotonic(), device.cpu_seconds()
        connections = device.connections()
        time.sleep(SECONDS / 2)
        cpu = (device.cpu_seconds() - before) / (time.monotonic() - begin)
        return {**clients.report(), "connections": connections, "cpu": cpu}


def one_stalls(folder, mode):
    """50 clients with a wire and a pipe, one of which stops reading; the yardstick is the same without it."""
    with running(Device(folder, **BULK)) as device, \
            running(Gateway(folder, device.url, mode, timeouts={"send_stall_ms": 5000})) as gateway:
        with running(Clients(folder, gateway.url(), 49, "--seconds", SECONDS, pipe="packets")) as others:
            others.wait_until_ready()
            alone = others.report()
        with running(Clients(folder, gateway.url(), 49, "--seconds", SECONDS, pipe="packets")) as others, \
                running(Clients(folder, gateway.url(), 1, "--stalled", 1, name="stalled", pipe="packets")) as stalled:
            others.wait_until_ready()
            stalled.wait_until_ready()
            before = most = gateway.resident_bytes()
            end = time.monotonic() + SECONDS
            while time.monotonic() < end:
                most = max(most, gateway.resident_bytes())
                time.sleep(0.05)
            disturbed = others.report()
            ends = [event["reason"] for event in gateway.events("client disconnected")]
            print(f"the stalled client: {stalled.resume()}; the gateway: {len(ends)} ended, {set(ends)}")
    yield Row("p99 age of the others' values, with one that stops reading against without", disturbed["age_ms"]["p99"],
              alone["age_ms"]["p99"], "ms", 1.5)
    yield Row("packets that the others missed", disturbed["packet_gaps"], None, "", promise=0)
    yield Row("connections that the others lost", sum(disturbed["lost"].values()), None, "", promise=0)
    yield Row("memory that the gateway takes for it", (most - before) / 1e6, None, "MB", promise=16)


def storm(folder, mode, count):
    """The gateway is killed, and all connect again; the yardstick is the time they took at first."""
    with running(Device(folder)) as device, running(Gateway(folder, device.url, mode)) as gateway:
        with running(Clients(folder, gateway.url("rr+ws"), count, "--storm")) as clients:
            first = clients.wait_until_ready()["seconds"]
            time.sleep(1)
            gateway.kill()
            gateway.start()
            again = clients.wait_until_ready()
            report = clients.finish()
    yield Row(f"until {count} clients have values, after kill -9 against at first", again["seconds"], first, "s", 5)
    yield Row("clients that did not come back", count - report["ready"], None, "", promise=0)


PARTS = {"age": fan_out, "stall": one_stalls, "storm": storm, "delivery": costs.deliveries, "json": costs.json_deliveries,
         "memory": costs.memory, "strangers": crowds.strangers}


def measure(mode, count, parts):
    for name in parts:
        with tempfile.TemporaryDirectory() as scratch:
            yield from PARTS[name](pathlib.Path(scratch), mode, *([count] if name in ("age", "storm") else []))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", type=pathlib.Path, required=True)
    parser.add_argument("--mode", choices=["relay", "shared"], default="shared")
    parser.add_argument("--clients", type=int, default=1000)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"all, or some of: {' '.join(PARTS)}")
    arguments = parser.parse_args()
    mode = {} if arguments.mode == "relay" else {"mode": arguments.mode}
    rows = measure(mode, arguments.clients, arguments.parts or PARTS)
    return publish(arguments.report, "Load", f"load, mode {arguments.mode}", rows)


if __name__ == "__main__":
    sys.exit(main())
