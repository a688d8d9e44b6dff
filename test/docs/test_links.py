"""Links between pages lead somewhere: files are there, and so are the headings that anchors name."""
import posixpath
import re

import pytest

from pages import FENCE, ROOT, pages

SOURCES = "cmake|core|docker|docs|examples|gateway-config|include|node|robdef|server|test|wasm-client|web"


def anchors(text):
    """Of a page's headings, as GitHub makes them; the site makes them likewise."""
    found = {}
    for heading in re.findall(r"^#{1,6} (.*)$", FENCE.sub("", text), re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", words.strip().lower()).replace(" ", "-")
        found[slug] = found.get(slug, -1) + 1
    return {slug if number == 0 else f"{slug}-{number}" for slug, count in found.items() for number in range(count + 1)}


def links(text):
    prose = re.sub(r"`[^`\n]*`", "", FENCE.sub("", text))
    return [link for link in re.findall(r"\]\(([^)\s]+)\)", prose) if not re.match(r"[a-z][a-z+.-]*:", link)]


def leads_somewhere(page, link):
    target, _, anchor = link.partition("#")
    file = ROOT / posixpath.normpath(posixpath.join(posixpath.dirname(page), target)) if target else ROOT / page
    return file.exists() and (not anchor or anchor in anchors(file.read_text()))


@pytest.mark.parametrize("page", pages())
def test_links_lead_somewhere(page):
    assert [link for link in links(pages()[page]) if not leads_somewhere(page, link)] == []


def sources(text):
    """What stands in backticks and begins with a folder of the sources; "<name>" in it is for any."""
    return re.findall(rf"`((?:{SOURCES})/[\w./<>*-]*)`", FENCE.sub("", text))


@pytest.mark.parametrize("page", [page for page in pages() if page != "CHANGELOG.md"])
def test_named_sources_are_there(page):
    """The changelog names what was there."""
    assert [path for path in sources(pages()[page]) if not any(ROOT.glob(re.sub(r"<\w+>", "*", path).rstrip("/")))] == []


def test_sources_are_what_a_reader_looks_for():
    assert sources("`core/a.cpp` `corea/b` [`test/<name>_test.cpp`](x) `docs/`\n```sh\n`core/none`\n```\n") == [
        "core/a.cpp", "test/<name>_test.cpp", "docs/"]


def test_anchors_are_those_of_github():
    text = "# Nodes in C++\n## connect(url, options)\n## `a_b`, c\n## Twice\n## Twice\n```sh\n# none\n```\n"
    assert anchors(text) == {"nodes-in-c", "connecturl-options", "a_b-c", "twice", "twice-1"}
    assert links("[a](b.md#c) `[d](e)` [f](https://g) ![h](i.png)") == ["b.md#c", "i.png"]


def test_screenshots_are_those_that_the_browser_tests_compare():
    """Nothing else would notice that one shows a page of the past."""
    shown = {picture for page in pages() for link in links(pages()[page]) if (picture := link.rpartition("/")[2]).endswith(".png")}
    compared = {path.name for path in (ROOT / "docs/images/page").iterdir()}
    assert shown and shown <= compared, shown - compared
    assert [path.name for path in (ROOT / "docs/images").glob("*.png")] == []
