#!/usr/bin/env python3
"""Runs the benchmarks and says which aims are met: run.py --build DIRECTORY --report FILE. Ends with 1 where one is missed.

Ours and the yardstick are measured in turn within one run. Their ratio says how good ours is: times depend on machine and mood. Where
there is a promise in time as well, it is one that every machine should keep: a yardstick that is slow too hides nothing. Each process of the call benchmark is bound to a processor, and the report says which.
"""
import argparse
import json
import os
import pathlib
import platform
import subprocess
import sys
from dataclasses import dataclass

import agents
import calls
import relay


@dataclass
class Aim:
    """`limit` on ours/yardstick where `at_most`, else on yardstick/ours: speed as a share of the yardstick's. `kinds`
    are those of the figures that are held to it. `promise`: microseconds that ours takes at most, by the median."""
    text: str
    limit: float
    at_most: bool = True
    kinds: tuple = ("min", "mean")
    promise: float | None = None

    def ratio(self, result, kind):
        ours, yardstick = result["ours"][kind], result["yardstick"][kind]
        return ours / yardstick if self.at_most else yardstick / ours

    def __str__(self):
        promise = "" if self.promise is None else f", and <= {self.promise:.0f} us (p50)"
        return f"{'<=' if self.at_most else '>='} {self.limit} ({', '.join(self.kinds)}): {self.text}{promise}"

    def is_met(self, result):
        if self.promise is not None and result["ours"]["p50"] > self.promise * 1e3:
            return False
        ratios = [self.ratio(result, kind) for kind in self.kinds]
        return all(ratio <= self.limit if self.at_most else ratio >= self.limit for ratio in ratios)


@dataclass
class Delay:
    """`limit` on what ours takes more than the yardstick, in milliseconds."""
    limit: float
    kind: str = "p99"

    def is_met(self, result):
        return result["ours"][self.kind] - result["yardstick"][self.kind] <= self.limit * 1e6

    def ratio(self, result, kind):
        return result["ours"][kind] / result["yardstick"][kind]

    def __str__(self):
        return f"<= {self.limit:.0f} ms more ({self.kind})"


CALL = 200  # microseconds of an empty call between two processes
FIGURES = ("min", "p50", "p99", "mean")
AIMS = {
    "codec": Aim("at least half as fast as memcpy", 0.5, at_most=False),
    calls.SLOW: Delay(5),
    agents.NAME: Delay(1, "p50"),
    "relay": Aim("no slower than HAProxy in TCP mode (which differs from itself by 5 %)", 1.05),
    f"call, rr+tcp, {calls.ONE}": Aim("of a raw echo", 1.3, kinds=("p50",), promise=CALL),
    f"call, rr+tcp, {calls.TWO}": Aim("of a raw echo", 1.5, kinds=("p50",), promise=CALL),
    f"call, rr+ws, {calls.ONE}": Aim("of a raw TCP echo", 1.6, kinds=("p50",), promise=CALL),
    f"call, rr+ws, {calls.TWO}": Aim("of a raw TCP echo", 1.6, kinds=("p50",), promise=CALL),
}
MOST_BYTES = 32_000  # less than so many for an idle agent
MOST_ALLOCATIONS = 2  # less than so many for a call, client and service together


def aim_of(result):
    """None: for information."""
    return AIMS.get(result["name"]) or AIMS.get(result["name"].split(",")[0])


def is_met(result):
    if "each" in result:
        return result["each"] < MOST_ALLOCATIONS
    if "bytes" in result:
        return result["bytes"] < MOST_BYTES
    aim = aim_of(result)
    return aim is None or aim.is_met(result)


def results_of(build):
    yield from lines_of([build / "test" / "bench" / "bench_codec"])
    for command in calls.commands(build):
        yield from lines_of(command)
    for command in calls.slow_handlers(build):
        yield from lines_of(command)
    with relay.device(build) as device, relay.relays(build, device) as (ours, yardstick):
        yield from lines_of([build / "test" / "bench" / "bench_relay", ours, yardstick])
    yield from lines_of([sys.executable, pathlib.Path(agents.__file__), "--build", build])


def lines_of(command):
    output = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, text=True, timeout=300, check=True)
    return [json.loads(line) for line in output.stdout.splitlines()]


def report(results):
    lines = [f"{calls.placement()}.", "",
             f"| benchmark | ours: {', '.join(FIGURES)} | yardstick: {', '.join(FIGURES)} | ratio: {', '.join(FIGURES)} | aim | |",
             "|---|---|---|---|---|---|"]
    lines += [row(result) for result in results if "ours" in result]
    lines += ["", "| allocations | a call | aim | |", "|---|---|---|---|"]
    lines += [f"| {result['name'].removeprefix('allocations, ')}, client and service together | {result['each']:.2f} "
              f"| < {MOST_ALLOCATIONS} | {verdict(result)} |" for result in results if "each" in result]
    lines += ["", "| memory | each | aim | |", "|---|---|---|---|"]
    lines += [f"| {result['name'].removeprefix('memory, ')} | {result['bytes'] / 1000:.1f} kB | < {MOST_BYTES / 1000:.0f} kB "
              f"| {verdict(result)} |" for result in results if "bytes" in result]
    judged = [result for result in results if "each" in result or "bytes" in result or aim_of(result)]
    missed = sum(not is_met(result) for result in judged)
    lines += ["", f"{len(judged) - missed} aims met, {missed} missed; {platform.machine()}, {platform.processor() or 'processor unknown'}"]
    return "\n".join(lines) + "\n"


def row(result):
    aim = aim_of(result)
    times = [" ".join(f"{result[who][kind] / 1000:.1f}" for kind in FIGURES) + " us" for who in ("ours", "yardstick")]
    ratios = " ".join(f"{(aim or Aim('', 0)).ratio(result, kind):.2f}" for kind in FIGURES)
    return f"| {result['name']} | {times[0]} | {times[1]} | {ratios} | {aim or ''} | {verdict(result) if aim else ''} |"


def verdict(result):
    return "met" if is_met(result) else "**missed**"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--report", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    os.environ["RR_BUILD"] = str(arguments.build.resolve())
    results = list(results_of(arguments.build))
    text = report(results)
    arguments.report.parent.mkdir(parents=True, exist_ok=True)
    arguments.report.write_text("# Benchmarks\n\n" + text, encoding="utf-8")
    print(text)
    return 0 if results and all(is_met(result) for result in results) else 1


if __name__ == "__main__":
    sys.exit(main())
