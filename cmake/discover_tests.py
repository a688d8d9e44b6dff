#!/usr/bin/env python3
"""Lists the test cases of a Catch2 program as ctest tests, whatever characters their names have.

discover_tests.py OUTPUT PREFIX PROGRAM [WORD...]    WORDs start the program: "node --flag program.js"; else PROGRAM does

Catch2's own script hands names through CMake lists, where a semicolon cuts a name in two; both halves then match no
test, and pass.
"""
import subprocess
import sys

SPECIAL = '\\,[]"'  # of test specifications; a backslash before makes them ordinary
BRACKET = "]=====]"


# How each version of Catch2 lists its tests, and what it takes to run one without colour and to fail where there is none.
VERSIONS = (
    (("--list-test-names-only",), ("--use-colour", "no", "--warn", "NoTests")),  # 2
    (("--list-tests", "--verbosity", "quiet"), ("--colour-mode", "none")),  # 3
)


def names_of(command):
    """The names of its tests, and what runs one of them."""
    for to_list, to_run in VERSIONS:
        listing = subprocess.run([*command, *to_list], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False)
        # The exit code of 2 is the number of tests. A name that begins with "#" comes quoted.
        if names := [line[1:-1] if line.startswith('"#') else line for line in listing.stdout.splitlines() if line]:
            return names, to_run
    return [], ()


def specification(name):
    return "".join("\\" + letter if letter in SPECIAL else letter for letter in name)


def bracketed(text):
    assert BRACKET not in text
    return f"[=====[{text}]=====]"


def main(output, prefix, program, *starter):
    command = list(starter) or [program]
    names, to_run = names_of(command)
    if not names:
        sys.exit(f"{program} lists no tests")
    with open(output, "w", encoding="utf-8") as file:
        for name in names:
            words = [*command, specification(name), *to_run]
            file.write(f"add_test({bracketed(prefix + name)} {' '.join(map(bracketed, words))})\n")
            file.write(f"set_tests_properties({bracketed(prefix + name)} PROPERTIES TIMEOUT 300)\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
