"""A result is older where code that decides it changed: not where a comment did, nor a module that its study does not use."""

from pathlib import Path

import pytest

from studies.frame import digests
from studies.frame.digests import code_of, of_libraries, source_of, used_by

SOURCE = '''"""What it is."""  # and why

LIMIT = 3.0  # px
"""Where it ends."""


def shown(text: str = "# 3 px") -> str:
    """One line, naïve."""
    # a reason

    return f"""{text}  # none

  \n"""
'''


def test_comments_and_docstrings_do_not_count_and_all_else_does() -> None:
    left = ["LIMIT = 3.0", 'def shown(text: str = "# 3 px") -> str:', '    return f"""{text}  # none', "", "  ", '"""']
    assert code_of(SOURCE).split("\n") == left
    assert code_of(SOURCE.replace("One line, naïve", "Two\n    lines").replace("# px", "# pixels")) == code_of(SOURCE)
    assert code_of(SOURCE.replace("3.0", "3.1")) != code_of(SOURCE)


def test_what_is_in_a_string_counts_to_the_last_blank() -> None:
    assert code_of('TABLE = """a\n\n\nb   \n"""') != code_of('TABLE = """a\nb\n"""')
    assert code_of('x = "a\x85b"  # why\ny = 1\n') == 'x = "a\x85b"\ny = 1'
    assert code_of('def f():\n    """What\n\n    it does."""\n\n    return 1\n') == "def f():\n    return 1"


def test_sentences_decide_nothing_and_names_and_formats_do() -> None:
    told = 'raise ValueError(f"{name}: expected a number of"  # said\n    f" frames, got {value!r}")\n'
    assert code_of(told).split() == code_of('raise ValueError(f"{name}: how many frames it has")\n').split() == ["raise", "ValueError()"]
    for one, other in (("'v'", "'w'"), ("f'{x:.2f} px'", "f'{x:.3f} px'"), ("'ij, jk -> ik'", "'ij, kj -> ik'")):
        assert code_of(f"y = f({one})\n") != code_of(f"y = f({other})\n")


def test_modules_that_are_used_through_others_count_with_their_packages() -> None:
    used = used_by(("studies.plans.figure_5", "studies.flights.scored"))
    assert {"estimator.measure", "estimator.surface.shape", "estimator.surface", "synth.motion.random_flight", "datasets.errors"} <= used
    assert not any(name.startswith("estimator.diagnosis") for name in used)


@pytest.mark.parametrize(("changed", "counts"), [("estimator.surface.shape", True), ("estimator.diagnosis.explain", False)])
def test_a_change_counts_where_it_is_used(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, changed: str, counts: bool) -> None:
    before = of_libraries(("studies.flights.scored",))
    other = tmp_path / "other.py"
    other.write_text(source_of(changed).read_text(encoding="utf-8") + "\nMORE = 1\n", encoding="utf-8")
    monkeypatch.setattr(digests, "source_of", lambda name: other if name == changed else source_of(name))
    after = of_libraries(("studies.flights.scored",))
    assert (after["estimator"] != before["estimator"]) is counts
    assert (after["synth"], after["datasets"]) == (before["synth"], before["datasets"])
