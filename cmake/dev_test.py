#!/usr/bin/env python3
"""./dev before it does anything: help, words that it does not know, and what it takes for missing. Programs that would install or
build something are replaced by ones that write down that they were called."""
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
COMMANDS = ("setup", "build", "docs", "demo", "test", "asan", "tsan", "fuzz", "bench", "soak", "package", "debian13", "mutate", "fmt",
            "lint", "clean")
DOERS = ("apt-get", "cmake", "ctest", "dpkg-query", "mmdebstrap", "npm", "npx", "python3", "sudo")


class Dev(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.called = self.folder / "called"
        for name in DOERS:
            self.put(name, f"echo {name} >>{self.called}; exit 1")

    def put(self, name, text):
        program = self.folder / name
        program.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
        program.chmod(0o755)

    def run_script(self, *words):
        return subprocess.run(words, cwd=ROOT, env={"PATH": f"{self.folder}:/usr/bin:/bin", "HOME": str(self.folder)},
                              capture_output=True, text=True, timeout=20, check=False)

    def check_refused(self, message, *words):
        done = self.run_script("./dev", *words)
        self.assertEqual((done.returncode, done.stderr.splitlines()[-1]), (1, f"./dev: {message}"))
        self.assertFalse(self.called.exists())

    def test_help_does_nothing_else(self):
        for words in ((), ("help",), ("--help",), ("-h",)):
            done = self.run_script("./dev", *words)
            self.assertEqual(done.returncode, 0)
            for command in COMMANDS:
                self.assertRegex(done.stdout, rf"\./dev .*\b{command}\b")
        self.assertFalse(self.called.exists())

    def test_each_command_has_help_that_does_nothing_else(self):
        for command in COMMANDS:
            for word in ("--help", "-h"):
                done = self.run_script("./dev", command, word)
                self.assertEqual(done.returncode, 0, command)
                self.assertIn(command, done.stdout)
        self.assertFalse(self.called.exists())

    def test_what_can_be_simulated_is_listed_before_anything_is_built(self):
        done = self.run_script("./dev", "demo", "--list")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stdout, "(?m)^create +a mobile robot")
        self.assertFalse(self.called.exists())

    def test_unknown_words_are_refused_before_anything_is_done(self):
        self.check_refused('unknown command "biuld"', "biuld")
        self.check_refused('setup: unknown word "produkt"; expected product, or nothing', "setup", "produkt")
        for command in ("asan", "tsan", "debian13"):
            self.check_refused(f'{command}: unknown part "web"; expected core, node, server or examples', command, "core", "web")

    def test_packages_are_known_by_what_they_provide(self):
        self.put("dpkg-query", "printf '%s\\n' 'installed g++, c++-compiler, g++:amd64 (= 4)' 'not-installed cmake, '"
                               " 'installed libjpeg62-turbo-dev, libjpeg-dev (= 1:2.1), libjpeg-turbo-dev' 'config-files mold, '")
        done = self.run_script("bash", "-c", "set -- help; source ./dev >/dev/null; installed_packages")
        self.assertEqual(done.stdout.split(), ["c++-compiler", "g++", "libjpeg-dev", "libjpeg-turbo-dev", "libjpeg62-turbo-dev"])

    def test_only_what_is_missing_is_installed_and_nothing_is_removed(self):
        self.put("dpkg-query", "echo 'installed cmake, '")
        self.put("apt-get", f'echo "$@" >>{self.called}')
        self.put("sudo", f'shift; echo "$@" >>{self.called}')  # for users who are not root
        done = self.run_script("bash", "-c", "set -- help; source ./dev >/dev/null; setup_debian cmake mold; setup_debian cmake")
        self.assertEqual((done.returncode, done.stdout), (0, "==> installing Debian packages: mold\n"))
        calls = self.called.read_text().splitlines()
        self.assertEqual([call.split("update")[-1].strip() for call in calls if "install" in call],
                         [call for call in calls if call.endswith("install -y --no-install-recommends --no-remove mold")])
        self.assertEqual(len(calls), 2)


if __name__ == "__main__":
    unittest.main()
