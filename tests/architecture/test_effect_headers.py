"""Every effect's header has its equation and where it is valid; the estimator's its paper, too."""

import ast
import re
from pathlib import Path

import pytest

from datasets.vocabulary.effects import EFFECTS

ROOT = Path(__file__).parents[2]


def header(side: str, key: str) -> str:
    (path,) = (ROOT / side / "effects").rglob(f"{key}.py")
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


@pytest.mark.parametrize("side", ["estimator", "synth"])
def test_headers_have_an_equation_and_where_it_is_valid(side: str) -> None:
    assert [key for key in EFFECTS if not re.search(r"``[^`]*=[^`]*``", header(side, key))] == []
    assert [key for key in EFFECTS if not re.search(r"\b[Vv]alid\b|\bholds for\b", header(side, key))] == []


def test_headers_of_the_estimator_name_a_paper() -> None:
    assert [key for key in EFFECTS if not re.search(r"\[[^\]]*\b(1[6-9]|20)\d\d\b[^\]]*\]", header("estimator", key))] == []
