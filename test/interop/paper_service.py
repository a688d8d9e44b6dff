"""The service of the paper (test/examples/paper), on a robot that is not there."""
import contextlib
import socket
import sys

from processes import ROOT, Background, free_port

PAPER = ROOT / "test" / "examples" / "paper"
QUIET = [f"--robotraconteur-{name}=false" for name in ("local-enable", "discovery-announce-enable", "discovery-listening-enable")]


@contextlib.contextmanager
def running_service(folder):
    """(port, sent): `sent(is_enough)` waits until the lines that the robot was sent are enough, and returns them."""
    port, serial = free_port(), folder / "serial"
    command = [sys.executable, PAPER / "create_service.py", "--serialport", serial, "--tcp-port", port, *QUIET]
    service = Background(command, folder / "service.log", {"PYTHONPATH": PAPER / "fake"})

    def accepts():
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    def sent(is_enough):
        service.wait_until(lambda: is_enough(serial.read_text().splitlines()))
        return serial.read_text().splitlines()

    try:
        service.wait_until(accepts)
        yield port, sent
    finally:
        service.stop()
