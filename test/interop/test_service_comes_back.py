"""A device that has just begun lists its service late: who has waited for the service through the gateway goes on when it is there.
The device is of the real package."""
import contextlib
import http.client
import threading
import time

import pytest
import RobotRaconteur as RR

from gateways import Gateway
from http_api import Stream, ask
from json_sockets import Socket
from processes import free_port, start_gateway

DEFINITION = """service experimental.gauge
stdver 0.10
object Gauge
    property double level
    wire double measured [readonly]
    wire double wanted [writeonly]
end
"""
DEVICE = "/api/v1/devices/interop"


class Gauge:
    level = 1.5


class Node:
    """A node whose service comes and goes, while the node stays."""

    def __init__(self):
        self.port = free_port()
        self.node = RR.RobotRaconteurNode()
        self.node.Init()
        transport = RR.TcpTransport(self.node)
        transport.StartServer(self.port)
        self.node.RegisterTransport(transport)
        self.node.RegisterServiceType(DEFINITION)

    def begin(self):
        self.gauge = Gauge()
        self.node.RegisterService("gauge", "experimental.gauge.Gauge", self.gauge)

    def end(self):
        self.node.CloseService("gauge")


@pytest.fixture
def site(tmp_path):
    node = Node()
    node.begin()
    gateway, port = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{node.port}/", device={"mode": "shared"}, mcp={},
                                  recordings={"folder": str(tmp_path / "recordings")},
                                  retry={"min_ms": 100, "max_ms": 300, "online_ms": 200})
    yield node, port
    gateway.stop()
    node.node.Shutdown()


def wait_for(is_so):
    deadline = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def services(port):
    [device] = ask(port, "GET", "/api/v1/devices").json["devices"]
    return [each["name"] for each in device["services"] or []]


def come_and_go(node, port):
    """Lost, listed no more, and back."""
    node.end()
    wait_for(lambda: "gauge" not in services(port))
    node.begin()
    wait_for(lambda: "gauge" in services(port))


def hear(stream, node, value):
    """The stream has it in the end; the device says it until then."""
    over = threading.Event()

    def measure():
        while not over.wait(0.02):
            node.gauge.measured.OutValue = value

    thread = threading.Thread(target=measure)
    thread.start()
    try:
        while stream.next()[1:] != (None, value):
            pass
    finally:
        over.set()
        thread.join()


def test_streams_sockets_and_recordings_go_on(site):
    node, port = site
    wait_for(lambda: "gauge" in services(port))
    stream = Stream(port, "/gauge/measured", base=DEVICE)
    recording = ask(port, "POST", "/api/v1/recordings", {"device": "interop", "service": "gauge", "interval_ms": 100}).json
    recorded = lambda: ask(port, "GET", f"/api/v1/recordings/{recording['name']}").json
    with contextlib.closing(stream), Socket(port, DEVICE + "/gauge") as page:
        page.ask("send", "wanted", value=1)  # from now on it is a client of its own
        hear(stream, node, 1.0)
        wait_for(lambda: recorded()["messages"] > 2)
        come_and_go(node, port)
        hear(stream, node, 7.0)
        wait_for(lambda: page.next(id=page.send("get", "level")).get("result") == 1.5)
        before = recorded()["messages"]
        wait_for(lambda: recorded()["messages"] > before + 3)
        assert recorded()["state"] == "recording"


def test_nothing_is_kept_of_a_service_that_nobody_waits_for(site):
    node, port = site
    wait_for(lambda: "gauge" in services(port))
    node.end()
    wait_for(lambda: "gauge" not in services(port))
    assert ask(port, "GET", "/gauge/level", base=DEVICE).status == 404
    node.begin()
    wait_for(lambda: ask(port, "GET", "/gauge/level", base=DEVICE).status == 200)


def test_who_waits_for_a_device_is_answered_when_the_configuration_loses_it(own_service, tmp_path):
    device, url = own_service
    config = {"devices": [{"name": "interop", "url": url, "mode": "shared"}], "retry": {"min_ms": 100, "max_ms": 300, "online_ms": 500}}
    gateway = Gateway(tmp_path, config)
    try:
        gateway.wait_for("device online", device="interop")
        # The session is there, and the object is known.
        assert ask(gateway.port, "GET", "/api/v1/devices/interop/interop/p_double").status == 200
        device.pause()
        waiting = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=10)
        waiting.request("GET", "/api/v1/devices/interop/interop/both", headers={"Accept": "text/event-stream"})
        time.sleep(0.5)
        gateway.write({**gateway.config, "devices": []})
        gateway.hang_up()
        answer = waiting.getresponse()
        assert answer.status >= 400, answer.read()
        waiting.close()
    finally:
        device.resume()
        gateway.process.stop()
