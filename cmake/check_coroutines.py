"""Finds functions that are made within an expression that waits: check_coroutines.py FILE...

g++ 12 destroys such a temporary twice (`co_await run([socket] { ... })`), which corrupts the heap where it holds something.
A function that has a name is destroyed once: `std::function<...> work = [socket] { ... }; co_await run(std::move(work))`.
"""
import re
import sys

WAITS = re.compile(r"\bco_await\b")
MADE = re.compile(r"[(,{]\s*\[[^\[\]]*\]\s*[({]|[(,{]\s*\[[^\[\]]*\]\s*mutable")
COMMENT = re.compile(r"//[^\n]*")


def expression(text, begin):
    """What follows a co_await, to the end of its statement or of what stands around it."""
    depth = 0
    for at in range(begin, len(text)):
        if text[at] in "([{":
            depth += 1
        elif text[at] in ")]}":
            depth -= 1
        if depth < 0 or (depth == 0 and text[at] == ";"):
            return text[begin:at]
    return text[begin:]


def findings(text):
    """Numbers of the lines that wait so."""
    text = COMMENT.sub("", text)
    return [text.count("\n", 0, wait.start()) + 1 for wait in WAITS.finditer(text) if MADE.search(expression(text, wait.end()))]


def main(paths):
    found = [f"{path}:{line}" for path in paths for line in findings(open(path, encoding="utf-8").read())]
    for place in found:
        print(f"{place}: a function is made within an expression that waits; give it a name before")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
