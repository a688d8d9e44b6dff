"""The compatibility table: which scenario passed in which direction, at which levels."""
from collections import defaultdict

from directions import LEVELS


class Matrix:
    def __init__(self):
        self._levels = defaultdict(dict)  # (scenario, direction) -> {level: passed}

    def note(self, scenario, direction, level, passed):
        self._levels[scenario, direction][level] = passed

    def write(self, path):
        """As Markdown; a run of a few tests writes a table of those."""
        scenarios = list(dict.fromkeys(scenario for scenario, _ in self._levels))
        directions = list(dict.fromkeys(direction for _, direction in self._levels))
        rows = [["Scenario", *directions], ["---"] * (len(directions) + 1)]
        rows += [[scenario, *(self._cell(scenario, direction) for direction in directions)] for scenario in scenarios]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("# Scenarios by direction\n\nClient, way, service; levels that passed. A dash: one side of the "
                        "direction cannot do it (see README.md).\n\n"
                        + "".join(f"| {' | '.join(row)} |\n" for row in rows))

    def _cell(self, scenario, direction):
        levels = self._levels.get((scenario, direction), {})
        words = [level if levels[level] else f"**{level} FAILED**" for level in LEVELS if level in levels]
        return ", ".join(words) or "-"
