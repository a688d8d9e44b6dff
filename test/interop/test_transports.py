"""The table of transports says what the tests of a run have shown, and no more."""
import re

import pytest

import transports
from processes import ROOT


def write(folder, stage, *cases):
    """cases: (name, what is within the test case)."""
    text = "".join(f'<testcase name="{name}">{within}</testcase>' for name, within in cases)
    (folder / f"{stage}.xml").write_text(f"<testsuites><testsuite>{text}</testsuite></testsuites>")


def says(what):
    return f'<properties><property name="carries" value="{what}"/></properties>'


def test_nothing_is_green_without_a_test(tmp_path):
    assert "| passed" not in transports.format_table(transports.collect(tmp_path))


def test_cells_are_those_of_both_sides(tmp_path):
    write(tmp_path, "interop", ("a", says("ours reference rr+tcp")), ("b", says("reference ours rr+ws rr+local")))
    assert transports.collect(tmp_path) == {
        ("rr+tcp", "direct", "our client"): ["passed"], ("rr+tcp", "direct", "reference service"): ["passed"],
        ("rr+ws", "gateway", "reference client"): ["passed"], ("rr+local", "gateway", "our service"): ["passed"]}


def test_one_failure_counts_more_than_what_passed(tmp_path):
    write(tmp_path, "interop", ("a", says("ours ours rr+tcp")), ("b", says("ours ours rr+tcp") + "<failure/>"),
          ("c", says("ours ours rr+tcp") + "<skipped/>"))
    (row,) = [line for line in transports.format_table(transports.collect(tmp_path)).splitlines() if line.startswith("| rr+tcp")]
    assert row.count("**FAILED** 1 of 2") == 2 and "passed" not in row


def test_what_passed_wins_over_a_reason_against_it(tmp_path):
    cell = next(iter(key for key in transports.REASONS if None not in key))
    assert "passed 1" in transports.format_table({cell: ["passed"]})


@pytest.mark.parametrize("stage, pattern", transports.EVIDENCE)
def test_the_tests_of_other_stages_are_there(stage, pattern):
    """A renamed test would leave its cell at "not run"."""
    places = {"usb": ["test/usb/run.py"], "native": [str(path.relative_to(ROOT)) for path in (ROOT / "test").glob("*/**/*_test.cpp")]}
    name = re.sub(r"^\w+/", "", pattern) if stage == "native" else pattern.split(":")[0]
    assert any(f'"{name}' in (ROOT / place).read_text() for place in places[stage]), name
