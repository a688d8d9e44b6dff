#!/usr/bin/env python3
"""What the lists of taken names get from headers, what they keep, and what is said of them."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "node/generate"))
from cpp_taken_names import NAME, add, lacking  # noqa: E402


class CppTakenNames(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        (self.folder / "cpp_macros.inc").write_text('"EAGAIN", "ELSEWHERE",\n"SOME_HPP"\n', encoding="utf-8")

    def test_names_of_other_machines_stay_and_include_guards_go(self):
        add(self.folder, {"cpp_macros.inc": {"BIG_ENDIAN", "EAGAIN"}})
        self.assertEqual((self.folder / "cpp_macros.inc").read_text(encoding="utf-8"),
                         '// Made by cpp_taken_names.py.\n"BIG_ENDIAN", "EAGAIN", "ELSEWHERE"\n')

    def test_what_the_lists_lack_is_said(self):
        self.assertEqual(lacking(self.folder, {"cpp_macros.inc": {"EAGAIN"}}), [])
        self.assertEqual(lacking(self.folder, {"cpp_macros.inc": {"NO_DATA", "EAGAIN", "BIG_ENDIAN"}}),
                         ["cpp_macros.inc lacks BIG_ENDIAN", "cpp_macros.inc lacks NO_DATA"])

    def test_names_are_those_that_a_definition_may_have(self):
        for name in ("log", "log2", "int8_t", "FILE", "H", "HPP_X"):
            self.assertTrue(NAME.fullmatch(name), name)
        for name in ("_IO", "x_", "2x", "BOOST_X", "SYS_read", "SOME_H", "SOME_HPP", "a.b"):
            self.assertFalse(NAME.fullmatch(name), name)


if __name__ == "__main__":
    unittest.main()
