"""What can be broken in a source file, and that the text with all that is broken is the same program where nothing is chosen."""
import subprocess
import tempfile
import unittest
import pathlib

from mutants import SWITCH, apart, masked, mutants, with_all

SOURCE = '''#include <cstdio>
#include <string>
// if (this) is no code;
static int calls = 0;
static void call(int by) { calls += by; }
static bool both(int a, int b) {
  if (a < b && b != 7) return true;
  return false;
}
static int count(int n) {
  int out = 0;
  while (n > 0) {
    n = n - 1;
    ++out;
  }
  if (out >= 3)
    call(1);
  else
    call(2);
  return out;
}
static bool is_long(const std::string& text) {
  return text.size() > 3;
}
int main() {
  std::printf("%d %d %d %d", both(1, 2), both(2, 7), count(3), is_long("if (a < b)"));
  std::printf(" %d\\n", calls);
}
'''


class Mutants(unittest.TestCase):
    def test_what_is_found(self):
        kinds = sorted({(one.line(SOURCE), one.kind) for one in mutants(SOURCE)})
        for expected in [(7, "condition negated"), (7, "part of && left out"), (7, "< is <="), (7, "!= is =="),
                         (7, "another constant returned"), (8, "another constant returned"), (12, "> is >="), (13, "1 is 0"),
                         (14, "statement left out"), (17, "statement left out"), (19, "statement left out"), (23, "> is >=")]:
            self.assertIn(expected, kinds)
        self.assertFalse({line for line, _ in kinds} & {1, 2, 3, 4}, kinds)

    def test_comments_and_texts_are_no_code(self):
        self.assertEqual(masked('f("a // b"); // c\n'), "f(xxxxxxxx);     \n")
        self.assertEqual(masked("1'000 + x"), "1'000 + x")

    def test_without_a_choice_it_is_the_same_program_and_with_one_another(self):
        numbered = dict(enumerate(apart(list(mutants(SOURCE))), 1))
        with tempfile.TemporaryDirectory() as scratch:
            source, program = pathlib.Path(scratch, "a.cpp"), pathlib.Path(scratch, "a")
            source.write_text(SWITCH + with_all(SOURCE, numbered))
            subprocess.run(["g++", "-w", "-o", program, source], check=True)
            said = {}
            for number in (0, *numbered):
                try:
                    said[number] = subprocess.run([program], env={"RR_MUTANT": str(number)}, capture_output=True, timeout=1).stdout
                except subprocess.TimeoutExpired:
                    said[number] = None
        self.assertEqual(said[0], b"1 0 3 1 1\n")
        alive = [numbered[number] for number in numbered if said[number] == said[0]]
        self.assertLess(len(alive), len(numbered) / 3, [(one.line(SOURCE), one.kind) for one in alive])


if __name__ == "__main__":
    unittest.main()
