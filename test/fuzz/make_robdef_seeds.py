#!/usr/bin/env python3
"""First inputs of the definition parser's fuzzer, good and bad: make_robdef_seeds.py DIRECTORY"""
import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def definitions():
    for path in sorted(ROOT.glob("test/golden/**/robdef-cases.json")):
        for case in json.loads(path.read_text(encoding="utf-8")):
            yield case["name"], case["text"].encode("utf-8", "surrogatepass")
    for path in sorted([*ROOT.glob("robdef/**/*.robdef"), *ROOT.glob("test/interop/*.robdef")]):
        yield path.name, path.read_bytes()


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for name, text in definitions():
        (target / name.replace("/", "_").replace(" ", "_")).write_bytes(text)
