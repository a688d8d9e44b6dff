#!/usr/bin/env python3
"""./dev before it does anything: help, words that it does not know, and what it takes for missing. Programs that would install or
build something are replaced by ones that write down that they were called."""
import os
import pathlib
import pty
import shutil
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

    def test_fuzz_knows_its_words(self):
        for word in ("0", "1h", "fuzz_nothing", "--quik", "coverage"):
            self.check_refused(f'fuzz: unknown word "{word}"; expected --quick, minutes, or a target as fuzz_json', "fuzz", word)

    def test_fuzzers_run_side_by_side_and_one_that_finds_something_ends_no_other(self):
        targets = self.folder / "build/fuzz/test/fuzz"
        targets.mkdir(parents=True)
        shutil.copy(ROOT / "dev", self.folder)
        there, back = self.folder / "there", self.folder / "back"  # a waits for b, and b for a
        os.mkfifo(there)
        os.mkfifo(back)
        for name, text in {"a": f"echo >{there}; read _ <{back}", "c": "exit 0",
                           "b": f"read _ <{there}; echo >{back}; echo 'ERROR: found'; exit 77"}.items():
            self.put(targets.relative_to(self.folder) / f"fuzz_{name}", text)
        self.put("python3", '[ "$2" != --write ] || cat >"$3"')
        script = (f"set -- help; source {self.folder}/dev >/dev/null; build_preset() {{ :; }}; junit=$HOME/junit; jobs=2; "
                  "fuzz --quick || echo ended with $?")
        done = self.run_script("bash", "-c", script)
        results = "fuzz_a passed\nfuzz_b failed\nfuzz_c passed\n"
        self.assertTrue(done.stdout.endswith(f"\nERROR: found\n{results}ended with 1\n"), done.stdout + done.stderr)
        self.assertEqual((self.folder / "junit").read_text(), results)

    def test_what_can_be_simulated_is_listed_before_anything_is_built(self):
        done = self.run_script("./dev", "demo", "--list")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stdout, "(?m)^create +a mobile robot")
        self.assertFalse(self.called.exists())

    def test_unknown_words_are_refused_before_anything_is_done(self):
        self.check_refused('unknown command "biuld"', "biuld")
        self.check_refused('setup: unknown word "produkt"; expected product, or nothing', "setup", "produkt")
        self.check_refused('package: unknown word "imege"; expected --check, arm64 or image', "package", "imege")
        self.check_refused('package image: unknown architecture "mips"; expected amd64 or arm64', "package", "image", "amd64", "mips")
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

    def test_a_product_takes_nothing_that_only_tests_need(self):
        done = self.run_script("bash", "-c", "set -- help; source ./dev >/dev/null; echo ${product_packages[*]}; echo ${test_packages[*]}")
        product, tests = (line.split() for line in done.stdout.splitlines())
        for name in ("catch2", "python3-venv"):
            self.assertNotIn(name, product)
            self.assertIn(name, tests)

    def test_a_build_without_catch2_has_no_tests(self):
        self.put("cmake", f'echo "$@" >{self.called}')
        shutil.copy(ROOT / "dev", self.folder)
        (self.folder / "CMakePresets.json").touch()
        for package, expected in (("catch2", "ON"), ("cmake", "OFF")):
            self.put("dpkg-query", f"echo 'installed {package}, '")
            self.run_script("bash", "-c", f"set -- help; source {self.folder}/dev >/dev/null; configure release")
            self.assertIn(f"-DBUILD_TESTING={expected}", self.called.read_text().split())

    def test_sources_without_a_repository_are_built(self):
        """As in an image, whose sources are copied without .git."""
        self.put("npm", f'echo "$@" >>{self.called}')
        shutil.copy(ROOT / "dev", self.folder)
        (self.folder / "web").mkdir()
        done = self.run_script("bash", "-c", f"set -- help; source {self.folder}/dev >/dev/null; build_page")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.assertEqual(self.called.read_text(), "run --silent build\n")

    def test_in_ci_a_run_has_an_hour(self):
        script = "set -- help; source ./dev >/dev/null; SECONDS=4800; set -m; sleep 1000 & set +m; wait_in_time $! $HOME/log"
        self.assertEqual(self.run_script("bash", "-c", script).returncode, 130)  # by the signal
        self.assertEqual((self.folder / "log").read_text(), "\nnot done after 0 s: ended\n")

    def test_a_demo_says_first_what_it_installs_and_keeps_what_failed(self):
        self.put("node", "echo v18.20.4")
        self.put("apt-get", "echo Get:1 something; echo no such host >&2; exit 100")
        self.put("sudo", "shift; exec \"$@\"")  # for users who are not root
        shutil.copy(ROOT / "dev", self.folder)
        done = self.run_script(str(self.folder / "dev"), "demo")
        self.assertNotEqual(done.returncode, 0)
        lines = done.stdout.splitlines()
        self.assertRegex(lines[0], "^==> Debian packages to install, with what they need: ccache cmake .*emscripten.* python3-pip$")
        self.assertEqual(lines[1], "==> Node is to be installed from PyPI into build/deps/node")
        self.assertRegex(lines[2], "^==> then npm packages .*: about [0-9]+ minutes in all$")
        self.assertRegex(lines[3], "^==> installing Debian packages: ccache cmake")
        self.assertEqual(lines[-3:], ["Get:1 something", "no such host", "==> this failed; all of it is in build/demo.log"])
        self.assertTrue((self.folder / "build/demo.log").read_text().endswith("Get:1 something\nno such host\n"))

    def test_progress_is_one_line_at_a_terminal_and_none_elsewhere(self):
        told = ("==> installing Debian packages: mold", "Get:1 something", "0 upgraded, 2 newly installed, 0 to remove.",
                "Setting up mold (1)", "Setting up ninja (1)", "added 40 packages", "[1/2] Building", "[2/2] Linking", "warning: x")
        told_by_script = " ".join(f"'{line}'" for line in told)
        command = ("bash", "-c",
                   f"set -- help; source ./dev >/dev/null; printf '%s\\n' {told_by_script} | show_progress")
        self.assertEqual(self.run_script(*command).stdout, told[0] + "\n")
        ours, theirs = pty.openpty()
        subprocess.run(command, cwd=ROOT, stdout=theirs, timeout=20, check=True)
        os.close(theirs)
        shown = os.read(ours, 10000).decode().replace("\r\n", "\n")
        os.close(ours)
        self.assertEqual(shown.split("\r\x1b[K"),
                         ["", told[0] + "\n", "downloading 2 packages", "installing: 1 of 2 packages", "installing: 2 of 2 packages",
                          "building: 1 of 2", "building: 2 of 2", ""])

    def test_the_npm_package_names_the_repository_and_no_login(self):
        for url, expected in (("https://code.example.org/lab/rrgate.git", "git+https://code.example.org/lab/rrgate.git"),
                              ("https://user:secret@code.example.org/lab/rrgate.git", "git+https://code.example.org/lab/rrgate.git"),
                              ("git@code.example.org:lab/rrgate.git", "git+https://code.example.org/lab/rrgate.git"),
                              ("ssh://git@code.example.org:2222/lab/rrgate.git", "git+https://code.example.org/lab/rrgate.git"),
                              ("/srv/rrgate.git", ""), ("file:///srv/rrgate.git", "")):
            self.put("git", f"echo '{url}'")
            done = self.run_script("bash", "-c", "set -- help; source ./dev >/dev/null; public_repository")
            self.assertEqual((done.returncode, done.stdout.strip()), (0, expected), url)
        self.put("git", "exit 2")
        done = self.run_script("bash", "-c", "set -- help; source ./dev >/dev/null; x=$(public_repository) || true; echo \"[$x]\"")
        self.assertEqual(done.stdout, "[]\n")


if __name__ == "__main__":
    unittest.main()
