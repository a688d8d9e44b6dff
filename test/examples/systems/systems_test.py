"""Starts the systems of examples/ and uses them as somebody would who reads them.

systems_test.py BUILD_DIR
"""
import base64
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import unittest
import urllib.request
from pathlib import Path

from serial_scenarios import DEADLINE, Program, SerialScenarios, wait_for

BUILD = sys.argv.pop(1)
RRGATE = os.path.join(BUILD, "server", "rrgate")
CREATE = os.path.join(BUILD, "examples", "demo", "rrgate-create-serial")


def ran(*arguments):
    return subprocess.run([RRGATE, *map(str, arguments)], capture_output=True, text=True, timeout=DEADLINE)


def rrgate(*arguments):
    done = ran(*arguments)
    assert done.returncode == 0, (arguments, done.stderr)
    return done.stdout.strip()


def get(*arguments):
    return json.loads(rrgate("get", *arguments, "--json"))


def colour(value):
    return [value[name] for name in ("red", "green", "blue")]


class ConferenceRoom(unittest.TestCase):
    def setUp(self):
        gateway = Program(self, RRGATE, "demo", "conference-room", "--port", 0)
        self.addCleanup(gateway.process.terminate)
        pages = gateway.url("rrgate demo: http://127")
        self.controller = f"{pages}devices/controller?service=Controller"
        self.lights = f"{pages}devices/lights?service=Lights"
        self.north = f"{pages}devices/sensors-north?service=Sensors"
        self.south = f"{pages}devices/sensors-south?service=Sensors"

        wait_for(lambda: ran("get", self.controller, "mean").returncode == 0)

    def is_reached(self, target):
        return all(abs(found - wanted) < 0.04 * wanted for found, wanted in zip(colour(get(self.controller, "mean")), target))

    def light(self):
        """Of all lights and colours together."""
        return sum(sum(colour(level)) for level in get(self.lights, "levels"))

    def test_a_target_is_reached_by_the_lights_through_the_gateway(self):
        self.assertEqual(len(get(self.lights, "places")), 8)
        for target in ([300, 250, 200], [150, 200, 350]):
            rrgate("set", self.controller, "target", json.dumps(target))
            wait_for(lambda: self.is_reached(target))
            readings = get(self.north, "readings") + get(self.south, "readings")
            self.assertEqual(len(readings), 12)
            for reading in readings:
                for found, wanted in zip(colour(reading), target):
                    self.assertLess(abs(found - wanted), 0.2 * wanted)
        level = get(self.lights, "lights/0/level")
        self.assertGreater(level["blue"], level["red"])  # the room has turned blue

    def test_daylight_is_made_up_for(self):
        target = [300, 300, 300]
        rrgate("set", self.controller, "target", json.dumps(target))
        wait_for(lambda: self.is_reached(target))
        before = self.light()
        for sensors in (self.north, self.south):
            rrgate("set", sensors, "daylight", "[160, 160, 160]")
        wait_for(lambda: self.is_reached(target) and self.light() < before - 2)

    def test_the_lights_are_left_alone_while_the_controller_is_off(self):
        rrgate("set", self.controller, "on", "false")
        levels = [{"red": 0.1, "green": 0.2, "blue": 0.3}] * 8
        rrgate("set", self.lights, "levels", json.dumps(levels))
        seen = rrgate("watch", self.controller, "mean", "--count", "10").splitlines()
        self.assertEqual(len(seen), 10)
        self.assertEqual(get(self.lights, "levels"), levels)
        rrgate("set", self.controller, "on", "true")
        wait_for(lambda: get(self.lights, "levels") != levels)

    def test_what_makes_no_sense_is_refused(self):
        for service, member, value in ((self.controller, "target", "[2000, 0, 0]"), (self.controller, "gain", "2"),
                                       (self.lights, "levels", "[[0, 0, 0]]"), (self.lights, "lights/0/level", "[0, 0, 1.5]")):
            refused = ran("set", service, member, value)
            self.assertNotEqual(refused.returncode, 0)
            self.assertRegex(refused.stderr, "expected|outside of")
        self.assertNotEqual(ran("get", self.lights, "lights/8/level").returncode, 0)


class Microassembly(unittest.TestCase):
    def setUp(self):
        self.gateway = Program(self, RRGATE, "demo", "microassembly", "--port", 0)
        self.addCleanup(self.gateway.process.terminate)
        pages = self.gateway.url("rrgate demo: http://127")
        self.cell = f"{pages}devices/cell?service=Cell"
        self.cameras = f"{pages}devices/cameras?service=Cameras"
        self.wait_for_all()

    def wait_for_all(self):
        wait_for(lambda: '"Stages Cameras Illuminators"' in ran("get", self.cell, "parts", "--json").stdout)
        wait_for(lambda: ran("get", self.cell, "poses").returncode == 0)

    def poses(self):
        return [[pose[name] for name in ("x", "y", "z", "theta")] for pose in get(self.cell, "poses")]

    def brightness(self, microscope=0):
        return sum(self.picture(microscope))

    def picture(self, microscope=0):
        return base64.b64decode(get(self.cameras, f"microscopes/{microscope}/picture")["data"])

    def processes(self):
        """The nodes' command lines by their parts."""
        found = {}
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                words = Path(f"/proc/{pid}/cmdline").read_text().split("\0")[:-1]
                parent = int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[1])
            except OSError:
                continue  # it has ended
            if parent == self.gateway.process.pid:
                found[words[1]] = int(pid), words
        return found

    def test_a_probe_is_moved_and_seen(self):
        before = self.poses()
        self.assertEqual(len(before), 6)
        wait_for(lambda: self.brightness() > 0)
        rrgate("call", self.cell, "move", "2", "[0.5, -0.25, 0.5, 0.3]")
        target = [now + by for now, by in zip(before[2], (0.5, -0.25, 0.5, 0.3))]
        wait_for(lambda: all(abs(now - wanted) < 1e-9 for now, wanted in zip(self.poses()[2], target)))
        self.assertEqual(self.poses()[0], before[0])
        lit = self.brightness()
        for illuminator in range(3):
            rrgate("call", self.cell, "illuminate", str(illuminator), "0")
        wait_for(lambda: self.brightness() < lit / 2)
        rrgate("call", self.cell, "focus", "1", "0.5")
        wait_for(lambda: get(self.cameras, "focus") == [1, 0.5, 1])

    def test_what_makes_no_sense_is_refused(self):
        for arguments in (("move", "6", "[0, 0, 0, 0]"), ("move", "0", "[9, 0, 0, 0]"), ("illuminate", "0", "2"), ("focus", "3", "1")):
            refused = ran("call", self.cell, *arguments)
            self.assertNotEqual(refused.returncode, 0)
            self.assertRegex(refused.stderr, "expected|outside of")

    def test_any_node_may_end_and_come_back(self):
        for part in ("stages", "illuminators", "cameras", "cell"):
            pid, words = self.processes()[part]
            os.kill(pid, 9)
            wait_for(lambda: not os.path.exists(f"/proc/{pid}"))  # it holds its port until then
            if part == "stages":
                wait_for(lambda: "not there" in ran("call", self.cell, "move", "0", "[0, 0, 0, 0]").stderr)
            again = subprocess.Popen(words, stdout=subprocess.DEVNULL)
            self.addCleanup(again.wait)
            self.addCleanup(again.kill)
            self.wait_for_all()
            wait_for(lambda: ran("call", self.cell, "move", "1", "[-0.1, 0, 0, 0]").returncode == 0)
            wait_for(lambda: ran("call", self.cell, "illuminate", "0", "0.5").returncode == 0)
            wait_for(lambda: ran("call", self.cell, "focus", "0", "1.5").returncode == 0)
            wait_for(lambda: ran("get", self.cameras, "microscopes/3/picture").returncode == 0)


class CreateMinimal(SerialScenarios, unittest.TestCase):
    COMMAND = [CREATE]
    RRGATE = RRGATE


class MoreDevices(unittest.TestCase):
    def demo(self, name, *options):
        gateway = Program(self, RRGATE, "demo", name, "--port", 0, *options)
        self.addCleanup(gateway.process.terminate)
        return gateway.url("rrgate demo: http://127") + "devices/"

    def test_the_robot_on_a_simulated_line_drives_until_a_wall(self):
        url = self.demo("create-minimal") + "create?service=Create"
        self.assertIn("experimental.create.Create", rrgate("info", url))
        rrgate("call", url, "StartStreaming")
        watch = Program(self, RRGATE, "watch", url, "Bump", "--count", 1)
        rrgate("call", url, "Drive", "500", "32767")
        wait_for(lambda: get(url, "DistanceTraveled") > 100)
        self.assertEqual(watch.process.wait(DEADLINE), 0)
        self.assertTrue(1900 < get(url, "DistanceTraveled") <= 2000)
        self.assertEqual((get(url, "Bumpers"), get(url, "AngleTraveled")), (3, 0))
        rrgate("call", url, "Drive", "-100", "1")
        wait_for(lambda: get(url, "AngleTraveled") < -20)

    def test_each_of_six_robots_drives_by_itself(self):
        devices = self.demo("robots")
        urls = [f"{devices}robot-{number}?service=Create" for number in range(1, 7)]
        for url in urls[::2]:
            rrgate("call", url, "Drive", "100", "32767")
        wait_for(lambda: all(get(url, "DistanceTraveled") > 20 for url in urls[::2]))
        self.assertEqual([get(url, "DistanceTraveled") for url in urls[1::2]], [0, 0, 0])

    def test_a_fleet_is_as_large_as_is_asked_for(self):
        """More than a process may open at first, with the limit on descriptors that most systems have."""
        _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (most, most))
        resource.setrlimit(resource.RLIMIT_NOFILE, (1024, most))
        devices = self.demo("fleet", "--count", 1100)
        with urllib.request.urlopen(devices.replace("/devices/", "/api/v1/devices"), timeout=DEADLINE) as answer:
            listed = json.load(answer)["devices"]
        self.assertEqual([each["name"] for each in listed], [f"sensor-{number}" for number in range(1, 1101)])
        self.assertEqual({each["state"] for each in listed}, {"online"})
        first, last = (f"{devices}sensor-{number}?service=Sensor" for number in (1, 1100))
        self.assertEqual([get(url, "number") for url in (first, last)], [1, 1100])
        rrgate("set", last, "offset", "10")
        wait_for(lambda: get(last, "temperature") > get(first, "temperature") + 5)
        self.assertIn("expected -10 to 10", ran("set", last, "offset", "11").stderr)
        for others in (["robots", "--count", "2"], ["fleet", "--count", "0"]):
            self.assertIn("--count", ran("demo", *others).stderr)

    def test_a_fleet_that_has_ended_is_started_again_by_what_the_log_says(self):
        gateway = Program(self, RRGATE, "demo", "fleet", "--port", 0, "--count", 300)
        self.addCleanup(gateway.process.terminate)
        last = gateway.url("rrgate demo: http://127") + "devices/sensor-300?service=Sensor"
        (fleet,) = Path(f"/proc/{gateway.process.pid}/task/{gateway.process.pid}/children").read_text().split()
        os.kill(int(fleet), signal.SIGKILL)
        wait_for(lambda: "by hand" in gateway.said())
        command, rest = re.search("command='([^']*)'(.*)", gateway.said()).groups()
        self.assertEqual(rest, "")  # it is told whole
        wait_for(lambda: ran("get", last, "number").returncode != 0)
        Program(self, *command.split())
        wait_for(lambda: ran("get", last, "number").stdout == "300\n")


if __name__ == "__main__":
    unittest.main()
