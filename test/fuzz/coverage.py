#!/usr/bin/env python3
"""What fuzzers have reached, by file: coverage.py LOG... Each log is what -print_coverage=1 of one fuzzer has said.

Of a function that several fuzzers reach counts the one that has reached most of it. What was not compiled into any fuzzer is
not listed."""
import argparse
import collections
import pathlib
import re

FUNCTION = re.compile(r"^(?:UN)?COVERED_FUNC: hits: \d+ edges: (\d+)/(\d+) (.*) (\S+):(\d+)$")
ROOT = pathlib.Path(__file__).resolve().parents[2]


def place(path, root):
    """The file's name below the folder with the sources; None: it is another's, or a test."""
    parts = pathlib.PurePath(str(pathlib.Path(path).resolve() if ".." in path else path)).parts
    try:
        name = pathlib.PurePath(*parts).relative_to(root)
    except ValueError:
        return None
    return str(name) if name.parts[0] in ("core", "node", "server") else None


def by_file(logs, root=ROOT):
    """{file: (edges that were reached, edges, [functions that none has reached])}"""
    functions = {}
    for log in logs:
        for line in log:
            found = FUNCTION.match(line.rstrip("\n"))
            file = found and place(found[4], root)
            if not file:
                continue
            key, reached, edges = (file, int(found[5]), found[3]), int(found[1]), int(found[2])
            if reached >= functions.get(key, (-1, 0))[0]:
                functions[key] = reached, edges
    out = collections.defaultdict(lambda: (0, 0, []))
    for (file, line, name), (reached, edges) in sorted(functions.items()):
        before = out[file]
        out[file] = before[0] + reached, before[1] + edges, before[2] + ([] if reached else [f"{line}: {name[:100]}"])
    return dict(out)


def report(files):
    lines = ["| file | edges | reached | functions never reached |", "|---|---:|---:|---:|"]
    for file, (reached, edges, missed) in sorted(files.items(), key=lambda item: item[1][0] / max(1, item[1][1])):
        lines.append(f"| {file} | {edges} | {100 * reached / max(1, edges):.0f} % | {len(missed)} |")
    reached, edges = (sum(each[column] for each in files.values()) for column in (0, 1))
    lines += ["", f"{reached} of {edges} edges ({100 * reached / max(1, edges):.0f} %) of {len(files)} files"]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", type=pathlib.Path, required=True)
    parser.add_argument("logs", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    files = by_file([log.read_text(errors="replace").splitlines() for log in arguments.logs])
    text = report(files)
    missed = "".join(f"\n{file}\n" + "".join(f"  {one}\n" for one in missed) for file, (_, _, missed) in sorted(files.items()) if missed)
    arguments.report.write_text(f"# Coverage of fuzzers\n\n{text}\n## Never reached\n\n```\n{missed}```\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
