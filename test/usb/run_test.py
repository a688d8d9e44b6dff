#!/usr/bin/env python3
"""What run.py makes of what a guest printed; no guest is needed."""
import json
import unittest

import run

GOOD = [{"value": value} for _, value in run.SCENARIO]


class Judge(unittest.TestCase):
    def text(self, junit='<?xml version="1.0"?><testsuites><testcase name="a"/></testsuites>', status=0, results=GOOD):
        answer = json.dumps({"results": results})
        return (f"MARK ready 3.1\nMARK junit begin\n{junit}\nMARK junit end {status}\n"
                f"MARK direct begin\n{answer}\nMARK direct end\nMARK client begin\n{answer}\nMARK client end\n"
                f"MARK other junit begin\n{junit}\nMARK other junit end {status}\n"
                f"MARK reference begin\n{json.dumps(run.REFERENCE_ANSWER)}\nMARK reference end\n")

    def failed(self, text):
        return [case.get("name") for case in run.judge(text) if case.find("failure") is not None]

    def test_a_good_run(self):
        self.assertEqual(self.failed(self.text()), [])

    def test_results_that_are_missing_failed(self):
        names = self.failed(self.text(results=GOOD[:-1]))
        self.assertEqual(len(names), 2)  # one by each way
        self.assertIn('"version"', names[0])

    def test_no_results_at_all(self):
        self.assertEqual(len(self.failed(self.text(results=[]))), 2 * len(run.SCENARIO))

    def test_more_results_than_steps(self):
        self.assertEqual(len(self.failed(self.text(results=[*GOOD, {"value": 1}]))), 2)

    def test_a_guest_that_ran_no_test(self):
        self.assertIn("the guest's junit", self.failed(self.text(junit='<?xml version="1.0"?><testsuites/>')))

    def test_a_program_that_failed_without_a_failed_case(self):
        self.assertIn("the guest's junit", self.failed(self.text(status=1)))

    def test_a_report_that_breaks_off(self):
        self.assertIn("the guest's junit", self.failed(self.text(junit='<?xml version="1.0"?><testsuites>')))

    def test_a_guest_that_never_came_up(self):
        self.assertNotEqual(self.failed("Kernel panic"), [])


if __name__ == "__main__":
    unittest.main()
