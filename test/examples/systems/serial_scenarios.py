"""What each service of examples/create-minimal does with the bytes of a robot's serial line."""
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3] / "examples/create-minimal"))

from serial_robot import Robot  # noqa: E402

DEADLINE = 30  # seconds


def wait_for(is_so):
    until = time.monotonic() + DEADLINE
    while not is_so():
        assert time.monotonic() < until, "not within the deadline"
        time.sleep(0.05)


class Program:
    """One that says its URL in its first line with "://"."""

    def __init__(self, test, *command):
        self.log = test.enterContext(tempfile.TemporaryFile("w+"))
        self.process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stderr=self.log, text=True)
        test.addCleanup(self.process.stdout.close)
        test.addCleanup(self.process.wait)
        test.addCleanup(self.process.kill)

    def url(self, begin=""):
        for line in self.process.stdout:
            if line.startswith(begin) and "://" in line:
                return line.split()[-1]
        raise AssertionError("no URL: " + self.said())

    def said(self):
        self.log.seek(0)
        return self.log.read()


class SerialScenarios:
    """For a TestCase with the command of the service, COMMAND, to which the device and the port are added, and with RRGATE.

    All of it in statements: pytest counts the assertions of a test, and knows no others.
    """

    def setUp(self):
        self.robot = Robot()
        self.addCleanup(self.robot.unplug)
        self.program = Program(self, *self.COMMAND, self.robot.device, 0, *self.OPTIONS)
        self.url = self.program.url()

    OPTIONS = ()

    def ran(self, *arguments):
        return subprocess.run([self.RRGATE, *map(str, arguments)], capture_output=True, text=True, timeout=DEADLINE)

    def call(self, *arguments):
        done = self.ran("call", self.url, *arguments)
        assert done.returncode == 0, done.stderr

    def get(self, member):
        done = self.ran("get", self.url, member, "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def heard(self, command):
        wait_for(lambda: command in self.robot.commands)

    def test_the_robot_is_started_and_driven(self):
        self.heard([150, 0])
        assert self.robot.commands == [[128], [132], [150, 0]]
        self.call("Drive", "-200", "500")
        self.heard([137, 0xff, 0x38, 0x01, 0xf4])
        self.heard([137, 0, 0, 0x7f, 0xff])  # the client that drives it is gone
        for arguments in (("501", "0"), ("-501", "0"), ("100", "2001")):
            assert "expected -" in self.ran("call", self.url, "Drive", *arguments).stderr
        assert len(self.robot.commands) == 5

    def test_the_stream_is_read_and_what_is_no_packet_left_out(self):
        watch = Program(self, self.RRGATE, "watch", self.url, "Bump", "--count", 1, "--json")
        # Nobody streams: the robot says this all the same, as one does that was switched on before.
        spoilt = bytearray(self.robot.packet(distance=1000))
        spoilt[5] ^= 1

        def bumps():
            self.robot.say(b"\x01\x13" + bytes(spoilt) + self.robot.packet(distance=-3, angle=2)[:-4])
            self.robot.say(self.robot.packet() + self.robot.packet(bumps=2))
            return watch.process.poll() is not None

        wait_for(bumps)
        wait_for(lambda: self.get("Bumpers") == 2)
        assert self.get("DistanceTraveled") == 0
        half = self.robot.packet(distance=-300, angle=-90)
        self.robot.say(half[:7])
        assert self.get("DistanceTraveled") == 0
        self.robot.say(half[7:] + self.robot.packet(distance=100, angle=30))
        wait_for(lambda: self.get("DistanceTraveled") == -200)
        assert self.get("AngleTraveled") == -60
        assert self.ran("set", self.url, "Bumpers", "0").returncode != 0

    def test_it_streams_while_somebody_wants_it(self):
        self.call("StartStreaming")  # and is gone
        self.heard([148, 4, 7, 19, 20, 18])
        wait_for(lambda: self.robot.commands.count([150, 0]) == 2)
        assert self.robot.commands[3:] == [[148, 4, 7, 19, 20, 18], [150, 0]]

    def test_a_line_that_goes_away_is_told_and_ends_the_program(self):
        self.heard([150, 0])
        self.robot.unplug()
        assert self.program.process.wait(DEADLINE) == 1
        assert "is gone: " in self.program.said()

    def test_a_line_that_is_not_there_is_told(self):
        done = subprocess.run([*map(str, self.COMMAND), "/dev/no-robot"], capture_output=True, text=True, timeout=DEADLINE)
        assert done.returncode == 1
        assert "/dev/no-robot" in done.stderr
