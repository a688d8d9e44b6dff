"""Where a source file of C++ can be broken so that it still compiles, and how: text alone is looked at. All that is broken is in
one text, in which rr_mutant(NUMBER) chooses; no line moves. What does not compile all the same is left out by its line."""
import re
from dataclasses import dataclass

SWITCH = """#include <cstdlib>
#pragma GCC diagnostic ignored "-Wunused-function"
static bool rr_mutant(int number) {
  static const int chosen = [] { const char* text = std::getenv("RR_MUTANT"); return text ? std::atoi(text) : 0; }();
  return number == chosen;
}
"""

OPERAND = r"[\w.:]+(?:\((?:[^()]|\([^()]*\))*\)|\[[^\[\]]*\]|->[\w.:]+|\.[\w:]+)*"
COMPARISON = re.compile(rf"(?<=[(&|=,;?!])(?P<space> ?)(?P<left>!?{OPERAND}) (?P<operator><=?|>=?|[=!]=) (?P<right>-?{OPERAND})"
                        r"(?= (?:&&|\|\||\?)|[);,])")
RETURNED = re.compile(rf"\breturn (?P<left>{OPERAND}) (?P<operator><=?|>=?|[=!]=) (?P<right>-?{OPERAND});")
OTHER = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
CONSTANT = re.compile(r"\b(?:co_)?return (true|false|0|1);")
NUMBER = re.compile(r"(?<=[\w)\]] [+-] )1\b(?![.'\w])")
STATEMENT = re.compile(r"(?<=\n)(?P<indent> +)(?P<text>(?:\+\+|--)?(?!return\b|co_|if\b|while\b|for\b|switch\b|case\b|default\b|break\b|"
                       r"continue\b|using\b|throw\b|delete\b|else\b|do\b|static_assert\b|CHECK)[\w.:>\-\[\]()*]+(?:\((?:[^;{}])*\)|"
                       r" [+\-|&]?= [^;{}]+)?;)(?=[ ]*\n)")
CONDITION = re.compile(r"\b(?:if|while) \(")
DECLARATION = re.compile(r"^(?:const\s+)?[\w:<>,*& ]+ [*&]?\w+ = |^(?:const\s+)?auto\b")


@dataclass(frozen=True)
class Mutant:
    """`before` and `after` go around text[start:end], with the mutant's number for {}; `instead`, where it is set, in its place."""
    start: int
    end: int
    kind: str
    before: str = ""
    after: str = ""
    instead: str | None = None

    def line(self, text):
        return text.count("\n", 0, self.start) + 1


def masked(text):
    """The same length, with blanks for comments, texts and lines of the preprocessor."""
    def blank(found):
        return re.sub(r"[^\n]", " ", found[0])
    words = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)
    def word(found):
        is_digit_separator = found[0][0] == "'" and found.start() > 0 and text[found.start() - 1].isdigit()
        if is_digit_separator:
            return found[0]
        # A text stays an operand.
        return "x" * len(found[0]) if found[0][0] in "\"'R" and "\n" not in found[0] else blank(found)
    return re.sub(r"(?m)^#.*(?:\\\n.*)*$", blank, words.sub(word, text))


def closing(text, opening):
    """Where the bracket that opens there closes; -1: nowhere."""
    depth = 0
    for at in range(opening, len(text)):
        depth += (text[at] in "([{") - (text[at] in ")]}")
        if depth == 0:
            return at
    return -1


def parts(text, start, end):
    """(operator, [(start, end)]) of a condition: what "&&" or "||" is between at its outermost level; "" where it is one."""
    found, depth = {"&&": [], "||": []}, 0
    for at in range(start, end):
        depth += (text[at] in "([{") - (text[at] in ")]}")
        if depth == 0 and text[at:at + 2] in found:
            found[text[at:at + 2]].append(at)
    operator = "||" if found["||"] else "&&" if found["&&"] else ""
    cuts = found.get(operator, [])
    begins, ends = [start, *(cut + 2 for cut in cuts)], [*cuts, end]
    out = []
    for begin, stop in zip(begins, ends):
        piece = text[begin:stop]
        out.append((begin + len(piece) - len(piece.lstrip()), stop - (len(piece) - len(piece.rstrip()))))
    return operator, out


def mutants(source):
    """All of a file, in no order that counts."""
    text = masked(source)
    for found in CONDITION.finditer(text):
        start, end = found.end(), closing(text, found.end() - 1)
        condition = text[start:end]
        if end < 0 or ";" in condition or DECLARATION.match(condition):
            continue
        yield Mutant(start, end, "condition negated", "rr_mutant({}) != static_cast<bool>(", ")")
        operator, pieces = parts(text, start, end)
        for begin, stop in pieces if operator else ():
            before = "(rr_mutant({}) || (" if operator == "&&" else "(!rr_mutant({}) && ("
            yield Mutant(begin, stop, f"part of {operator} left out", before, "))")
    for pattern in (COMPARISON, RETURNED):
        for found in pattern.finditer(text):
            start, end, operator = found.start("left"), found.end("right"), found["operator"]
            left, right = source[start:found.end("left")], source[found.start("right"):end]
            yield Mutant(start, end, f"{operator} is {OTHER[operator]}",
                         instead=f"(rr_mutant({{}}) ? {left} {OTHER[operator]} {right} : {left} {operator} {right})")
    for found in CONSTANT.finditer(text):
        value = {"true": "!rr_mutant({})", "false": "rr_mutant({})", "0": "(rr_mutant({}) ? 1 : 0)", "1": "(rr_mutant({}) ? 0 : 1)"}
        yield Mutant(*found.span(1), "another constant returned", instead=value[found[1]])
    for found in NUMBER.finditer(text):
        yield Mutant(*found.span(), "1 is 0", instead="(rr_mutant({}) ? 0 : 1)")
    for found in STATEMENT.finditer(text):
        if found["text"].count("(") == found["text"].count(")"):
            yield Mutant(*found.span("text"), "statement left out", "if (rr_mutant({})) {{}} else ")


def apart(chosen):
    """Without those that lie within what another one puts something in the place of."""
    replaced = [one for one in chosen if one.instead is not None]
    return [one for one in chosen
            if not any(other is not one and other.start <= one.start and one.end <= other.end for other in replaced)]


def with_all(source, numbered):
    """The text with them all; `numbered`: {number: mutant}, apart()."""
    events = []
    for number, one in numbered.items():
        size = one.end - one.start
        if one.instead is not None:
            events.append(((one.start, 1, -size), one.end, one.instead.format(number)))
        else:
            events.append(((one.start, 1, -size), one.start, one.before.format(number)))
            events.append(((one.end, 0, size), one.end, one.after))
    out, at = [], 0
    for (start, _, _), end, text in sorted(events, key=lambda event: event[0]):
        out += [source[at:start], text]
        at = end
    return "".join(out) + source[at:]
