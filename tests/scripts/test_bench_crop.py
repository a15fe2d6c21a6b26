"""The benchmark's test of agreement finds what it claims to find, and its particle covers what it claims to cover."""

import json
from typing import Literal

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, shift

from scripts.benchmarks.bench_crop import SHARE, Case, agreement, covered_share, recipe_of
from scripts.benchmarks.page_bench_crop import PAGE, RESULT, page

REPETITIONS, SIGMA = 7, 0.02


def pictures(rng: np.random.Generator, *, moved_px: float = 0.0, brighter: float = 0.0, wrong: float = 0.0) -> np.ndarray:
    """Repetitions of one blurred disk with independent noise at its edge; ``wrong``: an error that repeats, in units of the noise."""
    y, x = np.mgrid[:80, :80]
    disk = gaussian_filter((np.hypot(x - 40.0, y - 38.0) < 25).astype(float), 1.5)
    edge = SIGMA * np.sqrt(np.clip(4 * disk * (1 - disk), 0, 1))
    repeated = shift(disk, (0, moved_px), order=3) + brighter * edge + wrong * edge * np.random.default_rng(9).normal(size=disk.shape)
    return repeated + edge * rng.normal(size=(REPETITIONS, *disk.shape))


def test_equal_pictures_agree() -> None:
    rng = np.random.default_rng(1)
    seen = agreement(pictures(rng), pictures(rng))
    assert abs(seen["z"]) < 3.3
    assert abs(seen["s"] - 1) < 0.1
    for k in "xy":
        assert abs(seen[f"shift_{k}_px"]) < 3.3 * seen[f"shift_{k}_error_px"]


def test_a_displacement_is_measured() -> None:
    rng = np.random.default_rng(2)
    seen = agreement(pictures(rng, moved_px=0.05), pictures(rng))
    assert seen["shift_x_px"] == pytest.approx(0.05, abs=4 * seen["shift_x_error_px"])
    assert seen["shift_x_px"] > 10 * seen["shift_x_error_px"]
    assert abs(seen["shift_y_px"]) < 4 * seen["shift_y_error_px"]


def test_another_brightness_and_a_fixed_error_are_seen() -> None:
    rng = np.random.default_rng(3)
    assert agreement(pictures(rng, brighter=0.5), pictures(rng))["z"] > 3.3
    assert agreement(pictures(rng, wrong=0.5), pictures(rng))["s"] > 1.1


@pytest.mark.parametrize("covering", ["bounding box", "silhouette"])
def test_the_particle_covers_a_sixteenth(covering: Literal["bounding box", "silhouette"]) -> None:
    recipe = recipe_of(Case("matte", "scalar_rgb", 2, limit=True, covering=covering))
    assert covered_share(recipe, covering) == pytest.approx(SHARE, rel=0.01)
    assert covered_share(recipe, "silhouette") < 0.9 * covered_share(recipe, "bounding box")


def test_the_page_is_that_of_the_result_file() -> None:
    figures = json.loads(RESULT.read_text(encoding="utf-8"))
    assert PAGE.read_text(encoding="utf-8") == page(figures)
    faster = [entry for entry in figures if entry["name"].endswith("full frame over crop") and "limit" in entry]
    assert len(faster) == 2
    assert all(entry["value"] >= entry["limit"] >= 5.0 for entry in faster)
    assert all(entry["value"] <= entry["limit"] for entry in figures if entry.get("direction") == "lower")
