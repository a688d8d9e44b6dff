#!/usr/bin/env python3
"""Writes cpp_macros.inc and cpp_globals.inc: names that the headers of generated C++ take.

Run by hand, with g++ and the headers of the C library on Linux: python3 node/generate/cpp_taken_names.py
"""

import os
import pathlib
import re
import subprocess
import textwrap

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COMPILE = ["g++", "-std=gnu++20", f"-I{ROOT}/include", f"-I{ROOT}", "-x", "c++", "-"]
INCLUDES = '#include "rrgate/client.hpp"\n#include "rrgate/device.hpp"\n'
NAME = re.compile(r"[A-Za-z](\w*[A-Za-z0-9])?", re.ASCII)  # as the language of definitions has them
# Left out are names that no definition is expected to have: macros of Boost, numbers of system calls, and services
# whose first word has more than small letters.
LEFT_OUT = ("BOOST_", "SYS_")
FIRST_WORD = re.compile(r"[a-z]+")


def run(*options: str, source: str, check: bool = True) -> subprocess.CompletedProcess:
    environment = {**os.environ, "LC_ALL": "C"}  # for the text of errors
    return subprocess.run(
        [*COMPILE, *options], input=source, stdout=subprocess.PIPE, stderr=None if check else subprocess.PIPE,
        text=True, check=check, env=environment
    )


def macros() -> set[str]:
    """All but those that are defined as themselves, which replace nothing."""
    found = re.findall(r"^#define (\w+)(?:\([^)]*\))? ?(.*)$", run("-E", "-dM", source=INCLUDES).stdout, re.MULTILINE)
    return {name for name, text in found if NAME.fullmatch(name) and text != name and not name.startswith(LEFT_OUT)}


def global_names(taken: set[str]) -> set[str]:
    """Functions, variables and types: the compiler refuses a namespace of the same name."""
    words = set(re.findall(r"\w+", run("-E", "-P", source=INCLUDES).stdout, re.ASCII))
    names = {word for word in words - taken if FIRST_WORD.fullmatch(word)}
    tried = INCLUDES + "".join(f"namespace {name} {{}}\n" for name in sorted(names))
    errors = run("-fsyntax-only", "-fmax-errors=0", source=tried, check=False).stderr
    return names & set(re.findall(r"error: 'namespace (\w+) { }' redeclared", errors))


def write(file: str, names: set[str]) -> None:
    text = textwrap.fill(", ".join(f'"{name}"' for name in sorted(names)), 120, break_on_hyphens=False)
    (HERE / file).write_text(f"// Made by cpp_taken_names.py.\n{text}\n")


if __name__ == "__main__":
    all_macros = macros()
    write("cpp_macros.inc", all_macros)
    write("cpp_globals.inc", global_names(all_macros))
