"""Installs rrgate, builds examples/ against the installed tree, and runs what came of it.

examples_test.py BUILD_DIR EXAMPLES_DIR GENERATOR CXX BOOST_ROOT
"""
import os
import subprocess
import sys
import tempfile
import unittest

BUILD, EXAMPLES, GENERATOR, CXX, BOOST_ROOT = sys.argv[1:6]
del sys.argv[1:]


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
            self.assertRegex(run(os.path.join(prefix, "bin/rrgate"), "--version"), r"^rrgate \d")
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
                device.terminate()
                device.stdout.close()
                self.assertEqual(device.wait(timeout=10), 0)


class Length(unittest.TestCase):
    """The examples say how little it takes: device in 40 lines at most, client in 15."""

    def test_examples_are_short(self):
        for name, limit in (("device", 40), ("client", 15)):
            with open(os.path.join(EXAMPLES, "thermostat", f"{name}.cpp")) as source:
                self.assertLessEqual(len(source.readlines()), limit, name)


if __name__ == "__main__":
    unittest.main()
