#!/usr/bin/env python3
"""Measures pages in Chromium, Firefox and WebKit: browser.py --report FILE [PLAYWRIGHT'S OPTIONS]

Ends with 1 where something is missed. Programs are those of build/release.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from rows import Row, publish

E2E = pathlib.Path(__file__).resolve().parents[1] / "e2e"


def measure(options):
    with tempfile.TemporaryDirectory() as scratch:
        rows = pathlib.Path(scratch) / "rows.json"
        command = ["npx", "playwright", "test", "--config", "bench.config.ts", *options]
        subprocess.run(command, cwd=E2E, env={**os.environ, "ROWS": str(rows)}, check=True)
        for row in json.loads(rows.read_text()):
            yield Row(row["text"], row["ours"], None, row["unit"], promise=row.get("promise"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", type=pathlib.Path, required=True)
    arguments, options = parser.parse_known_args()
    return publish(arguments.report, "Pages", "pages", measure(options))


if __name__ == "__main__":
    sys.exit(main())
