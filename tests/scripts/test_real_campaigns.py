"""Importers of real campaigns: the rules on made-up data, the data themselves where they are there."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.trajectory_files import read_trajectory, trajectories_in
from scripts.real.real_campaigns import CAMPAIGNS, SLOWED, SPUN, slowing, spin_sigma, standing_axes

COUNTS = {"tosses": 60, "table_tennis": 37, "spinning_disc": 1}


def test_the_noise_of_a_spin_is_that_of_its_size_along_it_and_of_its_direction_across() -> None:
    np.testing.assert_allclose(spin_sigma(np.array([0.0, 0.0, 300.0])), [300.0 * np.radians(2.4)] * 2 + [3.0])


def test_the_stretch_begins_where_it_is_let_go_and_ends_at_half_the_spin_or_at_saturation() -> None:
    spin = np.concatenate([np.linspace(0.0, 1000.0, 50), np.linspace(1000.0, 100.0, 200)])
    gyro = np.column_stack([spin, np.zeros((len(spin), 2))])
    first, last = slowing(gyro)
    assert spin[first] >= SPUN * 1000.0 > spin[first + 1]
    assert spin[last] < SLOWED * 1000.0 <= spin[last - 1]
    gyro[first + 20, 0] = 2000.0
    gyro[first - 40 : first, 0] = 2100.0
    assert slowing(gyro)[1] <= first + 20


def test_a_spin_that_stands_still_in_the_world_does_so_again() -> None:
    times, spin = np.arange(200) / 100.0, np.array([1.0, -2.0, 5.0])
    R = Rotation.from_rotvec(spin * times[:, None])
    np.testing.assert_allclose(standing_axes(times, R.inv().apply(spin)), np.tile(spin, (200, 1)), atol=1e-9)
    # A body that rolls: its own axes turn about its third one as well.
    rolling = Rotation.from_rotvec(np.array([0.0, 0.0, 2.0]) * times[:, None])
    turned = R * rolling
    read = turned.inv().apply(spin) + np.array([0.0, 0.0, 2.0])
    world = np.tile(spin, (200, 1)) + R.apply([0.0, 0.0, 2.0])
    np.testing.assert_allclose(standing_axes(times, read), world, atol=2e-3)


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_every_campaign_is_read_again(name: str, tmp_path: Path, shared_data: Path) -> None:
    assert CAMPAIGNS[name](shared_data, tmp_path) == COUNTS[name]
    found = [read_trajectory(path, {}) for path in trajectories_in(tmp_path)]
    assert len(found) == COUNTS[name]
    if name == "table_tennis":
        assert all(t.sigma_omega is not None and np.isfinite(t.sigma_omega).sum() == 3 for t in found)
