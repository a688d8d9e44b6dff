"""The paper's Python service with our clients, and its Python client with our simulated robot (test/examples/paper)."""
import itertools
import re
import signal
import subprocess
import sys

import pytest

from clients import JS, run_program
from paper_service import PAPER, running_service
from processes import BUILD, Background, start_gateway

SONG = [69, 16, 60, 16, 69, 16]


@pytest.fixture
def service(tmp_path):
    """The paper's service, on a robot that is not there: (port, what the robot was sent, line by line)."""
    with running_service(tmp_path) as (port, sent):
        yield port, lambda: sent(lambda lines: "141 0" in lines)  # the song has arrived


@pytest.mark.parametrize("client", ["ours", "node"])
def test_service(service, client, tmp_path):
    port, sent = service
    url = f"rr+tcp://127.0.0.1:{port}/?service=Create"
    if client == "ours":
        results = run_program([BUILD / "test/interop/cpp/rr-test-client", url], STEPS)["results"]
    else:
        gateway, port = start_gateway(tmp_path, url)
        try:
            url = f"ws://127.0.0.1:{port}/devices/interop?service=Create"
            results = run_program(["node", JS / "client.mjs", url], STEPS)["results"]
        finally:
            gateway.stop()
    assert [result.get("value", result) for result in results] == EXPECTED
    drive, stop = "137 0 100 3 232", "137 0 0 3 232"
    song = ["140 0 3 69 16 60 16 69 16", "141 0"]  # whenever the answer was there
    assert [line for line in sent() if line in song] == song
    assert [line for line in sent() if line not in song] == ["128", "132", "150 0", "148 4 7 19 20 18", drive, stop, "150 0"]


STANDING = {"ID": 19, "Data": [7, 0, 19, 0, 0, 20, 0, 0, 18, 0]}
STEPS = [
    {"listen": "Bump"},
    {"connect": "packets"},
    {"answer": "play_callback", "value": {"uint8[]": SONG}},
    {"get": "Bumpers"},
    {"call": "StopStreaming"},
    {"call": "StartStreaming"},
    {"in_value": "packets", "until": STANDING},
    {"call": "Drive", "args": [{"int16": 100}, {"int16": 1000}]},
    {"get_until": "DistanceTraveled", "until": 100},
    {"get_until": "AngleTraveled", "until": -10},
    {"events": "Bump", "count": 1},
    {"asked": "play_callback", "count": 1},
    {"get": "Bumpers"},
    {"in_value": "packets", "until": STANDING},
    {"call": "Drive", "args": [{"int16": 0}, {"int16": 1000}]},
    {"call": "StopStreaming"},
]
EXPECTED = [None, None, None, 0, {"error": {"name": "RobotRaconteur.InvalidOperation", "message": "Not streaming"}}, None,
            STANDING, None, 100, -10, {"list": [[]]}, {"list": [[100, -10]]}, 0, STANDING, None, None]


class PaperClient:
    """The paper's client at work; what it prints is read line by line."""

    def __init__(self, url, *options):
        self._process = subprocess.Popen([sys.executable, PAPER / "create_client.py", url, *options],
                                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.lines = []

    def wait_for(self, pattern):
        """The first line that matches; a client that ends without one is an error. The run has a deadline (conftest.py)."""
        for line in itertools.chain(self.lines[:], self._read_lines()):
            if match := re.fullmatch(pattern, line):
                return match
        raise AssertionError(f"no line {pattern!r}:\n" + "\n".join(self.lines[-20:]))

    def _read_lines(self):
        for line in self._process.stdout:
            self.lines.append(line.rstrip())
            yield self.lines[-1]

    def interrupt(self):
        self._process.send_signal(signal.SIGINT)
        self.lines += self._process.stdout.read().splitlines()
        return self._process.wait(10)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()


def test_client_with_the_service_of_the_paper(service):
    port, sent = service
    with PaperClient(f"rr+tcp://127.0.0.1:{port}/?service=Create", "--drive", "1", "--rest", "60") as client:
        client.wait_for("Stopped after 100 mm")
        assert client.interrupt() == 0
    assert "Bump!!" in client.lines
    assert "Play after 100 mm and -10 degrees" in client.lines
    assert "7 0 19 0 10 20 255 255 18 0" in client.lines
    assert sent()[-2:] == ["137 0 0 3 232", "150 0"]
    assert "140 0 3 69 16 60 16 69 16" in sent()


def test_client_with_our_robot(tmp_path):
    robot = Background([BUILD / "examples/demo/rrgate-demo-create", "--port", "0"], tmp_path / "robot.log")
    try:
        url = robot.next_line().removeprefix("create: ")
        with PaperClient(url, "--drive", "1", "--rest", "60") as client:
            client.wait_for("Driving")
            client.wait_for(r"(\d+ ){51}\d+")  # packet 6 of the robot: all sensors
            # Somebody else presses its button, and the client that drives is asked ...
            press = [{"call": "press_play"}, {"get_until": "song", "until": SONG}]
            assert run_steps(url, press) == [None, SONG]
            client.wait_for(r"Play after \d+ mm and \d+ degrees")
            assert int(client.wait_for(r"Stopped after (\d+) mm")[1]) >= 50
            # ... and drives it against a wall.
            crash = [{"listen": "Bump"}, {"call": "Drive", "args": [{"int16": 500}, {"int16": 32767}]},
                     {"events": "Bump", "count": 1}]
            assert run_steps(url, crash) == [None, None, {"list": [[]]}]
            client.wait_for("Bump!!")
            assert client.interrupt() == 0
    finally:
        assert robot.stop() == 0


def run_steps(url, steps):
    results = run_program([BUILD / "test/interop/cpp/rr-test-client", url], steps)["results"]
    return [result.get("value", result) for result in results]
