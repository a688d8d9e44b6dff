"""Figures that a page repeats are those of the page of benchmarks, rounded: a later run may differ a little."""
import re

import pytest

from pages import pages

FIGURE = re.compile(r"^\| ([^|]+?) \| (\d+) \|$", re.MULTILINE)


def medians():
    """By way, of the first table's column p50."""
    table = re.search(r"(?:^\|.*\n)+", pages()["docs/benchmarks.md"], re.MULTILINE)[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    column = rows[0].index("p50")
    return {row[0]: float(row[column]) for row in rows[2:]}


@pytest.mark.parametrize("way, said", FIGURE.findall(pages()["docs/comparison.md"]))
def test_the_comparison_has_the_figures_of_the_benchmarks(way, said):
    known = medians()
    measured = known.get(way) or known[way.split(",")[0]]  # "rr+tcp, without a gateway"
    assert float(said) == pytest.approx(measured, rel=0.2)


def test_there_are_figures():
    assert len(FIGURE.findall(pages()["docs/comparison.md"])) >= 5
