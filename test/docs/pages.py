"""The pages of the documentation, and the blocks of code in them."""
import dataclasses
import functools
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
OTHERS = ("README.md", "CHANGELOG.md", "CODE_OF_CONDUCT.md", "CONTRIBUTING.md", "SECURITY.md", "robdef/README.md",
          "test/interop/README.md", "test/examples/paper/README.md", "wasm-client/README.md", "web/README.md")
FENCE = re.compile(r"^(?:<!-- (\S+) -->\n)?(```+)(\w*)\n(.*?)^\2$", re.MULTILINE | re.DOTALL)


@dataclasses.dataclass(frozen=True)
class Block:
    page: str  # "docs/start.md"
    line: int
    language: str
    text: str
    file: str | None  # whose text it is: a file of an example, named in a comment before the block

    @property
    def first(self):
        """Its first line: what the lists of blocks name it by."""
        return self.text.split("\n")[0]

    @property
    def is_transcript(self):
        return self.language == "sh" and self.text.startswith("$ ")

    def __str__(self):
        return f"{self.page}:{self.line}"


@functools.cache
def pages():
    """All pages, by their path in the repository."""
    found = sorted(path for path in (ROOT / "docs").rglob("*.md") if not {"node_modules", ".vitepress"} & set(path.parts))
    examples = sorted((ROOT / "examples").glob("*/README.md"))
    return {str(path.relative_to(ROOT)): path.read_text() for path in [*found, *examples, *(ROOT / name for name in OTHERS)]}


@functools.cache
def blocks():
    return tuple(Block(page, text[:match.start()].count("\n") + 1, match[3], match[4], match[1])
                 for page, text in pages().items() for match in FENCE.finditer(text))


def find(listed, block):
    """What a list of {(page, beginning of the first line): ...} has for a block; None where it isn't in it."""
    return next((value for (page, beginning), value in listed.items() if page == block.page and block.first.startswith(beginning)),
                None)


def unknown(listed):
    """Entries of such a list that no block of the pages fits."""
    return [key for key in listed if not any(find({key: True}, block) for block in blocks())]
