"""Machines of a network of our own: a network namespace each, joined by a bridge. Needs root and the right to make them."""
import concurrent.futures
import contextlib
import ctypes
import os
import subprocess
import time

from machine import need
from processes import read_json

ADDRESS_DEADLINE = 15.0  # seconds until the system has checked the link-local addresses for duplicates


def run(*command, timeout=30):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=timeout, check=False)


class Network:
    """Hosts are numbered from 0. Each has one interface, eth0, with 10.77.0.<number + 1> and a link-local address."""

    def __init__(self, size):
        need("network")
        self._names = [f"rrgate-{os.getpid()}-{name}" for name in ("hub", *range(size))]
        try:
            for name in self._names:
                self._ip("netns", "add", name)
            self._ip("-n", self._names[0], "link", "add", "br0", "type", "bridge", "forward_delay", "0")
            self._ip("-n", self._names[0], "link", "set", "br0", "up")
            for number, name in enumerate(self._names[1:]):
                self._ip("-n", self._names[0], "link", "add", f"port{number}", "type", "veth", "peer", "name", "eth0", "netns", name)
                self._ip("-n", self._names[0], "link", "set", f"port{number}", "master", "br0", "up")
                self._ip("-n", name, "link", "set", "lo", "up")
                self._ip("-n", name, "addr", "add", f"10.77.0.{number + 1}/24", "broadcast", "10.77.0.255", "dev", "eth0")
                self._ip("-n", name, "link", "set", "eth0", "up")
                self._ip("-n", name, "route", "add", "default", "dev", "eth0")  # the reference sends to 255.255.255.255
            self._wait_for_addresses()
        except BaseException:
            self.close()
            raise

    def _ip(self, *words):
        done = run("ip", *words)
        assert done.returncode == 0, f"ip {' '.join(words)}: {done.stderr.strip()}"
        return done.stdout

    def _wait_for_addresses(self):
        deadline = time.monotonic() + ADDRESS_DEADLINE
        for name in self._names[1:]:
            while "fe80" not in (addresses := self._ip("-n", name, "-6", "addr", "show", "dev", "eth0")) or "tentative" in addresses:
                assert time.monotonic() < deadline, f"no IPv6 link-local address after {ADDRESS_DEADLINE} s: {addresses}"
                time.sleep(0.1)

    def on(self, host, *command):
        """The command that runs `command` on a host."""
        return ["nsenter", f"--net=/run/netns/{self._names[host + 1]}", *command]

    def get_json(self, host, url):
        """What an HTTP server says to one who runs on the host; None where it cannot be reached."""
        return self.call(host, lambda: read_json(url))

    def call(self, host, function):
        """function() by a thread that is on the host; sockets that it makes stay there."""
        def enter_and_call():
            with open(f"/run/netns/{self._names[host + 1]}") as namespace:
                if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), 0) != 0:
                    raise OSError(ctypes.get_errno(), "setns")
            return function()

        with concurrent.futures.ThreadPoolExecutor(1) as thread:
            return thread.submit(enter_and_call).result()

    def link_local(self, host):
        """Its IPv6 address on the link, without the zone."""
        return self._ip("-n", self._names[host + 1], "-6", "-o", "addr", "show", "dev", "eth0", "scope", "link").split()[3].split("/")[0]

    @contextlib.contextmanager
    def without_ipv6(self, host):
        """The host's interface has none meanwhile: its packets are too short for it."""
        self._ip("-n", self._names[host + 1], "link", "set", "eth0", "mtu", "1200")
        try:
            yield
        finally:
            self._ip("-n", self._names[host + 1], "link", "set", "eth0", "mtu", "1500")
            self._wait_for_addresses()

    def pull_cable(self, host):
        self._ip("-n", self._names[host + 1], "link", "set", "eth0", "down")

    def plug_in(self, host):
        self._ip("-n", self._names[host + 1], "link", "set", "eth0", "up")

    @contextlib.contextmanager
    def losing_packets(self, host, nth):
        """Every `nth` of the TCP segments that the host sends. Gives a function that says how many were lost so far."""
        need("packet-loss")
        rule = ["-p", "tcp", "-m", "statistic", "--mode", "nth", "--every", str(nth), "--packet", str(nth // 2), "-j", "DROP"]
        done = run(*self.on(host, "iptables", "-A", "OUTPUT", *rule))
        assert done.returncode == 0, done.stderr
        try:
            yield lambda: int(run(*self.on(host, "iptables", "-nvxL", "OUTPUT")).stdout.splitlines()[2].split()[0])
        finally:
            run(*self.on(host, "iptables", "-D", "OUTPUT", *rule))

    def close(self):
        for name in self._names:
            run("ip", "netns", "delete", name)
