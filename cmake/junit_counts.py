#!/usr/bin/env python3
"""Counts of a test run, from the JUnit file that its runner wrote.

junit_counts.py FILE          prints "passed failed skipped"; a missing or broken file counts as nothing
junit_counts.py --write FILE  makes a JUnit file of lines "name passed|failed" on standard input
"""
import sys
import xml.etree.ElementTree as ElementTree


def counts(path):
    passed = failed = skipped = 0
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError):
        return 0, 0, 0
    for case in root.iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None or case.get("status") == "fail":
            failed += 1
        elif case.find("skipped") is not None or case.get("status") in ("notrun", "disabled"):
            skipped += 1
        else:
            passed += 1
    return passed, failed, skipped


def write(path, lines):
    suite = ElementTree.Element("testsuite", name="fuzz")
    for line in lines:
        name, _, verdict = line.strip().partition(" ")
        case = ElementTree.SubElement(suite, "testcase", name=name)
        if verdict != "passed":
            ElementTree.SubElement(case, "failure", message=verdict)
    ElementTree.ElementTree(suite).write(path, encoding="utf-8", xml_declaration=True)


if __name__ == "__main__":
    if sys.argv[1] == "--write":
        write(sys.argv[2], sys.stdin)
    else:
        print(*counts(sys.argv[1]))
