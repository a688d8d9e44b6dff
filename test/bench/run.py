#!/usr/bin/env python3
"""Runs the benchmarks and says which aims are met: run.py --build DIRECTORY --report FILE

Ours and the yardstick are measured in turn within one run. Only their ratio means something: times depend on machine
and mood. Minimum and mean (of all but the slowest hundredth) are both held to the aim.
"""
import argparse
import json
import pathlib
import platform
import subprocess
import sys
from dataclasses import dataclass

import relay


@dataclass
class Aim:
    """`limit` on ours/yardstick where `at_most`, else on yardstick/ours: speed as a share of the yardstick's."""
    text: str
    limit: float
    at_most: bool


AIMS = {
    "codec": Aim("at least half as fast as memcpy", 0.5, at_most=False),
    "call": Aim("at most twice the time of a raw echo", 2.0, at_most=True),
    "relay": Aim("no slower than HAProxy in TCP mode (which differs from itself by 5 %)", 1.05, at_most=True),
}


def judge(result):
    aim = AIMS[result["name"].split(",")[0]]
    ratios = {}
    for kind in ("min", "mean"):
        ours, yardstick = result["ours"][kind], result["yardstick"][kind]
        ratios[kind] = ours / yardstick if aim.at_most else yardstick / ours
    is_met = all(ratio <= aim.limit if aim.at_most else ratio >= aim.limit for ratio in ratios.values())
    return aim, ratios, is_met


def results_of(build):
    bench = build / "test" / "bench"
    yield from lines_of([bench / "bench_codec"])
    with relay.device(build) as device:
        yield from lines_of([bench / "bench_call", device])
        with relay.relays(build, device) as (ours, yardstick):
            yield from lines_of([bench / "bench_relay", ours, yardstick])


def lines_of(command):
    output = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, text=True, timeout=300, check=True)
    return [json.loads(line) for line in output.stdout.splitlines()]


def report(results):
    lines = ["| benchmark | ours min | yardstick min | ratio min | ratio mean | aim | |", "|---|---|---|---|---|---|---|"]
    missed = 0
    for result in results:
        aim, ratios, is_met = judge(result)
        missed += not is_met
        sign = "<=" if aim.at_most else ">="
        lines.append(
            f"| {result['name']} | {result['ours']['min'] / 1000:.1f} us | {result['yardstick']['min'] / 1000:.1f} us "
            f"| {ratios['min']:.2f} | {ratios['mean']:.2f} | {sign} {aim.limit}: {aim.text} | {'met' if is_met else '**missed**'} |")
    lines.append("")
    lines.append(f"{len(results) - missed} aims met, {missed} missed; {platform.machine()}, {platform.processor() or 'processor unknown'}")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--report", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    results = list(results_of(arguments.build))
    text = report(results)
    arguments.report.parent.mkdir(parents=True, exist_ok=True)
    arguments.report.write_text("# Benchmarks\n\n" + text, encoding="utf-8")
    print(text)
    return 0 if results else 1


if __name__ == "__main__":
    sys.exit(main())
