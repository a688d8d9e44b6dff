import pathlib
import unittest

from coverage import by_file, report

FIRST = """INFO: COVERAGE:
COVERED_FUNC: hits: 351 edges: 26/63 LLVMFuzzerTestOneInput /src/build/fuzz/../../test/fuzz/fuzz_announce.cpp:44
COVERED_FUNC: hits: 5 edges: 2/8 rr::read(char const*, int) /src/core/wire/reader.cpp:27
  UNCOVERED_PC: /src/core/wire/reader.cpp:30
UNCOVERED_FUNC: hits: 0 edges: 0/2 rr::never() /src/core/wire/reader.cpp:90
COVERED_FUNC: hits: 5 edges: 2/5 std::move(int) /usr/include/c++/12/utility:1
"""
SECOND = """COVERED_FUNC: hits: 5 edges: 6/8 rr::read(char const*, int) /src/build/fuzz/../../core/wire/reader.cpp:27
COVERED_FUNC: hits: 1 edges: 4/4 rrgate::ask() /src/server/a.cpp:3
"""


class Coverage(unittest.TestCase):
    def test_of_a_function_counts_who_has_reached_most(self):
        files = by_file([FIRST.splitlines(), SECOND.splitlines()], pathlib.PurePath("/src"))
        self.assertEqual(files, {"core/wire/reader.cpp": (6, 10, ["90: rr::never()"]), "server/a.cpp": (4, 4, [])})
        self.assertIn("| core/wire/reader.cpp | 10 | 60 % | 1 |\n| server/a.cpp | 4 | 100 % | 0 |", report(files))
        self.assertIn("10 of 14 edges (71 %) of 2 files", report(files))


if __name__ == "__main__":
    unittest.main()
