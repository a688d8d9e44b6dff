"""Chaos around a gateway, by a seed: devices, the gateway, the nginx before it and clients are killed, stopped and started again,
lines are cut, stalled and slowed, descriptors run out, the disk of the audit log fills, nobody reads the log, and the clock is set
back and forth. Clients work all the while, and what must hold is judged:

    chaos.py --minutes N [--seed S]

No packet of a pipe is lost or comes twice within a session, no event either; no call runs twice, and what was answered has run; a
lock is held by one; who is inside, at a device that no fault is for, is answered within two seconds; when the faults have ended, wires
have the last value, each value of a wire is accounted for with each client that follows it by Robot Raconteur, and the gateway's memory
and descriptors are what they were. Ends with 1 where something did not hold. The seed makes the order of faults and their lengths.
"""
import argparse
import collections
import contextlib
import itertools
import json
import os
import pathlib
import random
import resource
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

from chaos_clients import Caller, Findings, Insider, Listener, Locker, OurPiper, Piper, Program, Publisher, Tokens, Watcher
from directions import PEERS
from gateways import RRGATE, read_metrics
from http_api import ask, fetch
from processes import Background, free_port
from reverse_proxies import ReverseProxy
from shared_sites import start_service

ROUND = 60.0  # seconds of faults, behind which everything is judged
PATIENCE = 30.0  # seconds until all is well again
FAKETIME = pathlib.Path("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1")
MORE_MEMORY = 48_000_000  # bytes that a gateway may keep of what was
MORE_DESCRIPTORS = 8


class Line:
    """A TCP forwarder that can be cut, stalled and slowed."""

    def __init__(self, target):
        """`target`: gives the port."""
        self._target = target
        self._sockets = set()
        self._flowing = threading.Event()
        self._flowing.set()
        self.pause = 0.0  # seconds before each piece
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=128)
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            try:
                server = socket.create_connection(("127.0.0.1", self._target()), 5)
                server.settimeout(None)
            except OSError:
                client.close()
                continue
            self._sockets |= {client, server}
            for ends in ((client, server), (server, client)):
                threading.Thread(target=self._forward, args=ends, daemon=True).start()

    def _forward(self, source, sink):
        try:
            while data := source.recv(4096 if self.pause else 65536):
                self._flowing.wait()
                time.sleep(self.pause)
                sink.sendall(data)
        except OSError:
            pass
        finally:
            self._end(source, sink)

    def _end(self, *sockets):
        for each in sockets:
            self._sockets.discard(each)
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)

    def cut(self, dice):
        """Some of the connections are reset."""
        for each in list(self._sockets):
            if dice.random() < 0.7:
                with contextlib.suppress(OSError):
                    each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                self._end(each)

    def stall(self):
        self._flowing.clear()

    def flow(self):
        self._flowing.set()
        self.pause = 0.0

    def close(self):
        self.flow()
        self._listener.close()
        self._end(*list(self._sockets))


class Device:
    """Of the reference, on another port in each of its lives: it does not listen on one that was closed a minute ago."""

    def __init__(self, folder):
        self._folder = folder
        self.journal = folder / "journal"
        self.start()

    def start(self):
        self.port = free_port()
        self.process = Background([sys.executable, PEERS / "chaos_device.py", self.journal, f"--robotraconteur-tcp-port={self.port}"],
                                  self._folder / "device.log")
        self.process.next_line()

    def kill(self):
        self.process.process.kill()
        self.process.process.wait()


class Proxy:
    """An nginx before the gateway, by way of the sample configuration."""

    def __init__(self, folder, gateway):
        self._folder, self._gateway = folder, gateway
        self.start()

    def start(self):
        self._nginx = ReverseProxy("nginx", "nginx.conf", self._folder, self._gateway.port)

    @property
    def port(self):
        return self._nginx.root

    @property
    def pid(self):
        return self._nginx.pid

    def kill(self):
        os.killpg(self.pid, signal.SIGKILL)
        self._nginx.stop()


class Gateway:
    """With its log on a pipe, which somebody reads unless he is told to rest."""

    def __init__(self, folder, devices, clock):
        self.port, self._folder = free_port(), folder
        self._command = ["env", "--ignore-signal=XFSZ"]
        if clock:
            self._command += [f"LD_PRELOAD={FAKETIME}", f"FAKETIME_TIMESTAMP_FILE={clock}", "FAKETIME_DONT_FAKE_MONOTONIC=1",
                              "FAKETIME_CACHE_DURATION=1"]
        self.audit = folder / "audit"
        self._file = folder / "gateway.json"
        self._file.write_text(json.dumps({
            "listen": [f"127.0.0.1:{self.port}"], "devices": devices, "audit": {"file": str(self.audit)},
            "trusted_proxies": ["127.0.0.1"],
            "retry": {"min_ms": 50, "max_ms": 500}, "timeouts": {"unused_session_ms": 1000}, "log": {"level": "debug"},
        }))
        self._reading = threading.Event()
        self._reading.set()
        self.start()

    def start(self):
        self.process = subprocess.Popen([*self._command, RRGATE, "serve", "--config", self._file], stderr=subprocess.PIPE,
                                        start_new_session=True)
        threading.Thread(target=self._read, args=(self.process.stderr,), daemon=True).start()
        wait_until(lambda: self.is_up() or self.process.poll() is not None, "the gateway listens")

    def _read(self, log):
        with open(self._folder / "gateway.log", "ab") as copy:
            while line := log.readline():
                self._reading.wait()
                copy.write(line)
                copy.flush()

    def rest(self, is_resting):
        self._reading.clear() if is_resting else self._reading.set()

    def is_up(self):
        try:
            return fetch(self.port, "/healthz")[0] == 200
        except OSError:
            return False

    def metrics(self):
        return read_metrics(fetch(self.port, "/metrics")[2].decode())

    def limit(self, what, most):
        resource.prlimit(self.process.pid, what, (most, resource.RLIM_INFINITY if what == resource.RLIMIT_FSIZE else 4096))

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def kill(self):
        self.process.kill()
        self.process.wait()

    def stop(self):
        self.process.terminate()
        try:
            return self.process.wait(15)
        except subprocess.TimeoutExpired:
            self.kill()
            return None


def ran(journal):
    """Tokens of the calls that a device has run."""
    return [int(line) for line in journal.read_text().split()] if journal.exists() else []


def faults_of_calls(ran, answered):
    twice = [token for token, count in collections.Counter(ran).items() if count > 1]
    missing = sorted(answered - set(ran))
    return [f"{what}: {tokens[:5]}" for what, tokens in (("ran twice", twice), ("were answered and never ran", missing)) if tokens]


def wait_until(is_so, what):
    deadline = time.monotonic() + PATIENCE
    while not is_so():
        if time.monotonic() > deadline:
            raise AssertionError(f"after {PATIENCE:.0f} s it isn't so that {what}")
        time.sleep(0.05)


class Site:
    base = "/api/v1/devices/shared/chaos"

    def __init__(self, folder):
        self.folder = folder
        self.findings, self.tokens = Findings(), Tokens()
        self.device = Device(folder)
        self.ours, url = start_service(folder)
        self.line = Line(lambda: self.device.port)
        self.clock = folder / "clock" if FAKETIME.exists() else None
        if self.clock:
            self.clock.write_text("+0")
        through = f"rr+tcp://127.0.0.1:{self.line.port}/?service=chaos"
        self.gateway = Gateway(folder, [
            {"name": "shared", "url": through, "mode": "shared", "login": {"username": "gateway", "password": "secret"}},
            {"name": "relayed", "url": through}, {"name": "ours", "url": url, "mode": "shared"}], self.clock)
        self.proxy = Proxy(folder, self.gateway)
        self.front = Line(lambda: self.proxy.port)
        self.native = Line(lambda: self.gateway.port)
        self.clients = []
        self.is_recovering = True  # until a gateway that has come back has answered
        self.away = None  # when the gateway was away last: (since, until), None for until: it is
        self.slowest = 0.0

    @contextlib.contextmanager
    def gateway_away(self):
        begin = time.monotonic()
        self.away, self.is_recovering = (begin, None), True
        try:
            yield
        finally:
            self.away, self.is_recovering = (begin, time.monotonic()), True

    def was_away_since(self, moment):
        return self.away is not None and (self.away[1] is None or self.away[1] >= moment)

    @property
    def port(self):
        return self.gateway.port

    def is_online(self):
        try:
            answer = ask(self.port, "GET", "/api/v1/devices")
            return answer.status == 200 and all(device["state"] == "online" for device in answer.json["devices"])
        except OSError:
            return False

    def publish(self, value):
        try:
            return ask(self.port, "POST", f"{self.base}/publish", {"value": value}).status in (200, 204)
        except OSError:
            return False

    def begin(self):
        wait_until(self.is_online, "all devices are online")
        native = f"rr+tcp://127.0.0.1:{self.native.port}/?nodename=%s&service=chaos"
        websocket = f"rr+ws://127.0.0.1:{self.front.port}/devices/%s?service=chaos"
        self.programs = [Program("native", self, native % "shared"), Program("websocket", self, websocket % "shared"),
                         Program("relayed", self, websocket % "relayed")]
        self.publisher = Publisher("Publisher", self)
        self.insider = Insider("Insider", self)
        self.clients = [self.publisher, self.insider, *self.programs, *(kind(f"{kind.__name__}{number}", self) for number in (1, 2)
                                          for kind in (Caller, Listener, Watcher, Piper, OurPiper, Locker))]

    def end(self):
        for client in self.clients:
            client.is_wanted = False
        for client in self.clients:
            client.stop()
        self.clients = []

    def rest(self):
        """(bytes, descriptors) of a gateway that nobody uses."""
        last, since = None, time.monotonic()
        deadline = since + PATIENCE
        while time.monotonic() < deadline and time.monotonic() - since < 3:
            now = self.gateway.descriptors()
            if now != last:
                last, since = now, time.monotonic()
            time.sleep(0.1)
        return self.gateway.metrics()["process_resident_memory_bytes"], last

    def judge(self, before):
        """What has to be so when the faults have ended."""
        if self.gateway.process.poll() is not None:
            self.findings.break_("gateway", f"has ended with {self.gateway.process.poll()}")
            return
        wait_until(self.is_online, "all devices are online again")
        watchers = [client.name for client in self.clients if isinstance(client, (Watcher, Program))]

        def values():
            return {name: self.findings.last_values.get(name, 0) for name in watchers}
        value = float(self.tokens.next())
        try:
            wait_until(lambda: min(values().values()) > value, "all follow the wire again")
            self.publisher.stop()
            value = float(self.tokens.next())
            wait_until(lambda: self.publish(value), "the device answers again")
            wait_until(lambda: set(values().values()) == {value}, "wires have the last value")
        except AssertionError as error:
            self.findings.break_("wires", f"{error}, {value} or newer: {values()}")
        self.judge_ledger()
        count = self.findings.counts.get("answers inside", 0)
        try:
            wait_until(lambda: self.findings.counts.get("answers inside", 0) > count, "who is inside is answered")
        except AssertionError as error:
            self.findings.break_("liveness", error)
        self.slowest = max(self.slowest, self.insider.p99())
        self.end()
        for fault in faults_of_calls(ran(self.device.journal), self.findings.answered):
            self.findings.break_("calls", fault)
        memory, descriptors = self.rest()
        if memory > before[0] + MORE_MEMORY:
            self.findings.break_("memory", f"{before[0]} bytes before, {memory} now")
        if descriptors > before[1] + MORE_DESCRIPTORS:
            names = [os.readlink(each) for each in pathlib.Path(f"/proc/{self.gateway.process.pid}/fd").iterdir()]
            self.findings.break_("descriptors", f"{before[1]} before, {descriptors} now: {names}")
        used = self.gateway.metrics()["rrgate_memory_budget_used_bytes"]
        if used > 1_000_000:  # events are kept
            self.findings.break_("budget", f"{used} bytes are still in use")

    def judge_ledger(self, values=20):
        """Each value of the wire was delivered to each of its clients by Robot Raconteur, replaced by a newer one, or lost, and the
        ledger knows which."""
        followers = sum(client.name in ("native", "websocket") for client in self.clients)

        def accounted():
            metrics = self.gateway.metrics()
            return sum(metrics[f'rrgate_subscription_{fate}_total{{device="shared",kind="wire"}}']
                       for fate in ("delivered", "conflated", "dropped"))
        begin = accounted()
        for _ in range(values):
            wait_until(lambda: self.publish(self.tokens.next()), "the device answers")
        try:
            wait_until(lambda: accounted() - begin >= values * followers, "the ledger has all values")
            time.sleep(0.2)
            if accounted() - begin != values * followers:
                raise AssertionError("the ledger has more than all")
        except AssertionError as error:
            self.findings.break_("ledger", f"{error}: {accounted() - begin} of {values} values for {followers} followers")

    def close(self):
        self.end()
        code = self.gateway.stop()
        for line in (self.front, self.native, self.line):
            line.close()
        self.proxy.kill()
        self.device.process.stop()
        self.ours.stop()
        if code != 0:
            self.findings.break_("gateway", f"ended with {code}")


# --- faults: each begins, goes on while its block runs, and ends ---


def killed(part):
    @contextlib.contextmanager
    def fault(site, dice):
        one = part(site, dice)
        one.kill()
        try:
            yield
        finally:
            one.start()
    return fault


def stopped(process):
    @contextlib.contextmanager
    def fault(site, dice):
        group = process(site, dice).pid
        os.killpg(group, signal.SIGSTOP)
        try:
            yield
        finally:
            os.killpg(group, signal.SIGCONT)
    return fault


def cut(line):
    @contextlib.contextmanager
    def fault(site, dice):
        one = line(site, dice)
        one.cut(dice)
        yield
        one.cut(dice)
    return fault


def stalled(line):
    @contextlib.contextmanager
    def fault(site, dice):
        one = line(site, dice)
        one.stall()
        try:
            yield
            if dice.random() < 0.5:
                one.cut(dice)
        finally:
            one.flow()
    return fault


def slowed(line):
    @contextlib.contextmanager
    def fault(site, dice):
        one = line(site, dice)
        one.pause = dice.uniform(0.001, 0.05)
        try:
            yield
        finally:
            one.flow()
    return fault


@contextlib.contextmanager
def descriptors_out(site, dice):
    gateway = site.gateway
    gateway.limit(resource.RLIMIT_NOFILE, gateway.descriptors() + dice.randrange(3))
    try:
        yield
    finally:
        gateway.limit(resource.RLIMIT_NOFILE, 4096)


@contextlib.contextmanager
def disk_full(site, dice):
    size = site.gateway.audit.stat().st_size
    site.gateway.limit(resource.RLIMIT_FSIZE, size + dice.randrange(100))
    try:
        yield
    finally:
        site.gateway.limit(resource.RLIMIT_FSIZE, resource.RLIM_INFINITY)


@contextlib.contextmanager
def log_unread(site, dice):
    site.gateway.rest(True)
    try:
        yield
    finally:
        site.gateway.rest(False)


@contextlib.contextmanager
def clock_set(site, dice):
    site.clock.write_text(f"{dice.choice('+-')}{dice.randrange(2, 7200)}s")
    try:
        yield
    finally:
        site.clock.write_text("+0")


FAULTS = {
    "device killed": killed(lambda site, dice: site.device),
    "device stopped": stopped(lambda site, dice: site.device.process.process),
    "client killed": killed(lambda site, dice: dice.choice(site.programs)),
    "client stopped": stopped(lambda site, dice: dice.choice(site.programs).process.process),
    "gateway killed": killed(lambda site, dice: site.gateway),
    "gateway stopped": stopped(lambda site, dice: site.gateway.process),
    "proxy killed": killed(lambda site, dice: site.proxy),
    "proxy stopped": stopped(lambda site, dice: site.proxy),
    "line to the device cut": cut(lambda site, dice: site.line),
    "line to the device stalled": stalled(lambda site, dice: site.line),
    "line to the device slowed": slowed(lambda site, dice: site.line),
    "line to clients cut": cut(lambda site, dice: dice.choice((site.front, site.native))),
    "line to clients stalled": stalled(lambda site, dice: dice.choice((site.front, site.native))),
    "line to clients slowed": slowed(lambda site, dice: dice.choice((site.front, site.native))),
    "descriptors out": descriptors_out,
    "disk full": disk_full,
    "log unread": log_unread,
    "clock set": clock_set,
}


def possible_faults():
    """(those that this machine can have, why not the others)"""
    if FAKETIME.exists():
        return list(FAULTS), ""
    return [name for name in FAULTS if name != "clock set"], "no fault 'clock set': there is no libfaketime (package faketime)"


def play(site, dice, seconds, say=print):
    """One round of faults, then the judgement."""
    site.begin()
    time.sleep(2)
    site.end()
    before = site.rest()
    site.begin()
    names, _ = possible_faults()
    # A gateway that is killed every few seconds shows little else.
    weights = [0.3 if name == "gateway killed" else 1.0 for name in names]
    until = time.monotonic() + seconds
    started = time.monotonic()
    while time.monotonic() < until and not site.findings.broken:
        name = dice.choices(names, weights)[0]
        length, after = dice.choice((0.05, 0.3, 1.0, 3.0)) * dice.random(), dice.choice((0.1, 1.0, 2.0)) * dice.random()
        say(f"{time.monotonic() - started:6.1f} s: {name}, for {length:.2f} s", flush=True)
        with site.gateway_away() if name.startswith("gateway") else contextlib.nullcontext(), FAULTS[name](site, dice):
            time.sleep(length)
        time.sleep(after)
    site.judge(before)


def seeds_of_rounds(first=None):
    """From `first` on; without it the same ones in each run, 1, 2, ..., and between them new ones."""
    if first is not None:
        yield from itertools.count(first)
    for fixed in itertools.count(1):
        yield fixed
        yield random.randrange(1 << 31)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=5)
    parser.add_argument("--seed", type=int, help="that of the first round; the next has the next one (default: 1, 2, ... and new ones in turn)")
    options = parser.parse_args()
    if reason := possible_faults()[1]:
        print(reason)
    until = time.monotonic() + 60 * options.minutes
    for seed in seeds_of_rounds(options.seed):
        print(f"chaos, --seed {seed}", flush=True)
        folder = pathlib.Path(tempfile.mkdtemp(prefix="rr-chaos-"))
        site = Site(folder)
        try:
            play(site, random.Random(seed), min(ROUND, max(5.0, until - time.monotonic())))
        finally:
            site.close()
        print(f"seed {seed}: {site.findings.counts}; p99 of answers inside: {site.slowest * 1e3:.0f} ms")
        if site.findings.broken:
            print("\n".join(site.findings.broken))
            print(f"seed {seed} FAILED; logs are in {folder}")
            return 1
        if time.monotonic() >= until:
            return 0


if __name__ == "__main__":
    sys.exit(main())
