#!/usr/bin/env python3
"""Measures a gateway to many devices that nobody uses: fleet.py --report FILE [--devices N]

Ends with 1 where something is missed. Builds are those of RR_BUILD, build/release where it is not set.
"""
import argparse
import json
import pathlib
import sys
import tempfile
import time

from load import cpu_seconds, resident_bytes, running
from rows import Row, publish

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))

import gateways  # noqa: E402
from http_api import fetch  # noqa: E402
from processes import BUILD, Background  # noqa: E402

IDLE_SECONDS = 30
OFFLINE_SECONDS = 60


class Fleet:
    """So many devices in one process."""

    def __init__(self, folder, count):
        program = BUILD / "examples" / "demo" / "rrgate-demo-fleet"
        self.process = Background([program, *["--port", 0] * count], folder / "fleet.log")
        self.urls = [self.process.next_line(60) for _ in range(count)]
        self.pid = self.process.process.pid

    def devices(self, **options):
        return [{"name": f"sensor-{number}", "url": url, **options} for number, url in enumerate(self.urls, 1)]

    def stop(self):
        self.process.stop()


class Gateway(gateways.Gateway):
    def __init__(self, folder, devices):
        super().__init__(folder, {"devices": devices, "log": {"format": "json", "level": "warning"}})
        self.pid = self.process.process.pid

    def wait_until_ready(self):
        self.process.wait_until(self._answers)

    def _answers(self):
        try:
            return fetch(self.port, "/healthz")[0] == 200
        except OSError:
            return False

    def wait_for_online(self, is_wanted, within):
        """Until as many devices are online as wanted. Returns how long it took, in s."""
        begin = time.monotonic()
        while not is_wanted(online := json.loads(fetch(self.port, "/readyz")[2])["devices_online"]):
            if time.monotonic() - begin > within:
                raise SystemExit(f"{online} devices online after {within} s")
            time.sleep(0.1)
        return time.monotonic() - begin

    def stop(self):
        self.process.stop()


def share_of_a_core(pid, seconds):
    begin, before = time.monotonic(), cpu_seconds(pid)
    time.sleep(seconds)
    return (cpu_seconds(pid) - before) / (time.monotonic() - begin)


def resident_when_idle(folder, devices):
    """Of a gateway to devices that have been found, and their sessions rest."""
    folder.mkdir()
    with running(Gateway(folder, devices)) as gateway:
        gateway.wait_until_ready()
        gateway.wait_for_online(lambda online: online == len(devices), 120)
        time.sleep(IDLE_SECONDS)
        return resident_bytes(gateway.pid)


def measure(folder, count):
    with running(Fleet(folder, count)) as fleet:
        begin = time.monotonic()
        with running(Gateway(folder, fleet.devices())) as gateway:
            gateway.wait_for_online(lambda online: online == count, 120)
            online = time.monotonic() - begin
            idle = share_of_a_core(gateway.pid, IDLE_SECONDS)
            relayed = resident_bytes(gateway.pid)
            shared = resident_when_idle(folder / "shared", fleet.devices(mode="shared"))
            fleet.stop()
            offline = gateway.wait_for_online(lambda online: online == 0, 600)
    empty = resident_when_idle(folder / "none", [])
    yield Row(f"{count} devices: until all are online", online, None, "s", promise=60)
    yield Row("memory of the gateway for each, relayed", (relayed - empty) / count / 1e3, None, "kB", promise=20)
    yield Row("memory of the gateway for each, shared", (shared - empty) / count / 1e3, None, "kB", promise=20)
    yield Row("CPU while nobody uses them", idle * 100, None, "% of a core", promise=5)
    yield Row("until all are seen as offline", offline, None, "s", promise=OFFLINE_SECONDS)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", type=pathlib.Path, required=True)
    parser.add_argument("--devices", type=int, default=5000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        return publish(arguments.report, "Fleet", "fleet", measure(pathlib.Path(scratch), arguments.devices))


if __name__ == "__main__":
    sys.exit(main())
