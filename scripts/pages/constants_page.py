"""Writes docs/constants.md: every numeric constant of the estimator, what it does, and what set it, read off the source.

``python -m scripts.pages.constants_page``. A constant is an upper-case name that a module gives a number, or an array of numbers, made of
literals and other constants. What it does is the string below it, or a comment beside it. What set it is what that text names: a study, a
decision, a page of the notebook, a paper, or judgement.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from datasets.atomic_files import written_whole
from scripts.pages.architecture_page import order
from scripts.pages.source_reading import ESTIMATOR, ROOT, modules, room_of, tree

PAGE = ROOT / "docs" / "constants.md"
NUMERIC = {"np", "math", "float", "int", "len", "range", "norm", "chi2", "savgol_coeffs"}
"""Roots of calls that make numbers of numbers."""
LONGEST = 60
SET_BY = (
    (r"(?:docs/studies/)(\w+)\.md", "[{0}](studies/{0}.md)"),
    (r"\b(decision \d+|notebooks? \d+)", "{0}"),
    (r"(\[[A-Z][^\]]*(?:1[6-9]|20)\d\d[^\]]*\])", "{0}"),
    (r"\b([Bb]y judgement)\b", "judgement"),
    (r"(\d[\d.]*(?:%|px|°)? (?:to|and) \d|\d+ of \d+|RMS of|[Mm]easured (?:on|nearly)|[Oo]n scanned|[Ff]rom campaigns)", "figures"),
    (r"([Rr]ounding|[Aa]gainst division|difference quotient|divides by it|without area|no area)", "arithmetic"),
)
"""What a text names as having set a constant, first match first."""
BY_NAME = (
    (
        r"^(?!LEAST)\w*(?:STEPS|ROUNDS|DRAWS|DRAWN|HALVINGS|BISECTIONS|SPLITS|STARTS|CANDIDATES|EVALUATIONS|RESAMPLES|PICTURES|FITS"
        r"|DIRECTIONS|ANGLES|GRID|CELLS|BINS|NODES|WAVES|PLANES|RADII|CHUNK|FINER|RESOLUTION|ORIENTATIONS|ITERATIONS|LAGS)(?:_\w+)?$",
        "effort",
    ),
    (r"^(?:N_\w+|STATE|POSE|PER_IMPACT|COORDINATES|COLUMNS|NUMBERS|LEFT|SLIP|PAIR|MOTION|SYMMETRIC|FOLLOWING|BEFORE)$", "layout"),
)
"""Names of numbers that say how long or how finely something is computed, or how parameters are laid out; they are no thresholds."""

TEXT = """\
# Constants of the estimator

Written by `python -m scripts.pages.constants_page` from the source; a test says when it is out of date. {count} numbers in {files} files,
{unexplained} of them unexplained. Settings that a user may change are in [configuration.py](../estimator/data/configuration.py). The
eight constants that decide which effects are in a model are explained in [decision 47](decisions/0047-one-evidence.md).

*Set by* is what the text beside a constant names: a study, a page of the notebook, a paper, figures (of development runs, as a rule),
arithmetic, or judgement. *Effort* and *layout*, told by names, say how long or how finely something is computed and how parameters lie:
they are no thresholds. Where it is empty, nothing is named. Of all, {judged} are set by judgement, {effort} are effort or layout, and
{silent} name nothing.

{rooms}"""


@dataclass(frozen=True)
class Constant:
    """A constant: its file, line, name, value as it is written, and the text below it, empty where there is none."""

    path: Path
    line: int
    name: str
    value: str
    text: str

    @property
    def set_by(self) -> str:
        """What the text names as having set it."""
        for pattern, shown in SET_BY:
            found = re.search(pattern, self.text)
            if found:
                return shown.format(found[1])
        return next((kind for pattern, kind in BY_NAME if re.search(pattern, self.name)), "")


def constants() -> list[Constant]:
    """All constants, file after file."""
    return [constant for path in modules() for constant in _of(path)]


def unexplained() -> list[Constant]:
    """Those without a text."""
    return [constant for constant in constants() if not constant.text]


def _of(path: Path) -> Iterator[Constant]:
    lines = path.read_text(encoding="utf-8").splitlines()
    body = tree(path).body
    for node, after in zip(body, [*body[1:], None], strict=True):
        for name, value in _assigned(node):
            if _upper(name) and _is_numeric(value):
                text = _text_of(after) or _comment(lines[node.lineno - 1])
                yield Constant(path, node.lineno, name, ast.unparse(value), text)


def _assigned(node: ast.stmt) -> Iterator[tuple[str, ast.expr]]:
    """Names and values of an assignment, one by one where several are assigned at once."""
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value is not None:
        yield node.target.id, node.value
    if not isinstance(node, ast.Assign) or len(node.targets) != 1:
        return
    (target,) = node.targets
    if isinstance(target, ast.Name):
        yield target.id, node.value
    elif isinstance(target, ast.Tuple):
        values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value] * len(target.elts)
        yield from ((name.id, value) for name, value in zip(target.elts, values, strict=True) if isinstance(name, ast.Name))


def _upper(name: str) -> bool:
    return name.strip("_").isupper()


def _is_numeric(value: ast.expr) -> bool:
    """Whether a value is made of numbers alone, at least one of them written here."""
    nodes = list(ast.walk(value))
    literals = [n for n in nodes if isinstance(n, ast.Constant)]
    names = [n.id for n in nodes if isinstance(n, ast.Name)]
    numbers = [n for n in literals if isinstance(n.value, int | float) and not isinstance(n.value, bool)]
    others = (ast.Dict, ast.Set, ast.Lambda, ast.Subscript, ast.comprehension, ast.Compare, ast.JoinedStr)
    if not numbers or len(numbers) != len(literals) or any(isinstance(n, others) for n in nodes):
        return False
    return all(_upper(name) or name in NUMERIC for name in names)


def _text_of(node: ast.stmt | None) -> str:
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
        return " ".join(node.value.value.split())
    return ""


def _comment(line: str) -> str:
    return line.partition("  # ")[2].strip()


def page() -> str:
    """The page as the source has it now."""
    found = constants()
    rooms = [_table("Unexplained", unexplained())] if unexplained() else []
    for room in order():
        here = [constant for constant in found if room_of(constant.path) == room and constant.text]
        rooms += [_table(f"{room} ({len(here)})", here)] if here else []
    return TEXT.format(
        count=len(found),
        files=len({constant.path for constant in found}),
        unexplained=len(unexplained()) or "none",
        judged=sum(constant.set_by == "judgement" for constant in found),
        effort=sum(constant.set_by in {"effort", "layout"} for constant in found),
        silent=sum(not constant.set_by for constant in found),
        rooms="\n".join(rooms),
    )


def _table(title: str, rows: list[Constant]) -> str:
    lines = [f"| {_place(c)} | `{c.name}` | {_value(c)} | {_escaped(c.text)} | {_escaped(c.set_by)} |" for c in rows]
    return "\n".join([f"## {title}", "", "| file | name | value | what it does | set by |", "| --- | --- | --- | --- | --- |", *lines, ""])


def _place(constant: Constant) -> str:
    inside = constant.path.relative_to(ESTIMATOR)
    return f"[{inside}](../estimator/{inside})"


def _value(constant: Constant) -> str:
    value = constant.value
    return f"`{value if len(value) <= LONGEST else value[:LONGEST] + ' …'}`"


def _escaped(text: str) -> str:
    plain = re.sub(r":(?:mod|func|class|data):`([^`]*)`", r"`\1`", text)
    return re.sub(r"\b(decision|notebook)s? (\d+)", _linked, plain.replace("|", "\\|"))


def _linked(found: re.Match[str]) -> str:
    """A decision or a page of the notebook as a link."""
    folder = "decisions" if found[1] == "decision" else "notebook"
    (page,) = (PAGE.parent / folder).glob(f"{int(found[2]):04d}-*.md")
    return f"[{found[0]}]({folder}/{page.name})"


def main() -> None:
    """Write the page."""
    with written_whole(PAGE) as path:
        path.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
