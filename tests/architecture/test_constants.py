"""Every numeric constant of the estimator says what it does; docs/constants.md lists them as they are."""

import ast

import pytest

from scripts.pages import constants_page

MOST_UNEXPLAINED = 0
"""May only shrink."""


def test_no_more_constants_are_unexplained() -> None:
    unexplained = [f"{c.path.name}:{c.line} {c.name}" for c in constants_page.unexplained()]
    assert len(unexplained) <= MOST_UNEXPLAINED, f"say below each what it does, and what set it: {unexplained}"


def test_the_page_is_up_to_date() -> None:
    assert constants_page.PAGE.read_text(encoding="utf-8") == constants_page.page(), "run `python -m scripts.pages.constants_page`"


@pytest.mark.parametrize(
    ("value", "numeric"),
    [
        ("0.5", True),
        ("-1e-3", True),
        ("(1, 2.0)", True),
        ("np.radians([2.0, 5.0])", True),
        ("2.0 * float(np.log(FACTOR))", True),
        ("range(4)", True),
        ("'word'", False),
        ("True", False),
        ("N_PARAMETERS", False),
        ("Grid(300, 48)", False),
        ("{1: 2}", False),
        ("tuple(i for i in range(3))", False),
    ],
)
def test_what_counts_as_a_number(value: str, *, numeric: bool) -> None:
    assert constants_page._is_numeric(ast.parse(value, mode="eval").body) is numeric


@pytest.mark.parametrize(
    ("text", "set_by"),
    [
        ("Share of views. By judgement.", "judgement"),
        ("Rate of false alarms as in docs/studies/wrong_poses.md.", "[wrong_poses](studies/wrong_poses.md)"),
        ("Median size of a normal number [Hampel 1974].", "[Hampel 1974]"),
        ("Convex ones show 0.003 to 0.01.", "figures"),
        ("Below it is rounding.", "arithmetic"),
        ("Pictures in a run.", ""),
    ],
)
def test_what_set_it_is_read_off_the_text(text: str, set_by: str) -> None:
    assert constants_page.Constant(constants_page.PAGE, 1, "NAME", "1", text).set_by == set_by
