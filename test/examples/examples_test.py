"""Installs rrgate, builds examples/ against the installed tree, and runs what came of it.

examples_test.py BUILD_DIR EXAMPLES_DIR GENERATOR CXX BOOST_ROOT
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request

BUILD, EXAMPLES, GENERATOR, CXX, BOOST_ROOT = sys.argv[1:6]
del sys.argv[1:]
THERMOSTAT = os.path.join(EXAMPLES, "thermostat")


def run(*command, **options):
    result = subprocess.run(command, capture_output=True, text=True, timeout=600, **options)
    if result.returncode != 0:
        raise AssertionError(f"{' '.join(command)}\n{result.stdout}\n{result.stderr}")
    return result.stdout


class Examples(unittest.TestCase):
    def test_a_device_and_a_client_build_and_talk(self):
        with tempfile.TemporaryDirectory() as folder:
            prefix, build = os.path.join(folder, "rrgate"), os.path.join(folder, "build")
            run("cmake", "--install", BUILD, "--prefix", prefix)
            rrgate = os.path.join(prefix, "bin/rrgate")
            self.assertRegex(run(rrgate, "--version"), r"^rrgate \d")
            run(rrgate, "check-config", os.path.join(THERMOSTAT, "gateway.json"))
            configure = as_the_tutorial_says(folder, build)
            configure()
            with self.assertRaisesRegex(AssertionError, "libusb-1.0-0-dev"):
                configure("-DRRGATE_LIBUSB=OFF")
            configure("-URRGATE_LIBUSB")
            run("cmake", "--build", build)

            device = subprocess.Popen([os.path.join(build, "thermostat_device"), "rr+tcp://127.0.0.1:0"],
                                      stdout=subprocess.PIPE, text=True)
            try:
                url = device.stdout.readline().strip()
                for _ in range(2):  # the room is warm already when the second one comes
                    self.assertEqual(run(os.path.join(build, "thermostat_client"), url), "21 degrees\n")
            finally:
                self.end(device)
            self.outlives_the_device(build, url)
            self.systems_are_there(build)
            self.is_behind_a_gateway_inside_a_program(build)

    def systems_are_there(self, build):
        for words, told in ((["rrgate-demo-conference-room"], "controller: rr+tcp://"),
                            (["rrgate-demo-microassembly", "stages", "--group", f"examples{os.getpid()}"], "rr+tcp://"),
                            (["rrgate-demo-fleet", "--port", "0"], "rr+tcp://")):
            with subprocess.Popen([os.path.join(build, words[0]), *words[1:]], stdout=subprocess.PIPE, text=True) as system:
                try:
                    self.assertTrue(system.stdout.readline().startswith(told))
                finally:
                    system.terminate()
        refused = subprocess.run([os.path.join(build, "rrgate-create-serial"), "/dev/no-robot"], capture_output=True, text=True)
        self.assertIn("/dev/no-robot", refused.stderr)

    def outlives_the_device(self, build, url):
        listen = url.split("/?")[0]
        with subprocess.Popen([os.path.join(build, "thermostat_subscriber"), url], stdout=subprocess.PIPE, text=True) as subscriber:
            try:
                for _ in range(2):
                    device = subprocess.Popen([os.path.join(build, "thermostat_device"), listen], stdout=subprocess.PIPE, text=True)
                    try:
                        self.assertIn("21 degrees\n", iter(subscriber.stdout.readline, ""))
                    finally:
                        self.end(device)
            finally:
                subscriber.kill()

    def is_behind_a_gateway_inside_a_program(self, build):
        device = subprocess.Popen([os.path.join(build, "thermostat_device"), "rr+tcp://127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
        try:
            command = [os.path.join(build, "thermostat_gateway"), device.stdout.readline().strip()]
            with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as gateway:
                target = gateway.stdout.readline().strip() + "/api/v1/devices/room/Thermostat/target"
                self.assertEqual(read_json(target), 17)
                gateway.communicate("\n", timeout=30)
                self.assertEqual(gateway.returncode, 0)
        finally:
            self.end(device)

    def end(self, device):
        device.terminate()
        device.stdout.close()
        self.assertEqual(device.wait(timeout=10), 0)


class InAFolder(unittest.TestCase):
    def test_a_project_that_has_rrgate_in_a_folder_gets_the_libraries_and_nothing_else(self):
        with tempfile.TemporaryDirectory() as build:
            boost = [f"-DBOOST_ROOT={BOOST_ROOT}"] if BOOST_ROOT else []
            run("cmake", "-S", os.path.join(os.path.dirname(__file__), "in_a_folder"), "-B", build, "-G", GENERATOR,
                f"-DCMAKE_CXX_COMPILER={CXX}", f"-DRRGATE_FOLDER={os.path.dirname(EXAMPLES)}", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON",
                *boost)
            self.assertIn("Total Tests: 0", run("ctest", "--test-dir", build, "-N"))
            with open(os.path.join(build, "compile_commands.json")) as file:
                (command,) = [each["command"] for each in json.load(file) if each["file"].endswith("core_user.cpp")]
            self.assertNotIn(" -W", command)
            run("cmake", "--build", build, "--target", "core_user")
            self.assertEqual(run(os.path.join(build, "core_user")), "52230\n")
            run("cmake", "--install", build, "--prefix", os.path.join(build, "installed"))
            self.assertFalse(os.path.exists(os.path.join(build, "installed")))


class Text(unittest.TestCase):
    """The examples say how little it takes: the device 40 lines at most, each file of a client 15."""

    def test_examples_are_short(self):
        limits = {"device.cpp": 40, "device.py": 60, "client.cpp": 15, "subscriber.cpp": 15, "gateway.cpp": 20, "client.mjs": 15, "site/index.html": 15, "site/client.js": 15}
        for name, limit in limits.items():
            self.assertLessEqual(len(text_of(name).splitlines()), limit, name)

    def test_the_documentation_shows_the_files_as_they_are(self):
        shown = {}
        for page in pathlib.Path(EXAMPLES, "../docs").rglob("*.md"):
            if "node_modules" not in page.parts and ".vitepress" not in page.parts:
                shown |= dict(re.findall(r"^<!-- (\S+) -->\n```\w*\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL))
        for name, text in shown.items():
            self.assertEqual(text, text_of(name), name)
        # What a reader has put there is not ours: rrgate-client, node_modules.
        names = {os.path.relpath(os.path.join(folder, name), THERMOSTAT)
                 for folder, _, files in os.walk(THERMOSTAT) for name in files if not re.search("/(rrgate-client|node_modules)", folder)}
        self.assertEqual(set(shown), names)


def as_the_tutorial_says(home, build):
    """What configures the examples, in the folder of the sources, where rrgate is installed in `home`."""
    page = pathlib.Path(EXAMPLES, "../docs/tutorials/cpp-device.md").read_text()
    (line,) = re.findall(r"^cmake -S .*", page, re.MULTILINE)
    line = line.replace("build-examples", build) + ' "$@"'
    ours = ("-G", GENERATOR, f"-DCMAKE_CXX_COMPILER={CXX}", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
    return lambda *more: run("bash", "-c", line, "bash", *ours, *more, cwd=os.path.dirname(EXAMPLES), env={**os.environ, "HOME": home})


def read_json(url):
    """What a gateway answers once it has reached the device."""
    give_up = time.monotonic() + 30
    while True:
        try:
            with urllib.request.urlopen(url, timeout=30) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as error:
            if error.code != 503 or time.monotonic() > give_up:
                raise


def text_of(name):
    with open(os.path.join(THERMOSTAT, name)) as source:
        return source.read()


if __name__ == "__main__":
    unittest.main()
