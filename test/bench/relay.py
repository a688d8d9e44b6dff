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
    with tempfile.TemporaryDirectory() as scratch, contextlib.ExitStack() as stack:
        folder = pathlib.Path(scratch)

        def start(name, port, *command):
            process = Background(command, folder / f"{name}.log")
            stack.callback(process.stop)
            process.wait_until(lambda: is_open(port))
            return port

        ours, yardstick = free_port(), free_port()
        (folder / "gateway.json").write_text(json.dumps({
            "listen": [f"127.0.0.1:{ours}"],
            "devices": [{"name": "device", "url": f"rr+tcp://127.0.0.1:{device_port}/?service=interop"}],
        }))
        (folder / "haproxy.cfg").write_text(HAPROXY.format(port=yardstick, device=device_port))
        yield (start("gateway", ours, build / "server/rrgate", "serve", "--config", folder / "gateway.json"),
               start("haproxy", yardstick, "haproxy", "-f", folder / "haproxy.cfg", "-db"))


def is_open(port):
    with contextlib.closing(socket.socket()) as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
