"""The load programs as processes, and what the kernel knows of them. For measure.py and test/interop/test_shared_load.py."""
import contextlib
import json
import os
import pathlib
import re
import signal
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))

import gateways  # noqa: E402
from processes import BUILD, Background  # noqa: E402

PROGRAMS = BUILD / "test" / "load"
NEVER_MS = 3_600_000  # looks at the device are connections too


class Device:
    """A device with a wire, `rate` values a second, a pipe, `packet_rate` packets of `packet_bytes` a second, and an event."""

    def __init__(self, folder, rate=100, packet_rate=0, packet_bytes=16384, event_rate=0):
        self.process = Background([PROGRAMS / "load_device", "--rate", rate, "--packet-rate", packet_rate,
                                   "--packet-bytes", packet_bytes, "--event-rate", event_rate], folder / "device.log")
        ready = json.loads(self.process.next_line())
        self.url, self.port, self.pid = ready["url"], ready["port"], self.process.process.pid

    def cpu_seconds(self):
        return cpu_seconds(self.pid)

    def connections(self):
        """How many clients are connected now, whatever for."""
        return connections_to(self.pid, self.port)

    def stop(self):
        self.process.stop()


class Gateway(gateways.Gateway):
    """A gateway to one device, "load", that can be killed and started again on the same port."""

    def __init__(self, folder, device_url, device={}, **more):
        super().__init__(folder, {
            "devices": [{"name": "load", "url": device_url, **device}],
            "limits": {"clients": 10000, "clients_per_address": 10000, **more.pop("limits", {})},
            "retry": {"online_ms": NEVER_MS},
            **more,
        })

    def wait_until_ready(self):
        self.wait_for("device online", device="load")
        self.pid = self.process.process.pid

    def kill(self):
        """As the kernel does it: nobody is told."""
        self.process.process.send_signal(signal.SIGKILL)
        self.process.stop()

    def url(self, scheme="rr+tcp"):
        if scheme == "rr+tcp":
            return f"rr+tcp://127.0.0.1:{self.port}/?service=Load"
        return f"{scheme}://127.0.0.1:{self.port}/devices/load?service=Load"

    def resident_bytes(self):
        return resident_bytes(self.pid)

    def cpu_seconds(self):
        return cpu_seconds(self.pid)

    def open_files(self):
        return len(os.listdir(f"/proc/{self.pid}/fd"))

    def stop(self):
        self.process.stop()


class Clients:
    """A process with many clients; begins at once."""

    def __init__(self, folder, url, clients, *options, name="clients", wire="state", pipe="", event=""):
        command = [PROGRAMS / "load_clients", "--url", url, "--clients", clients, "--wire", wire, "--pipe", pipe,
                   "--event", event, *options]
        self.process = Background(command, folder / f"{name}.log")

    def wait_until_ready(self, within=60.0):
        """{"ready": how many, "seconds": since they began, or since the first was lost, "failed": {reason: count}}."""
        answer = json.loads(self.process.next_line(within))
        assert answer["event"] == "ready", answer
        return answer

    def report(self, within=60.0):
        """What they noticed, as load_clients.cpp has it; waits for those with --seconds."""
        answer = json.loads(self.process.next_line(within))
        while answer["event"] != "end":
            answer = json.loads(self.process.next_line(within))
        return answer

    def resume(self):
        """The stalled ones read on. Returns the reason by which the first of them is lost."""
        self.process.process.send_signal(signal.SIGUSR1)
        answer = json.loads(self.process.next_line())
        assert answer["event"] == "stalled_lost", answer
        return answer["reason"]

    def finish(self):
        """Ends them. Returns the report."""
        self.process.process.send_signal(signal.SIGTERM)
        return self.report()

    def stop(self):
        self.process.stop()


@contextlib.contextmanager
def running(process):
    try:
        yield process
    finally:
        process.stop()


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_bytes(pid):
    return int(re.search(r"VmRSS:\s+(\d+) kB", pathlib.Path(f"/proc/{pid}/status").read_text())[1]) * 1024


def connections_to(pid, port):
    """Connections that a process has accepted on a port of 127.0.0.1."""
    established = set()
    for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]:
        _, local, _, state, *_, = line.split()
        if state == "01" and int(local.rsplit(":", 1)[1], 16) == port:
            established.add(f"socket:[{line.split()[9]}]")
    count = 0
    for file in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):
            count += os.readlink(file) in established
    return count
