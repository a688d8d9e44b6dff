#!/usr/bin/env python3
"""Keeps cpp_macros.inc and cpp_globals.inc: names that the headers of generated C++ take.

cpp_taken_names.py          adds what this machine's headers have; what those of another compiler or C library have stays
cpp_taken_names.py --check  fails where this machine's headers have names that the lists lack, and prints them

Needs g++ and the headers of the C library on Linux.
"""

import os
import pathlib
import re
import subprocess
import sys
import textwrap

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
FOLDERS = [ROOT / "include", ROOT, ROOT / "build/deps/boost181/usr/include"]  # the last: where the system's Boost is older
COMPILE = ["g++", "-std=gnu++20", *(f"-I{folder}" for folder in FOLDERS), "-x", "c++", "-"]
INCLUDES = '#include "rrgate/client.hpp"\n#include "rrgate/device.hpp"\n'
# As the language of definitions has names. Left out are those that no definition is expected to have: macros of Boost,
# numbers of system calls, and include guards.
NAME = re.compile(r"(?!BOOST_|SYS_)(?!\w*_(?:H|HPP)\b)[A-Za-z](?:\w*[A-Za-z0-9])?", re.ASCII)


def run(*options: str, source: str, check: bool = True) -> subprocess.CompletedProcess:
    environment = {**os.environ, "LC_ALL": "C"}  # for the text of errors
    return subprocess.run(
        [*COMPILE, *options], input=source, stdout=subprocess.PIPE, stderr=None if check else subprocess.PIPE,
        text=True, check=check, env=environment
    )


def macros() -> dict[str, str]:
    """By name what replaces it."""
    text = run("-E", "-dM", source=INCLUDES).stdout
    return dict(re.findall(r"^#define (\w+)(?:\([^)]*\))? ?(.*)$", text, re.MULTILINE))


def global_names(taken: set[str]) -> set[str]:
    """Functions, variables and types: the compiler refuses a namespace of the same name."""
    words = set(re.findall(r"\w+", run("-E", "-P", source=INCLUDES).stdout, re.ASCII))
    names = {word for word in words - taken if NAME.fullmatch(word)}
    tried = INCLUDES + "".join(f"namespace {name} {{}}\n" for name in sorted(names))
    errors = run("-fsyntax-only", "-fmax-errors=0", source=tried, check=False).stderr
    return names & set(re.findall(r"error: 'namespace (\w+) { }' redeclared", errors))


def names_of_headers() -> dict[str, set[str]]:
    """By the file that lists them. A macro that is defined as itself replaces nothing."""
    replaced = {name for name, text in macros().items() if text != name}
    return {"cpp_macros.inc": {name for name in replaced if NAME.fullmatch(name)}, "cpp_globals.inc": global_names(replaced)}


def listed(folder: pathlib.Path, file: str) -> set[str]:
    return {name for name in re.findall(r'"(\w+)"', (folder / file).read_text()) if NAME.fullmatch(name)}


def lacking(folder: pathlib.Path, found: dict[str, set[str]]) -> list[str]:
    return [f"{file} lacks {name}" for file, names in found.items() for name in sorted(names - listed(folder, file))]


def add(folder: pathlib.Path, found: dict[str, set[str]]) -> None:
    for file, names in found.items():
        quoted = ", ".join(f'"{name}"' for name in sorted(names | listed(folder, file)))
        text = textwrap.fill(quoted, 120, break_on_hyphens=False)
        (folder / file).write_text(f"// Made by cpp_taken_names.py.\n{text}\n")


def main(words: list[str]) -> int:
    found = names_of_headers()
    if words != ["--check"]:
        add(HERE, found)
        return 0
    problems = lacking(HERE, found)
    if problems:
        print(*problems, "python3 node/generate/cpp_taken_names.py adds them", sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
