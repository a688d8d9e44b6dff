"""The two relays of the relay benchmark: a device, and the gateway and HAProxy in front of it."""
import contextlib
import json
import pathlib
import socket
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))

from processes import Background, free_port  # noqa: E402

HAPROXY = """
global
    maxconn 256
    nbthread 1
defaults
    mode tcp
    timeout connect 5s
    timeout client 60s
    timeout server 60s
listen device
    bind 127.0.0.1:{port}
    option tcp-smart-accept
    server device 127.0.0.1:{device}
"""


@contextlib.contextmanager
def device(build):
    """Port of a device made with our service API."""
    with tempfile.TemporaryDirectory() as scratch, contextlib.ExitStack() as stack:
        process = Background([build / "test/interop/cpp/rr-test-service"], pathlib.Path(scratch) / "device.log")
        stack.callback(process.stop)
        yield json.loads(process.next_line())["port"]


@contextlib.contextmanager
def relays(build, device_port):
    """Ports of the gateway and of HAProxy in front of one device."""
    with gateway(build, device_port) as ours, haproxy(device_port) as yardstick:
        yield ours, yardstick


@contextlib.contextmanager
def gateway(build, device_port, **options):
    """Its port; the device, with these options, has the name "device"."""
    with tempfile.TemporaryDirectory() as scratch:
        port, config = free_port(), pathlib.Path(scratch) / "gateway.json"
        device = {"name": "device", "url": f"rr+tcp://127.0.0.1:{device_port}/?service=interop", **options}
        config.write_text(json.dumps({"listen": [f"127.0.0.1:{port}"], "devices": [device]}))
        with listening(port, build / "server/rrgate", "serve", "--config", config):
            yield port


@contextlib.contextmanager
def haproxy(device_port):
    with tempfile.TemporaryDirectory() as scratch:
        port, config = free_port(), pathlib.Path(scratch) / "haproxy.cfg"
        config.write_text(HAPROXY.format(port=port, device=device_port))
        with listening(port, "haproxy", "-f", config, "-db"):
            yield port


@contextlib.contextmanager
def listening(port, *command):
    """A process that has begun to listen: its id."""
    with tempfile.TemporaryDirectory() as scratch:
        process = Background(command, pathlib.Path(scratch) / "log")
        try:
            process.wait_until(lambda: is_open(port))
            yield process.process.pid
        finally:
            process.stop()


def is_open(port):
    with contextlib.closing(socket.socket()) as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
