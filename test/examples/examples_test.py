"""Installs rrgate, builds examples/ against the installed tree, and runs what came of it.

examples_test.py BUILD_DIR EXAMPLES_DIR GENERATOR CXX BOOST_ROOT
"""
import os
import re
import subprocess
import sys
import tempfile
import unittest

BUILD, EXAMPLES, GENERATOR, CXX, BOOST_ROOT = sys.argv[1:6]
del sys.argv[1:]
THERMOSTAT = os.path.join(EXAMPLES, "thermostat")


def run(*command):
    result = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if result.returncode != 0:
        raise AssertionError(f"{' '.join(command)}\n{result.stdout}\n{result.stderr}")
    return result.stdout


class Examples(unittest.TestCase):
    def test_a_device_and_a_client_build_and_talk(self):
        with tempfile.TemporaryDirectory() as folder:
            prefix, build = os.path.join(folder, "installed"), os.path.join(folder, "build")
            run("cmake", "--install", BUILD, "--prefix", prefix)
            rrgate = os.path.join(prefix, "bin/rrgate")
            self.assertRegex(run(rrgate, "--version"), r"^rrgate \d")
            run(rrgate, "check-config", os.path.join(THERMOSTAT, "gateway.json"))
            boost = [f"-DBOOST_ROOT={BOOST_ROOT}"] if BOOST_ROOT else []
            run("cmake", "-S", EXAMPLES, "-B", build, "-G", GENERATOR, f"-DCMAKE_PREFIX_PATH={prefix}",
                f"-DCMAKE_CXX_COMPILER={CXX}", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror", *boost)
            run("cmake", "--build", build)

            device = subprocess.Popen([os.path.join(build, "thermostat_device"), "rr+tcp://127.0.0.1:0"],
                                      stdout=subprocess.PIPE, text=True)
            try:
                url = device.stdout.readline().strip()
                self.assertEqual(run(os.path.join(build, "thermostat_client"), url), "21 degrees\n")
            finally:
                self.end(device)
            self.outlives_the_device(build, url)

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

    def end(self, device):
        device.terminate()
        device.stdout.close()
        self.assertEqual(device.wait(timeout=10), 0)


class Text(unittest.TestCase):
    """The examples say how little it takes: the device 40 lines at most, each file of a client 15."""

    def test_examples_are_short(self):
        limits = {"device.cpp": 40, "client.cpp": 15, "subscriber.cpp": 15, "client.mjs": 15, "site/index.html": 15, "site/client.js": 15}
        for name, limit in limits.items():
            self.assertLessEqual(len(text_of(name).splitlines()), limit, name)

    def test_the_documentation_shows_the_files_as_they_are(self):
        with open(os.path.join(EXAMPLES, "../docs/examples.md")) as page:
            shown = dict(re.findall(r"^<!-- (\S+) -->\n```\w*\n(.*?)^```$", page.read(), re.MULTILINE | re.DOTALL))
        for name, text in shown.items():
            self.assertEqual(text, text_of(name), name)
        # What a reader has put there is not ours: rrgate-client, node_modules.
        names = {os.path.relpath(os.path.join(folder, name), THERMOSTAT)
                 for folder, _, files in os.walk(THERMOSTAT) for name in files if not re.search("/(rrgate-client|node_modules)", folder)}
        self.assertEqual(set(shown), names)


def text_of(name):
    with open(os.path.join(THERMOSTAT, name)) as source:
        return source.read()


if __name__ == "__main__":
    unittest.main()
