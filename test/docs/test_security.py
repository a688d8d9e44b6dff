"""What docs/security.md says is tested: each test that it names is there."""
import re

from pages import ROOT, pages

PATTERNS = {
    "**/*.py": r"^ *def (test_\w+)\(",
    "**/*.cpp": r'^TEST_CASE\("((?:[^"\\]|\\.)*)"',
    "e2e/**/*.spec.ts": r'^ *test\("((?:[^"\\]|\\.)*)"',
}
FOLDERS = {"node_modules", "__pycache__"}


def names_of_tests():
    """Names of all tests of the repository; a fuzzer is one by its file's name."""
    found = {file.stem for file in (ROOT / "test/fuzz").glob("fuzz_*.cpp")}
    for files, pattern in PATTERNS.items():
        for file in (ROOT / "test").glob(files):
            if not FOLDERS & set(file.parts):
                found |= set(re.findall(pattern, file.read_text(), re.MULTILINE))
    return found


def defences(text):
    """(what an attacker does, the tests named for it): rows of the tables with three columns."""
    rows = re.findall(r"^\| ([^|\n]+) \| ([^|\n]+) \| ([^|\n]+) \|$", text, re.MULTILINE)
    return [(what, re.findall(r"`([^`]+)`", named)) for what, _, named in rows if named != "Test"]


def test_each_defence_names_tests_and_each_is_there():
    rows = defences(pages()["docs/security.md"])
    assert len(rows) > 30
    assert [what for what, named in rows if not named] == []
    there = names_of_tests()
    assert [(what, name) for what, named in rows for name in named if name not in there] == []


def test_every_attacker_has_his_defences():
    sections = re.split(r"^## ", pages()["docs/security.md"], flags=re.MULTILINE)
    counts = {section.split("\n")[0]: len(defences(section)) for section in sections}
    attackers = ("A page of another origin", "Somebody in the same network", "A device that means ill", "A client that means ill",
                 "A stolen token, password, ticket or cookie", "An operator who is curious")
    assert [name for name in attackers if counts.get(name, 0) < 3] == []
