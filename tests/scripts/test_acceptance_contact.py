"""The command that a page of contact models says it was written by."""

from typing import Any

import pytest

from scripts.acceptance_contact import CASES, COMPLIANT, HIDDEN_SETS, RIGID, RUNS, SETS, _command

FAST = tuple(case for case in CASES if case != "chip")


def result_of(cases: dict[str, int], *, mode: str = "fast", runs: int = RUNS) -> dict[str, Any]:
    return {"mode": mode, "runs_per_set": runs, "cases": {case: {"sets": sets} for case, sets in cases.items()}}


@pytest.mark.parametrize(
    ("result", "options"),
    [
        (result_of({case: SETS if case in {COMPLIANT, RIGID} else HIDDEN_SETS for case in FAST}), ""),
        (result_of({COMPLIANT: 5, RIGID: 5, **{case: HIDDEN_SETS for case in FAST[2:]}}), " --sets 5"),
        (result_of({"adhesion": 4}, runs=20), " --hidden-sets 4 --runs 20 --cases adhesion"),
        (result_of({"chip": HIDDEN_SETS}, mode="full"), " --mode full --cases chip"),
    ],
)
def test_the_command_asks_for_what_the_result_holds(result: dict[str, Any], options: str) -> None:
    asked = set(_command(result).removeprefix("python -m scripts.acceptance_contact").split(" --")) - {""}
    assert asked == set(options.split(" --")) - {""}
