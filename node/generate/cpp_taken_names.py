#!/usr/bin/env python3
"""Writes cpp_macros.inc: names that the headers of generated C++ take.

Run by hand, with g++ and the headers of the C library on Linux: python3 node/generate/cpp_taken_names.py
"""

import pathlib
import re
import subprocess
import textwrap

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
COMPILE = ["g++", "-std=gnu++20", f"-I{ROOT}/include", f"-I{ROOT}", "-x", "c++", "-"]
INCLUDES = '#include "rrgate/client.hpp"\n#include "rrgate/device.hpp"\n'
NAME = re.compile(r"[A-Za-z](\w*[A-Za-z0-9])?", re.ASCII)  # as the language of definitions has them
# Left out are names that no definition is expected to have: macros of Boost, and numbers of system calls.
LEFT_OUT = ("BOOST_", "SYS_")


def macros() -> set[str]:
    """All but those that are defined as themselves, which replace nothing."""
    command = [*COMPILE, "-E", "-dM"]
    text = subprocess.run(command, input=INCLUDES, stdout=subprocess.PIPE, text=True, check=True).stdout
    found = re.findall(r"^#define (\w+)(?:\([^)]*\))? ?(.*)$", text, re.MULTILINE)
    return {name for name, value in found if NAME.fullmatch(name) and value != name and not name.startswith(LEFT_OUT)}


def write(file: str, names: set[str]) -> None:
    text = textwrap.fill(", ".join(f'"{name}"' for name in sorted(names)), 120, break_on_hyphens=False)
    (HERE / file).write_text(f"// Made by cpp_taken_names.py.\n{text}\n")


if __name__ == "__main__":
    write("cpp_macros.inc", macros())
