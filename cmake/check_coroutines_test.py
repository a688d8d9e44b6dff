#!/usr/bin/env python3
"""Waits in ways that g++ 12 gets wrong, and in ways that it does not, and sees the former alone reported."""
import unittest

from check_coroutines import findings


class CheckCoroutines(unittest.TestCase):
    def test_a_function_that_is_made_within_the_wait_is_found(self):
        self.assertEqual(findings("void f() {\n  co_await run([socket] { socket->stop(); });\n}\n"), [2])
        self.assertEqual(findings("auto x =\n    co_await run(take,\n [&device] { device.reset(); });\n"), [2])
        self.assertEqual(findings("co_await run(1, [n]() mutable { ++n; });"), [1])

    def test_a_function_with_a_name_is_not(self):
        self.assertEqual(findings("const auto work = [socket] { socket->stop(); };\nco_await run(std::move(work));\n"), [])
        self.assertEqual(findings("if (co_await ready(a[i])) run([n] { use(n); });\nco_await wait(b[0], c[i](d));\n"), [])
        self.assertEqual(findings("// co_await run([n] { use(n); });\n"), [])


if __name__ == "__main__":
    unittest.main()
