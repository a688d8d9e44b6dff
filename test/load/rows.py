"""What was measured, how it is judged, and how it is shown."""
import platform
from dataclasses import dataclass


@dataclass
class Row:
    """Met where ours / yardstick is at most `limit`, and ours at most `promise`; None: there is no such thing."""
    text: str
    ours: float
    yardstick: float | None
    unit: str
    limit: float | None = None
    promise: float | None = None

    @property
    def ratio(self):
        return None if self.yardstick is None else self.ours / max(self.yardstick, 1e-9)

    @property
    def is_met(self):
        return (self.limit is None or self.ratio <= self.limit) and (self.promise is None or self.ours <= self.promise)


def report(title, rows):
    lines = ["| " + title + " | ours | promise | yardstick | ratio | aim | |", "|---|---|---|---|---|---|---|"]
    for row in rows:
        yardstick, ratio = ("", "") if row.yardstick is None else (f"{row.yardstick:.2f} {row.unit}", f"{row.ratio:.2f}")
        promise = "" if row.promise is None else f"<= {row.promise:g} {row.unit}"
        limit = "" if row.limit is None else f"<= {row.limit:g}"
        verdict = "" if row.limit is None and row.promise is None else "met" if row.is_met else "**missed**"
        lines.append(f"| {row.text} | {row.ours:.2f} {row.unit} | {promise} | {yardstick} | {ratio} | {limit} "
                     f"| {verdict} |")
    missed = sum(not row.is_met for row in rows)
    aims = sum(row.limit is not None or row.promise is not None for row in rows)
    lines += ["", f"{aims - missed} aims met, {missed} missed; {platform.machine()}, {platform.processor() or 'processor unknown'}"]
    return "\n".join(lines) + "\n"


def publish(path, title, heading, rows):
    """Writes the report and prints it. Returns the exit status: 1 where an aim is missed."""
    rows = list(rows)
    text = report(heading, rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"# {title}\n\n{text}", encoding="utf-8")
    print(text)
    return 0 if all(row.is_met for row in rows) else 1
