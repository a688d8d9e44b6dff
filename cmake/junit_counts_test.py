#!/usr/bin/env python3
"""What the verdict makes of good, bad and missing reports, and the stages of ./dev that are judged by it."""
import contextlib
import io
import json
import pathlib
import subprocess
import tempfile
import unittest

import junit_counts

ROOT = pathlib.Path(__file__).resolve().parents[1]
MACHINE = {"network": None, "guest": "there is no kernel"}
PASSED = '<testcase name="good"/>'
FAILED = '<testcase name="bad"><failure message="wrong"/></testcase>'


def skipped(reason):
    return f'<testcase name="left out"><skipped message="{reason}"/></testcase>'


def report(*cases):
    return f"<testsuites><testsuite>{''.join(cases)}</testsuite></testsuites>"


class Verdict(unittest.TestCase):
    def judge(self, text, status=0, is_strict=False, is_selected=False):
        """(counts, complaints) of a report; None: there is none."""
        with tempfile.TemporaryDirectory() as scratch:
            path = pathlib.Path(scratch, "stage.xml")
            if text is not None:
                path.write_text(text, encoding="utf-8")
            counts, complaints = junit_counts.judge(path, status, MACHINE, is_strict, is_selected)
            return counts, "\n".join(complaints)

    def test_what_passed_and_failed_is_counted(self):
        self.assertEqual(self.judge(report(PASSED, PASSED, FAILED), status=1), ([2, 1, 0], ""))

    def test_every_runner_has_its_way_to_say_so(self):
        for case, verdict in [('<testcase status="run"/>', "passed"), ('<testcase status="fail"/>', "failed"),
                              ('<testcase status="notrun"/>', "skipped"), ('<testcase status="disabled"/>', "skipped"),
                              ("<testcase><error/></testcase>", "failed"), ("<testcase><skipped/></testcase>", "skipped")]:
            with self.subTest(case):
                self.assertEqual(junit_counts.verdict_of(junit_counts.ElementTree.fromstring(case)), verdict)

    def test_without_a_report_the_stage_failed(self):
        counts, why = self.judge(None)
        self.assertEqual(counts, [0, 1, 0])
        self.assertIn("left no JUnit file", why)

    def test_with_a_broken_report_the_stage_failed(self):
        for text in ("", "<testsuites>", report(PASSED)[:-5], "all is well"):
            with self.subTest(text):
                counts, why = self.judge(text)
                self.assertEqual(counts, [0, 1, 0])
                self.assertIn("broken JUnit file", why)

    def test_a_stage_that_ran_no_test_failed(self):
        self.assertEqual(self.judge(report()), ([0, 1, 0], "ran no test"))

    def test_a_stage_whose_tests_are_all_skipped_failed(self):
        for is_selected in (False, True):
            counts, why = self.judge(report(skipped(""), skipped("")), is_selected=is_selected)
            self.assertEqual((counts[:2], why), ([0, 1], "ran no test"))

    def test_a_bad_end_is_a_failure_though_all_tests_passed(self):
        self.assertEqual(self.judge(report(PASSED), status=139), ([1, 1, 0], "ended with 139, though no test failed"))

    def test_what_the_machine_lacks_is_skipped(self):
        for is_strict in (False, True):
            self.assertEqual(self.judge(report(skipped("needs guest: there is no kernel")), is_strict=is_strict), ([0, 0, 1], ""))

    def test_the_reason_of_a_skip_may_be_a_property_as_playwright_writes_it(self):
        reason = '<properties><property name="skip" value="needs guest: there is no kernel"/></properties>'
        case = f'<testcase name="left out">{reason}<skipped>\n</skipped></testcase>'
        self.assertEqual(self.judge(report(PASSED, case), is_strict=True), ([1, 0, 1], ""))

    def test_what_the_machine_has_cannot_be_skipped(self):
        counts, why = self.judge(report(PASSED, skipped("needs network: ip: command not found")))
        self.assertEqual(counts, [1, 1, 0])
        self.assertIn('skipped for "network", which this machine has: left out', why)

    def test_what_nobody_asks_the_machine_for_cannot_be_skipped(self):
        counts, why = self.judge(report(PASSED, skipped("needs luck: none")))
        self.assertEqual(counts, [1, 1, 0])
        self.assertIn('"luck"', why)

    def test_other_skips_fail_where_it_is_strict(self):
        some = report(PASSED, skipped("too slow"))
        self.assertEqual(self.judge(some), ([1, 0, 1], ""))
        self.assertEqual(self.judge(some, is_strict=True), ([1, 1, 0], "skipped without need: left out: too slow"))

    def test_what_a_pattern_left_out_is_not_skipped(self):
        self.assertEqual(self.judge(report(PASSED, skipped("")), is_strict=True, is_selected=True), ([1, 0, 0], ""))

    def test_what_is_written_can_be_judged(self):
        with tempfile.TemporaryDirectory() as scratch:
            path = pathlib.Path(scratch, "stage.xml")
            junit_counts.write(path, ["a passed", "b failed", "usb skipped needs guest: there is no kernel"])
            self.assertEqual(junit_counts.judge(path, 0, MACHINE, True, False), ([1, 1, 1], []))
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                junit_counts.skips([path])
            self.assertEqual(said.getvalue(), "1 skipped: needs guest: there is no kernel\n")


class Stages(unittest.TestCase):
    """./dev, as it runs a stage of ours."""

    def run_stages(self, *stages, before="", **environment):
        """(exit code, what was printed). A stage is what its function does; "$junit" is where its report belongs."""
        with tempfile.TemporaryDirectory() as scratch:
            machine = pathlib.Path(scratch, "machine.json")
            machine.write_text(json.dumps(MACHINE), encoding="utf-8")
            functions = [f"stage_{number}() {{ {stage}; }}" for number, stage in enumerate(stages)]
            runs = [f"run_stage stage{number} stage_{number}" for number in range(len(stages))]
            script = "\n".join(["set -- help; source ./dev >/dev/null", f"logs={scratch}/logs; machine={machine}", *functions,
                                "begin_stages", before, *runs, "finish_stages"])
            done = subprocess.run(["bash", "-c", script], cwd=ROOT, env={"PATH": "/usr/bin:/bin:/usr/sbin", **environment},
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
            return done.returncode, done.stdout

    def write(self, *cases):
        return f"echo '{report(*cases)}' >\"$junit\""

    def check_end(self, result, code, last):
        self.assertEqual((result[0], result[1].splitlines()[-1]), (code, last), result[1])

    def test_the_last_line_has_the_sum(self):
        self.check_end(self.run_stages(self.write(PASSED), self.write(PASSED, PASSED)), 0, "3 passed, 0 failed")
        self.check_end(self.run_stages(self.write(PASSED), self.write(PASSED, FAILED)), 1, "2 passed, 1 failed")

    def test_a_stage_without_a_report_fails_the_run(self):
        self.check_end(self.run_stages(self.write(PASSED), "true"), 1, "1 passed, 1 failed")

    def test_the_report_of_an_earlier_run_is_none(self):
        self.check_end(self.run_stages(self.write(PASSED), 'echo "$junit"; test ! -e "$junit"'), 1, "1 passed, 1 failed")

    def test_a_stage_that_ends_at_a_command_which_fails(self):
        self.check_end(self.run_stages(f"{self.write(PASSED)}; false; echo never"), 1, "1 passed, 1 failed")

    def test_skips_are_listed(self):
        stage = self.write(PASSED, skipped("needs guest: there is no kernel"))
        code, said = self.run_stages(stage, CI="true")
        self.check_end((code, said), 0, "1 passed, 0 failed, 1 skipped")
        self.assertIn("1 skipped: needs guest: there is no kernel", said)
        self.assertRegex(said, r"guest +no: there is no kernel")

    def test_skips_without_need_fail_in_ci(self):
        stage = self.write(PASSED, skipped("too slow"))
        self.check_end(self.run_stages(stage), 0, "1 passed, 0 failed, 1 skipped")
        self.check_end(self.run_stages(stage, CI="true"), 1, "1 passed, 1 failed")

    def test_a_step_that_fails_is_one_failure(self):
        self.check_end(self.run_stages(self.write(PASSED), before="run_step setup false; run_step again true"), 1, "1 passed, 1 failed")

    def test_nothing_at_all_is_no_success(self):
        code, _ = self.run_stages()
        self.assertNotEqual(code, 0)


if __name__ == "__main__":
    unittest.main()
