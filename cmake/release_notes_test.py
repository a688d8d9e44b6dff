#!/usr/bin/env python3
"""What of a changelog becomes the text of a release, and what is refused."""
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
HEAD = "# Changelog\n\n## [Unreleased]\n"
SECTIONS = "\n## [1.2.0] - 2026-12-01\n\n- This.\n\n### Gateway\n\n- That.\n\n## [1.1.0]\n\n- Before.\n\n[1.2.0]: https://example.invalid/\n"


class ReleaseNotes(unittest.TestCase):
    def notes_of(self, version, text):
        with tempfile.NamedTemporaryFile("w", suffix=".md") as file:
            file.write(text)
            file.flush()
            done = subprocess.run([ROOT / "cmake/release_notes.sh", version, file.name], capture_output=True, text=True, timeout=20, check=False)
            return done.returncode, done.stdout.strip(), done.stderr.replace(file.name, "FILE").strip()

    def test_the_section_of_the_version(self):
        self.assertEqual(self.notes_of("1.2.0", HEAD + SECTIONS), (0, "- This.\n\n### Gateway\n\n- That.", ""))
        self.assertEqual(self.notes_of("1.1.0", HEAD + SECTIONS), (0, "- Before.", ""))

    def test_no_change_stays_unreleased(self):
        self.assertEqual(self.notes_of("1.2.0", HEAD + "\n- One more.\n" + SECTIONS), (
            1, "", 'FILE: expected no text below "## [Unreleased]": what is released stands below "## [1.2.0]" (CONTRIBUTING.md)'))

    def test_a_version_without_a_section_is_refused(self):
        for version in ("1.3.0", "1.2", "1.20"):
            self.assertEqual(self.notes_of(version, HEAD + SECTIONS), (
                1, "", f'FILE: found no text below "## [{version}]", which is to be the text of the release'))


if __name__ == "__main__":
    unittest.main()
