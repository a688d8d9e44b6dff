#!/usr/bin/env python3
"""Counts of a test run, from the JUnit file that its runner wrote.

junit_counts.py FILE             prints "passed failed skipped"; a missing or broken file counts as nothing
junit_counts.py --failures FILE  prints name and output of what failed, shortened
junit_counts.py --write FILE     makes a JUnit file of lines "name passed|failed|skipped" on standard input
"""
import sys
import xml.etree.ElementTree as ElementTree


def cases(path):
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError):
        return
    yield from root.iter("testcase")


def verdict_of(case):
    if case.find("failure") is not None or case.find("error") is not None or case.get("status") == "fail":
        return "failed"
    if case.find("skipped") is not None or case.get("status") in ("notrun", "disabled"):
        return "skipped"
    return "passed"


def counts(path):
    verdicts = [verdict_of(case) for case in cases(path)]
    return [verdicts.count(verdict) for verdict in ("passed", "failed", "skipped")]


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


def write(path, lines):
    suite = ElementTree.Element("testsuite", name="fuzz")
    for line in lines:
        name, _, verdict = line.strip().partition(" ")
        case = ElementTree.SubElement(suite, "testcase", name=name)
        if verdict == "skipped":
            ElementTree.SubElement(case, "skipped")
        elif verdict != "passed":
            ElementTree.SubElement(case, "failure", message=verdict)
    ElementTree.ElementTree(suite).write(path, encoding="utf-8", xml_declaration=True)


if __name__ == "__main__":
    if sys.argv[1] == "--write":
        write(sys.argv[2], sys.stdin)
    elif sys.argv[1] == "--failures":
        failures(sys.argv[2])
    else:
        print(*counts(sys.argv[1]))
