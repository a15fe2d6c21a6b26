"""The study of real tosses: what counts as free flight, and a page that says what its result file says."""

import json
from pathlib import Path

import numpy as np

from datasets.trajectory_files import read_trajectory, trajectories_in
from scripts.real.real_tosses import CLEAR_M, HALF_WIDTH_M, RATE_HZ, free_flights, plain_falls, write_flights
from scripts.real.real_tosses_page import page

ROOT = Path(__file__).parents[2]


def test_free_flight_ends_before_the_board_and_falls(shared_data: Path, tmp_path: Path) -> None:
    flights = free_flights(shared_data / "tosses" / "cube_tosses.npz")
    assert len(flights) == 60
    assert {8, 24} <= {len(x) for x, _ in flights}
    assert min(x[:, 2].min() for x, _ in flights) > HALF_WIDTH_M + CLEAR_M - 1e-9
    # Every toss falls: a cube that touched the board or a hand would not accelerate downwards by 8 to 11 m/s2.
    falls = plain_falls(flights)[:, 2]
    assert -11.0 < falls.min()
    assert falls.max() < -8.0
    write_flights(flights[:2], tmp_path)
    again = [read_trajectory(path, {}) for path in trajectories_in(tmp_path)]
    np.testing.assert_array_equal(again[1].x_world, flights[1][0])
    np.testing.assert_allclose(np.diff(again[0].times_s), 1.0 / RATE_HZ, atol=1e-12)


def test_the_page_is_that_of_its_result() -> None:
    result = json.loads((ROOT / "docs" / "results" / "real_tosses.json").read_text(encoding="utf-8"))
    assert (ROOT / "docs" / "studies" / "real_tosses.md").read_text(encoding="utf-8") == "\n".join(page(result)).rstrip("\n") + "\n"
