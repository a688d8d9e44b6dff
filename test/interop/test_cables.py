"""Bad cables: the link to a device is cut and mended again and again, or slow and lossy.

Two machines of a network of our own: the device on one, the gateway and its clients on the other. Clients have quick
heartbeats, so that a cycle takes a second. RRGATE_CABLE_CYCLES=500 cuts that often, over all kinds of connection.
"""
import json
import os
import pathlib
import sys
import time

import pytest

from clients import check_all, run_program, without_expectations
from directions import PEERS
from network import Network, run
from processes import BUILD, Background, start_gateway
from scenarios import FUNCTIONS
from tls_nodes import SERVICE, environment

DEVICE, GATEWAY = 0, 1
DEVICE_ADDRESS = "10.77.0.1"
HEARTBEAT = 0.3  # seconds; the connection is given up 1.5 as much after one without an answer
NOTICED_WITHIN = 2.5 * HEARTBEAT + 3.0  # with some patience for a busy machine
MENDED_WITHIN = 15.0  # seconds until the device is reached again
CYCLES = int(os.environ.get("RRGATE_CABLE_CYCLES", 20))
GROWTH = 1024  # kB of the gateway's memory after the first third of the cycles
SITES = [("ours", "rr+tcp"), ("ours", "rr+ws"), ("ours", "rrs+tcp"), ("reference", "rr+tcp"), ("reference", "rr+ws")]

ADD = {"call": "add", "args": [{"double": 1.5}, {"double": 2.25}], "expect": 3.75}
BUSY = {"get_until": "version", "until": "for ever"}  # one call after the other


@pytest.fixture(scope="module")
def network():
    made = Network(2)
    yield made
    made.close()


class Site:
    """A device on its machine, a gateway on another."""

    def __init__(self, network, lab, folder, maker, scheme, delay=0.0):
        self.network, self.scheme = network, scheme
        self._processes = []
        program = {"reference": [sys.executable, PEERS / "service.py"], "ours": [BUILD / "test/interop/cpp/rr-test-service"]}
        secure = [f"--robotraconteur-nodeid={SERVICE}", "--robotraconteur-load-tls=true"] if scheme == "rrs+tcp" else []
        command = network.on(DEVICE, *program[maker], "--robotraconteur-tcp-listen-localhost=false",
                             "--robotraconteur-disable-stringtable=true", *secure)
        try:
            service = self._start(command, folder / "service.log", environment(lab, "good"))
            port = json.loads(service.next_line())["port"]
            if delay:
                line = self._start(network.on(DEVICE, sys.executable, PEERS / "slow_line.py", port + 1, port, delay),
                                   folder / "line.log")
                line.next_line()
                port += 1
            self.gateway, self._port = start_gateway(
                folder, f"{scheme}://{DEVICE_ADDRESS}:{port}/?service=interop", host=(network, GATEWAY),
                device={"tls": {"ca": [str(lab / "ca.pem")]}} if secure else {}, retry={"min_ms": 200, "max_ms": 400})
            self._processes.append(self.gateway)
        except BaseException:
            self.stop()
            raise

    def _start(self, *arguments):
        self._processes.append(Background(*arguments))
        return self._processes[-1]

    def stop(self):
        for process in reversed(self._processes):
            process.stop()

    def client(self, heartbeat=HEARTBEAT):
        """The command of a client that comes to the gateway as the gateway goes to the device."""
        scheme = self.scheme.replace("rrs", "rr")
        return self.network.on(GATEWAY, BUILD / "test/interop/cpp/rr-test-client",
                               f"{scheme}://127.0.0.1:{self._port}/?service=interop", f"--heartbeat-ms={int(heartbeat * 1000)}")

    def wait_for_clients(self, count):
        """Until the gateway has so many."""
        def devices():
            answer = self.network.get_json(GATEWAY, f"http://127.0.0.1:{self._port}/api/v1/devices")
            return [device["clients"] for device in answer["devices"]] if answer else None
        self.gateway.wait_until(lambda: devices() == [count])

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.gateway.process.pid}/fd"))

    def resident(self):
        """kB of memory."""
        status = pathlib.Path(f"/proc/{self.gateway.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0])


@pytest.fixture
def site(network, lab, tmp_path):
    """site(maker, scheme[, delay]): one for this test."""
    made = []

    def make(*arguments):
        made.append(Site(network, lab, tmp_path, *arguments))
        return made[-1]

    yield make
    for each in made:
        each.stop()


def start_client(site, folder, *steps, heartbeat=HEARTBEAT):
    """A client beside the test, when it is connected; the next line is what came of its steps."""
    client = Background([*site.client(heartbeat), "--tell"], folder / "client.log")
    client.write_line({"steps": without_expectations(steps)})
    client.process.stdin.close()
    assert json.loads(client.next_line()) == {"connected": True}
    return client


def cut_and_mend(site, folder):
    """Returns how long it took the client to notice, and the network to recover."""
    client = start_client(site, folder, BUSY, ADD)
    try:
        site.network.pull_cable(DEVICE)
        cut = time.monotonic()
        results = json.loads(client.next_line(NOTICED_WITHIN))["results"]
        noticed = time.monotonic() - cut
    finally:
        client.stop()
        site.network.plug_in(DEVICE)
    mended = time.monotonic()
    for result in results:  # of the call in flight, and of one that comes too late
        assert result.get("error", {}).get("name") == "RobotRaconteur.ConnectionError", results
    site.wait_for_clients(0)
    while True:
        answer = run_program(site.client(), [ADD])
        if "results" in answer or time.monotonic() > mended + MENDED_WITHIN:
            break
    check_all([ADD], answer)
    recovered = time.monotonic() - mended
    site.wait_for_clients(0)
    return noticed, recovered


@pytest.mark.parametrize("maker, scheme", SITES, ids=lambda word: word)
def test_pulled_cables(site, tmp_path, deadline, maker, scheme, record_property):
    here = site(maker, scheme)
    cut_and_mend(here, tmp_path)  # what is made once is there from now on
    cycles = max(1, CYCLES // len(SITES))
    descriptors, noticed, recovered, resident = here.descriptors(), [], [], []
    for _ in range(cycles):
        deadline()
        times = cut_and_mend(here, tmp_path)
        noticed.append(times[0])
        recovered.append(times[1])
        resident.append(here.resident())
    # A look at the device may be on its way just now.
    here.gateway.wait_until(lambda: here.descriptors() <= descriptors)
    figures = {"cycles": cycles, "descriptors": [descriptors, here.descriptors()],
               "resident kB": [resident[cycles // 3], resident[-1]],
               "noticed s": [round(min(noticed), 2), round(max(noticed), 2)],
               "recovered s": [round(min(recovered), 2), round(max(recovered), 2)]}
    print(maker, scheme, json.dumps(figures))
    record_property("cables", json.dumps(figures))
    assert resident[-1] - resident[cycles // 3] < GROWTH, figures


def test_both_ends_gone(site, network, tmp_path):
    """What vanishes with nothing on its way is noticed all the same: the kernel asks peers that say nothing."""
    here = site("ours", "rr+tcp")
    client = start_client(here, tmp_path, BUSY, heartbeat=30)
    try:
        sockets = run(*network.on(GATEWAY, "ss", "-HtnoO", "-p", "state", "established")).stdout
    finally:
        client.stop()
    mine = [line for line in sockets.splitlines() if f"pid={here.gateway.process.pid}," in line]
    assert len(mine) >= 2, sockets
    for line in mine:  # while something is on its way another timer runs
        assert "timer:(keepalive," in line or "timer:(on," in line, line


@pytest.mark.parametrize("maker, scheme", [("ours", "rr+tcp"), ("reference", "rr+ws")], ids=lambda word: word)
def test_slow_and_lossy(site, network, maker, scheme):
    """0.2 s each way; of what the device sends, every 20th segment is lost. The session lives; ours also while nothing is said."""
    steps = [*FUNCTIONS.steps[:4], ADD]
    if maker == "ours":
        silence = {"events": "cleared", "count": 1, "expect": {"list": []}}  # none comes in 10 s
        steps += [{"listen": "cleared", "expect": None}, silence, ADD]
    with network.losing_packets(DEVICE, 20) as lost:
        here = site(maker, scheme, 0.2)
        started = time.monotonic()
        check_all(steps, run_program(here.client(heartbeat=2), steps))
        assert time.monotonic() - started > 0.4 * len(steps)
        here.wait_for_clients(0)
        assert lost() > 0
