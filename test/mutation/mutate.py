#!/usr/bin/env python3
"""Breaks C++ files on purpose, and lists what no test notices: mutate.py [--seed S] [--tests PROGRAM,...] FILE|FOLDER... [N]

N mutants (60) are chosen by seed: comparisons and their bounds, conditions, parts of && and ||, constants that are returned,
1 instead of 0, statements that are left out. All of one file are compiled into one object (together with the files of its unity
build), and an environment variable chooses; so each takes one run of the tests, which ends with the first failure. The build in
build/release has to be there. Ends with 1 where fewer than --least percent (0) are noticed.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import random
import re
import shlex
import subprocess
import sys
import time

from mutants import SWITCH, apart, mutants, with_all

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "release"
SCRATCH = ROOT / "build" / "mutation"
# The tests of what lies below a folder; the first that fits counts.
TESTS = {
    "core/session/": ["test/core/session/test_session", "test/core/session/test_replay"],
    "core/member/": ["test/core/member/test_member", "test/core/session/test_session"],
    "core/wire/": ["test/core/wire/test_wire"],
    "core/types/": ["test/core/types/test_types"],
    "core/support/": ["test/core/support/test_support"],
    "core/discovery/": ["test/core/discovery/test_discovery"],
    "server/access/": ["test/server/access/test_access", "test/server/test_server"],
    "server/json/": ["test/server/json/test_json"],
    "server/upstream/": ["test/server/upstream/test_upstream", "test/server/test_gateway"],
    "server/": ["test/server/test_server", "test/server/test_gateway"],
    "node/http/": ["test/server/test_server"],
}


def run(command, **more):
    return subprocess.run(command, cwd=BUILD, capture_output=True, text=True, errors="replace", **more)


def without_dependencies(command):
    """A compiler's command that leaves the notes of the build alone."""
    out = []
    for word in command:
        if out and out[-1] in ("-MF", "-MT"):
            out.pop()
        elif word != "-MD":
            out.append(word)
    return out


class Unit:
    """What is compiled: a file alone, or the unity file that it is a part of."""

    def __init__(self, file):
        self.file = file
        for entry in json.loads((BUILD / "compile_commands.json").read_text()):
            unit = pathlib.Path(entry["directory"], entry["file"])
            if unit == file or ("Unity" in unit.parts and f'"{file}"' in unit.read_text()):
                self.unit, self.command = unit, shlex.split(entry["command"])
                return
        raise SystemExit(f"{file.relative_to(ROOT)} is compiled by nothing in build/release")

    def compile(self, numbered, folder):
        """The object with these mutants, without those that do not compile: (object, {number: mutant})."""
        mutated, unit, done = folder / self.file.name, folder / "unit.cpp", folder / "unit.o"
        text = self.file.read_text()
        command = without_dependencies(self.command)
        command[command.index("-o") + 1], command[-1] = str(done), str(unit)
        for _ in range(6):
            mutated.write_text(SWITCH + "#line 1\n" + with_all(text, numbered))
            unit.write_text(f'#include "{mutated}"\n' if self.unit == self.file else
                            self.unit.read_text().replace(f'"{self.file}"', f'"{mutated}"'))
            made = run([*command, "-w", "-fmax-errors=0"])
            if made.returncode == 0:
                return done, numbered
            wrong = {int(line) for line in re.findall(rf"{re.escape(str(mutated))}:(\d+):", made.stderr)}
            left = {number: one for number, one in numbered.items() if one.line(text) not in wrong}
            if len(left) == len(numbered):
                raise SystemExit(made.stderr[-4000:])
            numbered = left
        raise SystemExit(f"{self.file.relative_to(ROOT)}: what was broken does not compile:\n{made.stderr[-4000:]}")


def link(program, made, into):
    """The object comes before the library that has the same, which then is not taken from there."""
    printed = run(["ninja", "-t", "commands", "-s", program]).stdout.strip().splitlines()
    if not printed:
        raise SystemExit(f"no test {program} in build/release")
    command = shlex.split(printed[-1].split(" && ")[1])
    at = command.index("-o")
    command[at + 1] = str(into)
    done = run([*command[:at], str(made), *command[at:]])
    if done.returncode:
        raise SystemExit(done.stderr[-4000:])


def passes(programs, number, limit):
    for program in programs:
        try:
            if subprocess.run([program, "--abort"], env={**os.environ, "RR_MUTANT": str(number)}, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL, timeout=limit).returncode:
                return False
        except subprocess.TimeoutExpired:
            return False
    return True


def tests_of(file):
    name = str(file.relative_to(ROOT))
    for folder, tests in TESTS.items():
        if name.startswith(folder):
            return tests
    raise SystemExit(f"{name}: say by --tests which tests are to notice")


def judge(file, chosen, tests):
    """(how many were tried, [those that survive])"""
    folder = SCRATCH / file.relative_to(ROOT).with_suffix("")
    folder.mkdir(parents=True, exist_ok=True)
    made, numbered = Unit(file).compile(dict(enumerate(chosen, 1)), folder)
    programs = []
    for test in tests:
        programs.append(folder / pathlib.Path(test).name)
        link(test, made, programs[-1])
    began = time.monotonic()
    if not passes(programs, 0, 300):
        raise SystemExit(f"{file.relative_to(ROOT)}: its tests fail where nothing is broken")
    limit = 3 * (time.monotonic() - began) + 10
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        alive = list(pool.map(lambda number: passes(programs, number, limit), numbered))
    for program in programs:
        program.unlink()
    return len(numbered), [one for one, is_alive in zip(numbered.values(), alive) if is_alive]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tests", help="programs below build/release, with commas between")
    parser.add_argument("--least", type=float, default=0)
    parser.add_argument("--list-tests", action="store_true", help="print which targets have to be built, and do nothing")
    parser.add_argument("what", nargs="+", metavar="FILE|FOLDER|N")
    arguments = parser.parse_args()
    count = 60
    files = []
    for each in arguments.what:
        path = (pathlib.Path.cwd() / each).resolve()
        if each.isdigit():
            count = int(each)
        elif path.is_dir():
            files += sorted(path.rglob("*.cpp"))
        elif path.is_file():
            files.append(path)
        else:
            raise SystemExit(f"{each}: no file, no folder and no number")
    wanted = {file: arguments.tests.split(",") if arguments.tests else tests_of(file) for file in files}
    if arguments.list_tests:
        print(*sorted({pathlib.Path(test).name for tests in wanted.values() for test in tests}))
        return 0
    all_there_are = [(file, one) for file in files for one in mutants(file.read_text())]
    chosen = random.Random(arguments.seed).sample(all_there_are, min(count, len(all_there_are)))
    print(f"{len(chosen)} of {len(all_there_are)} mutants, seed {arguments.seed}", flush=True)
    tried, survivors = 0, []
    for file in files:
        of_file = apart(sorted((one for other, one in chosen if other == file), key=lambda one: (one.start, one.end)))
        if not of_file:
            continue
        text = file.read_text()
        of_this, alive = judge(file, of_file, wanted[file])
        tried += of_this
        for one in alive:
            survivors.append(one)
            line = one.line(text)
            print(f"{file.relative_to(ROOT)}:{line}: {one.kind}: {text[one.start:one.end].strip()[:100]!r} survives", flush=True)
    share = 100 * (tried - len(survivors)) / max(1, tried)
    print(f"{tried} tried, {tried - len(survivors)} noticed ({share:.0f} %), {len(survivors)} survive")
    return 0 if tried and share >= arguments.least else 1


if __name__ == "__main__":
    sys.exit(main())
