"""What the compiler and the linker guard in rrgate. Usage: hardening_test.py PATH_TO_RRGATE"""
import os
import subprocess
import sys
import unittest

RRGATE = sys.argv.pop()


class Hardening(unittest.TestCase):
    def test_the_program_lies_anywhere_in_memory_and_nothing_in_it_is_both_written_and_run(self):
        parts = subprocess.run(["readelf", "--wide", "--file-header", "--program-headers", "--dynamic", RRGATE], check=True,
                               capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"}).stdout
        self.assertRegex(parts, r"Type: +DYN \(Position-Independent Executable file\)")
        self.assertIn("GNU_RELRO", parts)
        self.assertRegex(parts, r"FLAGS_1\) +Flags: NOW PIE")
        self.assertRegex(parts, r"GNU_STACK .* RW +0x")
        self.assertNotRegex(parts, r"LOAD .* RWE ")

    def test_what_is_written_beyond_a_buffer_ends_the_program(self):
        names = subprocess.run(["readelf", "--wide", "--dyn-syms", RRGATE], check=True, capture_output=True, text=True).stdout
        self.assertIn(" __stack_chk_fail@", names)
        self.assertRegex(names, r" __\w+_chk@")


if __name__ == "__main__":
    unittest.main()
