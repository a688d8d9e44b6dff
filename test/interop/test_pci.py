"""Devices with a kernel driver: rr+pci by the reference's client, by ours and through the gateway.

Where programs look for such devices, /sys/class and /dev, is made in a mount namespace: a class folder and, for the
character device, a pseudo-terminal whose other end leads to a service. Needs root and the right to make namespaces.
"""
import json
import sys

import pytest

from clients import check_all, run_program
from directions import LEVELS, PEERS
from machine import need
from processes import BUILD, Background, start_gateway
from scenarios import FUNCTIONS

URL = "rr+pci:///?nodename=interop.service&service=interop"
CLIENTS = {"reference": [sys.executable, PEERS / "client.py", URL, "--robotraconteur-hardware-enable=true"],
           "ours": [BUILD / "test/interop/cpp/rr-test-client", URL]}
NAME = "full"  # of the device; /dev/full is there, nobody needs it, and a mount can cover it


class Machine:
    """Sees a device that leads to the service at `port`."""

    def __init__(self, folder, port):
        self._folder = folder / "class"
        device = self._folder / NAME
        device.mkdir(parents=True)
        (device / "transport").write_text("pci")
        (device / "nodename").write_text("interop.service")
        self._driver = Background([sys.executable, PEERS / "driver_device.py", port], folder / "driver.log")
        self._terminal = self._driver.next_line()

    def on(self, *command):
        """The command that runs `command` where the device is."""
        script = ('mount -t tmpfs class /sys/class && cp -r "$1" /sys/class/robotraconteur && mount --bind "$2" "/dev/$3" '
                  '&& shift 3 && exec "$@"')
        return ["unshare", "-m", "--propagation", "private", "sh", "-c", script, "sh", self._folder, self._terminal, NAME, *command]

    def wait_until_closed(self):
        assert self._driver.next_line() == "closed"

    def stop(self):
        self._driver.stop()


@pytest.fixture(params=["reference", "ours"])
def machine(request, tmp_path):
    """(who made the service, machine with the device)."""
    need("mount-namespaces")
    program = {"reference": [sys.executable, PEERS / "service.py"], "ours": [BUILD / "test/interop/cpp/rr-test-service"]}
    service = Background([*program[request.param], *LEVELS["v4"]], tmp_path / "service.log")
    made = None
    try:
        made = Machine(tmp_path, json.loads(service.next_line())["port"])
        yield request.param, made
    finally:
        if made:
            made.stop()
        service.stop()


@pytest.mark.parametrize("client", CLIENTS)
def test_direct(machine, client, carries):
    maker, computer = machine
    carries(client, maker, "rr+pci")
    check_all(FUNCTIONS.steps, run_program(computer.on(*CLIENTS[client]), FUNCTIONS.steps))


def test_through_the_gateway(machine, tmp_path, carries):
    maker, computer = machine
    gateway, port = start_gateway(tmp_path, URL, on=computer.on)
    try:
        computer.wait_until_closed()  # the gateway has had its look at the service
        carries("ours", maker, "rr+tcp", "rr+pci")
        client = [BUILD / "test/interop/cpp/rr-test-client", f"rr+tcp://127.0.0.1:{port}/?service=interop"]
        check_all(FUNCTIONS.steps, run_program(client, FUNCTIONS.steps))
    finally:
        gateway.stop()
