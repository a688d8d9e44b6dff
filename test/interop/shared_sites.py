"""A device behind a gateway that shares it, and clients of both."""
import json
import sys

import pytest
import RobotRaconteur as RR

from directions import DIRECTIONS, LEVELS, PEERS, service_command
from processes import Background, start_gateway
from tap import Tap

OURS = next(each for each in DIRECTIONS if each.name == "reference-to-ours")
RETRY = {"min_ms": 50, "max_ms": 200}


def is_refused(error, action):
    """Whether the action fails with that error, and nothing else."""
    try:
        action()
        return False
    except error:
        return True


def start_arm(folder, *options):
    device = Background([sys.executable, PEERS / "arm.py", *options], folder / "device.log")
    return device, json.loads(device.next_line())["url"]


def start_arm_v2(folder):
    """Its messages have all names in them."""
    return start_arm(folder, *LEVELS["v2"])


def port_of(url):
    return int(url.split(":")[2].split("/")[0])


def start_service(folder, *options):
    """The test service, as ours is."""
    service = Background([*service_command(OURS, "v4", "http://localhost"), *options], folder / "service.log")
    return service, json.loads(service.next_line())["url"]


class Site:
    """A device behind a gateway that shares it; there is a line between them that can be cut."""

    def __init__(self, folder, node, device={}, start_device=start_arm, make_line=Tap, **config):
        self.folder = folder
        self.node = node
        self.start_device = start_device
        self.device, self.url = start_device(folder)
        self.line = make_line(port_of(self.url))
        self.roots = []
        url = self.url.replace(f":{port_of(self.url)}/", f":{self.line.port}/")
        try:
            self.gateway, self.port = start_gateway(folder, url, device={"mode": "shared", **device}, retry=RETRY, **config)
        except BaseException:
            self.device.stop()
            raise

    def connect(self, service="guarded", *login):
        if login:
            login = (login[0], {"password": RR.VarValue("secret", "string")})
        root = self.node.ConnectService(f"rr+tcp://127.0.0.1:{self.port}/?nodename=interop&service={service}", *login)
        self.roots.append(root)
        return root

    def direct(self, service="guarded", *login):
        """A client that comes by no gateway."""
        if login:
            login = (login[0], {"password": RR.VarValue("secret", "string")})
        root = self.node.ConnectService(self.url.split("?")[0] + f"?service={service}", *login)
        self.roots.append(root)
        return root

    def leave(self, root):
        self.roots.remove(root)
        self.node.DisconnectService(root)

    def restart_device(self, root):
        """Returns once `root` is served again."""
        self.device.stop()
        # What is on its way at that moment hears why it has no answer, what comes later that there is no connection.
        with pytest.raises(RR.ConnectionException, match="connection_lost|the peer closed the connection"):
            while True:
                root.status
        self.start_again()
        self.wait_until_served(root)

    def start_again(self):
        self.device, self.url = self.start_device(self.folder)
        self.line.lead_to(port_of(self.url))

    def wait_until_served(self, root):
        self.gateway.wait_until(lambda: not is_refused(RR.ConnectionException, lambda: root.status))

    def stop(self):
        for root in self.roots:
            self.node.DisconnectService(root)
        self.gateway.stop()
        self.line.close()
        self.device.stop()
