"""The table of detection limits, put together from what campaigns of its own wrote."""

import json
from pathlib import Path

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.vocabulary.effects import EFFECTS, PICTURED
from tumble.challenge.drawing import LARGEST, Shape
from tumble.challenge.limit_making import LARGE, SMALLEST_SHARE, development_large, table_of

SHAPE = Shape(sequences=2, frames=30, views=8)


def products(folder: Path, large: int, keys: tuple[str, ...] = LARGE) -> list[Path]:
    """What two controls and some campaigns with large effects wrote, which know a hundredth of them."""
    small = {key: np.eye(len(EFFECTS[key].sizes)).tolist() for key in PICTURED}
    written = [{"campaign": f"c{i}", "information": small} for i in range(2)]
    for key in keys:
        known = {key: (0.01 * np.eye(len(EFFECTS[key].sizes))).tolist()}
        written += [{"campaign": f"{key}{i}", "large": key, "information": known} for i in range(large)]
    paths = [folder / f"{each['campaign']}.json" for each in written]
    for path, each in zip(paths, written, strict=True):
        path.write_text(json.dumps(each))
    return paths


def test_effects_that_only_show_where_they_are_large_are_measured_there(tmp_path: Path) -> None:
    table = table_of(products(tmp_path, large=3), SHAPE, 4)
    assert [float(each[0, 0]) for each in table.effects["focal_length"].information] == [0.01] * 3
    assert len(table.effects["gravity"].information) == 2
    assert table.campaign["large"] == {"focal_length": 3, "principal_point": 3}
    assert table.campaign["controls"] == 2


def test_without_such_campaigns_the_controls_tell(tmp_path: Path) -> None:
    table = table_of(products(tmp_path, large=0), SHAPE, 4)
    assert len(table.effects["focal_length"].information) == 2
    assert table.campaign["large"] == {}


def test_an_effect_whose_campaigns_all_failed_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="principal_point"):
        table_of(products(tmp_path, large=2, keys=("focal_length",)), SHAPE, 4)


@pytest.mark.parametrize("key", LARGE)
def test_their_sizes_are_a_good_part_of_the_largest_and_of_both_signs(key: str) -> None:
    cases = [case for case in development_large(SHAPE, 24, 4) if case.keys == (key,)]
    assert len(cases) == 24
    values = np.array([[case.recipe.effects[0].values[name] for name in EFFECTS[key].sizes] for case in cases])
    largest = np.abs(values).max(axis=1) / LARGEST[key]
    assert np.all((largest >= SMALLEST_SHARE) & (largest <= 1.0))
    assert (values > 0).any()
    assert (values < 0).any()
    assert len({case.recipe.seed for case in development_large(SHAPE, 24, 4)}) == 48
