#!/usr/bin/env python3
"""How what was measured is judged."""
import unittest

from rows import Row, report

OLDEST_MS = 50


class Judging(unittest.TestCase):
    def test_a_promise_is_missed_though_the_yardstick_was_worse(self):
        row = Row("age", OLDEST_MS + 1, 10 * OLDEST_MS, "ms", limit=2, promise=OLDEST_MS)
        self.assertLess(row.ratio, 1)
        self.assertFalse(row.is_met)
        self.assertIn("**missed**", report("shared", [row]))

    def test_a_ratio_is_missed_though_the_promise_was_kept(self):
        self.assertFalse(Row("age", OLDEST_MS / 2, OLDEST_MS / 10, "ms", limit=2, promise=OLDEST_MS).is_met)

    def test_both_are_kept(self):
        row = Row("age", 20, 15, "ms", limit=2, promise=OLDEST_MS)
        self.assertTrue(row.is_met)
        self.assertIn("1 aims met, 0 missed", report("shared", [row]))

    def test_one_of_them_alone(self):
        self.assertTrue(Row("lost", 0, None, "", promise=0).is_met)
        self.assertFalse(Row("lost", 1, None, "", promise=0).is_met)
        self.assertTrue(Row("time", 4, 1, "s", limit=5).is_met)
        self.assertFalse(Row("time", 6, 1, "s", limit=5).is_met)
        self.assertTrue(Row("shown only", 6, 1, "s").is_met)


if __name__ == "__main__":
    unittest.main()
