"""Files and functions stay short enough to be read."""

import ast
from pathlib import Path
from statistics import median

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("datasets", "synth", "estimator", "rivals", "tumble", "studies", "scripts")
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def body_lengths(path: Path) -> list[tuple[str, int]]:
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            documented = ast.get_docstring(node) is not None
            statements = node.body[1:] if documented else node.body
            if statements:
                found.append((f"{path.name}:{node.name}", (statements[-1].end_lineno or 0) - statements[0].lineno + 1))
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_is_longer_than_500_lines(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 500


def test_function_bodies_are_short() -> None:
    lengths = [entry for path in FILES for entry in body_lengths(path)]
    assert median(length for _, length in lengths) <= 12
    assert [entry for entry in lengths if entry[1] > 50] == []
