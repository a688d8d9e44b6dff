"""Messages that a page explains are those that the programs say."""
import re

import pytest

from pages import ROOT, pages

SOURCES = ("core", "node", "server", "wasm-client/ts")


@pytest.fixture(scope="module")
def said():
    """All that the sources may say: strings that are written in parts are one."""
    files = [path for folder in SOURCES for path in (ROOT / folder).rglob("*") if path.suffix in (".cpp", ".hpp", ".ts")]
    text = "\n".join(path.read_text() for path in files)
    return re.sub(r'(?<!\\)"\s*\n\s*"', "", text).replace('\\"', '"')


def messages():
    headings = re.findall(r"^### (.*)$", pages()["docs/troubleshooting.md"], re.MULTILINE)
    return [message for heading in headings for message in re.findall(r"`([^`]+)`", heading)]


@pytest.mark.parametrize("message", messages())
def test_message_is_said(message, said):
    assert message in said
