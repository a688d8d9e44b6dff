"""Pipes of a shared device whose sender minds credit: the slowest reader sets its pace. Device and clients are those of the
real package."""
import json
import pathlib
import sys

import numpy
import pytest

from credit_service import BACKLOG
from news import News
from processes import Background, start_gateway

PEERS = pathlib.Path(__file__).parent / "peers"

FRAME = 262_144  # bytes
QUEUE = 8_000_000  # bytes that may wait for a client; above a quarter of it the device is held back
SLOW = "client reads slowly"


@pytest.fixture
def device(tmp_path):
    process = Background([sys.executable, PEERS / "credit_service.py"], tmp_path / "credit_service.log")
    yield process, json.loads(process.next_line())["url"]
    process.stop()


class Reader(Background):
    """A client in a process of its own, which can be paused: then nobody reads from its connection."""

    def __init__(self, folder, url):
        super().__init__([sys.executable, PEERS / "frame_reader.py", url], folder / "frame_reader.log")
        self.next_line()

    def numbers(self):
        self.write_line("numbers")
        return json.loads(self.next_line())


class Site:
    """The device behind a gateway, with one client that reads and one that can be stopped."""

    def __init__(self, folder, node, url, send_stall_ms, memory=0):
        self._log = folder / "gateway.log"
        self.gateway, port = start_gateway(folder, url, device={"mode": "shared"}, limits={"client_queue_bytes": QUEUE, "memory": memory},
                                           timeouts={"send_stall_ms": send_stall_ms})
        self._url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=credit"
        self.slow = Reader(folder, self._url)
        self.device = node.ConnectService(url)
        self.root = node.ConnectService(self._url)
        self.frames = []
        self.news = News()
        self._published = 0
        self.root.frames.Connect(-1).PacketReceivedEvent += self._receive

    def _receive(self, endpoint):
        while endpoint.Available:
            frame = endpoint.ReceivePacket()
            self.frames.append(int.from_bytes(bytes(frame[:4]), "little"))
            self.news.add(self.frames[-1])

    def publish(self):
        self._published += 1
        self.device.publish(self._published, FRAME)
        return self._published

    def has_logged(self, text):
        return text in self._log.read_text()

    def publish_until(self, is_so):
        """One after the other, each when the last one has come, or can't."""
        while not is_so():
            number = self.publish()
            self.gateway.wait_until(lambda: number in self.frames or is_so())

    def publish_until_held(self):
        """The other one stops reading."""
        self.publish_until(lambda: len(self.frames) == 3)
        self.gateway.wait_until(lambda: self.slow.numbers() == self.frames)
        self.slow.pause()
        self.publish_until(lambda: self.has_logged(SLOW))

    def publish_until_nothing_comes(self):
        """At first the sockets on the way to the slow one take more yet, and the device may go on: how much, the kernel says."""
        for _ in range(10):
            before = len(self.frames)
            self.publish_many()
            if len(self.frames) == before:
                return
        pytest.fail(f"the device is not held back: {len(self.frames)} frames of {self._published} have come")

    def publish_many(self):
        """More than may wait for a client. Each is followed by a call, in whose time an acknowledgement would come."""
        for _ in range(3 * QUEUE // FRAME):
            self.publish()
            self.root.number_of_orders()

    def close(self, node):
        node.DisconnectService(self.root)
        node.DisconnectService(self.device)
        self.slow.stop()
        assert self.gateway.stop() == 0, self.gateway.description()


def test_the_slowest_reader_sets_the_pace(tmp_path, node, device):
    site = Site(tmp_path, node, device[1], send_stall_ms=60_000)
    try:
        site.publish_until_held()
        site.publish_until_nothing_comes()
        site.slow.resume()
        site.gateway.wait_until(lambda: site.slow.numbers() == site.frames)
        before = len(site.frames)
        site.gateway.wait_until(lambda: site.publish() and len(site.frames) >= before + 2 * BACKLOG)
        site.gateway.wait_until(lambda: site.slow.numbers() == site.frames)
        assert not site.has_logged("client closed"), site.gateway.description()
    finally:
        site.close(node)


def test_the_device_goes_on_without_the_slow_one(tmp_path, node, device):
    """Who takes nothing for `send_stall_ms` is cut as ever, and keeps nobody waiting any more."""
    site = Site(tmp_path, node, device[1], send_stall_ms=1000)
    try:
        site.publish_until_held()
        # The sockets may yet take all that waits for the slow one: only with more to come it is behind for good.
        site.gateway.wait_until(lambda: site.publish() and site.has_logged("peer too slow"))
        before = len(site.frames)
        site.gateway.wait_until(lambda: site.publish() and len(site.frames) >= before + 2 * BACKLOG)
    finally:
        site.close(node)


def test_memory_that_is_used_up_ends_the_one_who_does_not_read(tmp_path, node, device):
    """Both come from one address, which gets half: less than a client may leave unread by itself."""
    site = Site(tmp_path, node, device[1], send_stall_ms=60_000, memory=3_000_000)
    try:
        site.publish_until(lambda: len(site.frames) == 3)
        site.slow.pause()
        site.publish_until(lambda: site.has_logged("client too slow: the gateway has no memory left"))
        assert not site.has_logged(SLOW)
        before = len(site.frames)
        site.gateway.wait_until(lambda: site.publish() and len(site.frames) >= before + 2 * BACKLOG)
    finally:
        site.close(node)


def test_packets_of_clients_are_acknowledged_by_the_device(tmp_path, node, device):
    process, url = device
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"})
    try:
        root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=credit")
        orders = root.orders.Connect(-1)
        orders.RequestPacketAck = True
        acknowledged = []
        news = News()

        def note(endpoint, number):
            acknowledged.append(number)
            news.add(number)

        orders.PacketAckReceivedEvent += note
        sent = News()
        order = numpy.zeros((8,), numpy.uint8)
        orders.AsyncSendPacket(order, lambda number, error: sent.add(number))
        news.wait_for(lambda number: number == 1)
        process.pause()
        for _ in range(3):
            orders.AsyncSendPacket(order, lambda number, error: sent.add(number))
        sent.wait_for(lambda number: number == 4)
        node.GetServiceAttributes(root)  # the gateway answers it by itself
        assert acknowledged == [1]
        process.resume()
        for expected in (2, 3, 4):  # the package takes them side by side, in any order
            news.wait_for(lambda number: number == expected)
        assert sorted(acknowledged) == [1, 2, 3, 4]
        assert root.number_of_orders() == 4
        node.DisconnectService(root)
    finally:
        gateway.stop()
