"""The rules that the study of twins compares, on made-up errors."""

import pandas as pd
import pytest

from scripts.study_twins import KNOWN, MEAN, TWINS, falls, mean_of


def test_velocities_half_way():
    first = [{"sequence": "s", "v_world": [1.0, 0.0, 0.0], "omega_world": [0.0, 2.0, 0.0]}]
    second = [{"sequence": "s", "v_world": [3.0, 0.0, 0.0], "omega_world": [0.0, 4.0, 0.0]}]
    assert mean_of(first, second) == [{"sequence": "s", "v_world": [2.0, 0.0, 0.0], "omega_world": [0.0, 3.0, 0.0]}]


def test_a_rule_is_as_good_as_what_it_does_to_either():
    """Always the one: right where that is hidden, and as if nothing had been found where the other is."""
    left = {TWINS[0]: (0.1, 1.0), TWINS[1]: (1.0, 0.1), MEAN: (0.5, 0.5), KNOWN: (0.1, 0.1)}
    rows = [
        {"rule": rule, "hidden": hidden, "case": f"{hidden}{i}", "kind": "single", "v_base": 1.0, "v_final": error, "v_bias_chi2": 99.0}
        for rule, errors in left.items()
        for hidden, error in zip(TWINS, errors, strict=True)
        for i in range(3)
    ]
    found = {row["rule"]: row for row in falls(pd.DataFrame(rows))}
    assert [found[TWINS[0]][key] for key in TWINS] == pytest.approx([10.0, 1.0])
    assert found[MEAN]["both"] == pytest.approx(2.0)
    assert (found[KNOWN]["both"], found[KNOWN]["n"]) == (pytest.approx(10.0), 6)
