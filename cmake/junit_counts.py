#!/usr/bin/env python3
"""Counts and verdict of a test run, from the JUnit file that its runner wrote.

junit_counts.py --judge FILE --status N [--machine FILE] [--strict] [--selected]
                                 prints "passed failed skipped", then why more failed than the runner says
junit_counts.py --failures FILE  prints name and output of what failed, shortened
junit_counts.py --skips FILE...  prints why tests were skipped, and how many
junit_counts.py --write FILE     makes a JUnit file of lines "name passed|failed|skipped [message]" on standard input

A run that left no readable file, ran no test, or ended badly without a failed test is one failure. A test may be skipped
for what the machine lacks, and says so: "needs NAME: why", with a NAME of capabilities.py. Where the machine has it, the
test failed. Skips for other reasons are counted, with --strict as failures. With --selected the runner was given a pattern: one
that lists all other tests as skipped did not skip them.
"""
import argparse
import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter


def read(path):
    """The test cases of a file. Raises OSError, ElementTree.ParseError."""
    return list(ElementTree.parse(path).getroot().iter("testcase"))


def cases(path):
    """Those of a file that may be missing or broken."""
    try:
        return read(path)
    except (OSError, ElementTree.ParseError):
        return []


def verdict_of(case):
    if case.find("failure") is not None or case.find("error") is not None or case.get("status") == "fail":
        return "failed"
    if case.find("skipped") is not None or case.get("status") in ("notrun", "disabled"):
        return "skipped"
    return "passed"


def skip_reason(case):
    skipped = case.find("skipped")
    if skipped is None:
        return ""
    by_property = next((each.get("value") for each in case.iter("property") if each.get("name") == "skip"), "")  # Playwright's
    return (skipped.get("message") or (skipped.text or "").strip() or by_property).strip()


def needed(reason):
    """The capability that a skipped test asked for, None where it gives another reason."""
    found = re.match(r"needs ([\w-]+):", reason)
    return found and found[1]


def judge(path, status, machine, is_strict, is_selected):
    """([passed, failed, skipped], complaints). `machine`: {capability: why this machine lacks it, None where it has it}."""
    try:
        found = read(path)
    except OSError:
        return [0, 1, 0], ["no report: its runner left no JUnit file"]
    except ElementTree.ParseError as problem:
        return [0, 1, 0], [f"no report: its runner left a broken JUnit file: {problem}"]
    counts, complaints = Counter(), []
    has_need = False
    for case in found:
        verdict = verdict_of(case)
        if verdict == "skipped":
            verdict, complaint = judge_skip(case, machine, is_strict, is_selected)
            complaints += [complaint] if complaint else []
            has_need = has_need or needed(skip_reason(case)) is not None
        counts[verdict] += 1
    if not counts["passed"] + counts["failed"] and not has_need:
        counts["failed"] = 1
        complaints.append("ran no test")
    elif status != 0 and not counts["failed"]:
        counts["failed"] = 1
        complaints.append(f"ended with {status}, though no test failed")
    return [counts[verdict] for verdict in ("passed", "failed", "skipped")], complaints


def judge_skip(case, machine, is_strict, is_selected):
    """(verdict, complaint or None)."""
    name, reason = case.get("name"), skip_reason(case)
    capability = needed(reason)
    if capability is None:
        if is_selected and not reason:
            return "not selected", None
        return ("failed", f"skipped without need: {name}: {reason}") if is_strict else ("skipped", None)
    if capability not in machine:
        return "failed", f'skipped for "{capability}", which nobody asks the machine for: {name}'
    if machine[capability] is None:
        return "failed", f'skipped for "{capability}", which this machine has: {name}'
    return "skipped", None


def failures(path, most=20):
    failed = [case for case in cases(path) if verdict_of(case) == "failed"]
    for case in failed[:most]:
        print(f"--- {case.get('name')}")
        texts = [text for part in case for text in (part.get("message"), part.text) if text and text.strip()]
        for text in texts[:3]:
            lines = text.strip().splitlines()
            print("\n".join(lines[:5] + ["..."] + lines[-25:] if len(lines) > 30 else lines))
    if len(failed) > most:
        print(f"--- and {len(failed) - most} more")


def skips(paths):
    reasons = Counter(skip_reason(case) or "no reason given"
                      for path in paths for case in cases(path) if verdict_of(case) == "skipped")
    for reason, count in reasons.most_common():
        print(f"{count} skipped: {reason}")


def write(path, lines):
    suite = ElementTree.Element("testsuite", name="dev")
    for line in lines:
        name, verdict, *message = line.strip().split(" ", 2)
        case = ElementTree.SubElement(suite, "testcase", name=name)
        if verdict == "skipped":
            ElementTree.SubElement(case, "skipped", message="".join(message))
        elif verdict != "passed":
            ElementTree.SubElement(case, "failure", message="".join(message) or verdict)
    ElementTree.ElementTree(suite).write(path, encoding="utf-8", xml_declaration=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--judge", metavar="FILE")
    action.add_argument("--failures", metavar="FILE")
    action.add_argument("--skips", metavar="FILE", nargs="*")
    action.add_argument("--write", metavar="FILE")
    parser.add_argument("--status", type=int, default=0, help="exit code of the runner")
    parser.add_argument("--machine", metavar="FILE", help="what capabilities.py wrote")
    parser.add_argument("--strict", action="store_true")
    parser.add_argument("--selected", action="store_true")
    arguments = parser.parse_args()
    if arguments.write:
        write(arguments.write, sys.stdin)
    elif arguments.failures:
        failures(arguments.failures)
    elif arguments.skips is not None:
        skips(arguments.skips)
    else:
        machine = {}
        if arguments.machine:
            with open(arguments.machine, encoding="utf-8") as file:
                machine = json.load(file)
        counts, complaints = judge(arguments.judge, arguments.status, machine, arguments.strict, arguments.selected)
        print(*counts)
        print(*complaints, sep="\n")


if __name__ == "__main__":
    main()
