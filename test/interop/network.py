"""Machines of a network of our own: a network namespace each, joined by a bridge. Needs root and the right to make them."""
import contextlib
import json
import os
import subprocess
import sys
import time

import pytest

ADDRESS_DEADLINE = 15.0  # seconds until the system has checked the link-local addresses for duplicates


def run(*command, timeout=30):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=timeout, check=False)


class Network:
    """Hosts are numbered from 0. Each has one interface, eth0, with 10.77.0.<number + 1> and a link-local address."""

    def __init__(self, size):
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
            self._check_entering()
        except BaseException:
            self.close()
            raise

    def _ip(self, *words):
        try:
            done = run("ip", *words)
        except OSError as error:
            pytest.skip(f"network namespaces are not available here: ip: {error}")
        if done.returncode != 0:
            pytest.skip(f"network namespaces are not available here: ip {' '.join(words)}: {done.stderr.strip()}")
        return done.stdout

    def _wait_for_addresses(self):
        deadline = time.monotonic() + ADDRESS_DEADLINE
        for name in self._names[1:]:
            while "fe80" not in (addresses := self._ip("-n", name, "-6", "addr", "show", "dev", "eth0")) or "tentative" in addresses:
                if time.monotonic() > deadline:
                    pytest.skip(f"no IPv6 link-local address in a network namespace after {ADDRESS_DEADLINE} s")
                time.sleep(0.1)

    def _check_entering(self):
        done = run(*self.on(0, "true"))
        if done.returncode != 0:
            pytest.skip(f"network namespaces are not available here: nsenter: {done.stderr.strip()}")

    def on(self, host, *command):
        """The command that runs `command` on a host."""
        return ["nsenter", f"--net=/run/netns/{self._names[host + 1]}", *command]

    def get_json(self, host, url):
        """What an HTTP server says to one who runs on the host; None where it cannot be reached."""
        done = run(*self.on(host, sys.executable, "-c",
                            f"import urllib.request as r; print(r.urlopen({url!r}, timeout=5).read().decode())"))
        return json.loads(done.stdout) if done.returncode == 0 else None

    def close(self):
        for name in self._names:
            with contextlib.suppress(OSError):  # no ip here: nothing was made
                run("ip", "netns", "delete", name)
