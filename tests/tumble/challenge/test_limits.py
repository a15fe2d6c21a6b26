"""Detection limits: the size at which a test of the stated power is found as often as stated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from datasets.errors import InputError
from datasets.vocabulary.effects import EFFECTS, PICTURED
from tumble.challenge.limits import (
    TABLE,
    EffectInformation,
    LimitTable,
    OutsideInformation,
    limit_along,
    limits_along,
    noncentrality,
    outside_limit,
    read_table,
    write_table,
)

INFORMATION = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 0.0], [0.0, 0.0, 0.25]])


def made_up_table() -> LimitTable:
    gravity = EffectInformation("gravity", ("dg_x", "dg_y", "dg_z"), (INFORMATION, 4.0 * INFORMATION, 16.0 * INFORMATION), 1, 1)
    pushed = EffectInformation("uniform_acceleration", ("a_x", "a_y", "a_z"), (INFORMATION,), 1, 1)
    blur = EffectInformation("defocus_growth", ("blur",), (np.array([[1e-4]]),), 1, 2)
    wall = OutsideInformation("wall_attraction", "m/s2", (3.0, 0.5), (40, 41))
    return LimitTable(0.01, 25, {"sequences": 4}, {e.key: e for e in (gravity, pushed, blur)}, {wall.key: wall})


@pytest.mark.parametrize("degrees", [1, 3, 12])
def test_the_noncentrality_is_found_as_often_as_asked(degrees: int) -> None:
    rng = np.random.default_rng(5)
    size = noncentrality(1e-3, degrees, 0.95)
    draws = rng.noncentral_chisquare(degrees, size, size=40_000)
    share = float(np.mean(draws > chi2.isf(1e-3, degrees)))
    assert abs(share - 0.95) < 5 * np.sqrt(0.95 * 0.05 / 40_000)


def test_an_effect_at_its_limit_has_the_noncentrality_of_its_p_value() -> None:
    direction = np.array([[0.3, -0.2, 2.0]])
    at_limit = direction * limits_along(made_up_table(), "gravity", direction)[0]
    assert float(at_limit[0] @ INFORMATION @ at_limit[0]) == pytest.approx(noncentrality(0.01 / 25, 3, 0.95))


def test_a_limit_is_where_the_controls_shares_average_what_is_asked() -> None:
    direction = np.array([[1.0, 0.0, 0.0]])
    table = made_up_table()
    each = limits_along(table, "gravity", direction)
    np.testing.assert_allclose(each, each[1] * np.array([2.0, 1.0, 0.5]))
    for probability in (0.5, 0.95):
        limit = limit_along(table, "gravity", direction, probability)
        strength = np.array([1.0, 4.0, 16.0]) * 4.0 * limit**2
        assert float(np.mean(ncx2.sf(chi2.isf(0.01 / 25, 3), 3, strength))) == pytest.approx(probability)
    assert limit_along(table, "gravity", 2.0 * direction) == pytest.approx(limit_along(table, "gravity", direction) / 2.0)


def test_a_limit_outside_of_the_catalogue_is_where_what_is_left_is_found() -> None:
    alone = replace(made_up_table(), outside={"wall_attraction": OutsideInformation("wall_attraction", "m/s2", (3.0,), (40,))})
    assert 3.0 * outside_limit(alone, "wall_attraction") ** 2 == pytest.approx(noncentrality(0.01 / 25, 40, 0.95))
    two = replace(alone, outside={"wall_attraction": OutsideInformation("wall_attraction", "m/s2", (3.0, 0.3), (40, 40))})
    assert outside_limit(alone, "wall_attraction") < outside_limit(two, "wall_attraction")
    assert outside_limit(two, "wall_attraction", 0.5) < outside_limit(two, "wall_attraction", 0.95)


def test_sequences_add_what_they_know() -> None:
    alone, all_alike = np.zeros((4, 3)), np.zeros((4, 3))
    alone[0, 0] = all_alike[:, 0] = 1.0
    one, four = (limit_along(made_up_table(), "uniform_acceleration", u) for u in (alone, all_alike))
    assert one == pytest.approx(2.0 * four)


def test_an_effect_that_counts_by_its_square_has_the_fourth_root() -> None:
    limit = limit_along(made_up_table(), "defocus_growth", np.array([[1.0]]))
    assert 1e-4 * limit**4 == pytest.approx(noncentrality(0.01 / 25, 1, 0.95))


def test_a_smaller_share_needs_a_smaller_size() -> None:
    direction = np.array([[1.0, 1.0, 1.0]])
    assert limit_along(made_up_table(), "gravity", direction, 0.5) < limit_along(made_up_table(), "gravity", direction, 0.95)


def test_a_table_survives_its_file(tmp_path: Path) -> None:
    write_table(made_up_table(), tmp_path / "limits.json")
    back = read_table(tmp_path / "limits.json")
    direction = np.array([[0.3, -0.2, 2.0]])
    assert back.outside == made_up_table().outside
    np.testing.assert_array_equal(limits_along(back, "gravity", direction), limits_along(made_up_table(), "gravity", direction))


def test_the_committed_table_has_every_effect_of_the_catalogue() -> None:
    table = read_table(TABLE)
    assert set(table.effects) == set(PICTURED)
    for key, effect in table.effects.items():
        assert effect.parameters == EFFECTS[key].sizes
        assert all(np.all(np.linalg.eigvalsh(matrix) > 0) for matrix in effect.information)


@pytest.mark.parametrize("content", [None, "{", '{"alpha": 0.01}'])
def test_a_bad_table_is_named(content: str | None, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / "limits.json").write_text(content)
    with pytest.raises(InputError, match=r"limits\.json: expected a table"):
        read_table(tmp_path / "limits.json")
