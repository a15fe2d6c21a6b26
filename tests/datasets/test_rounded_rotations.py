"""Rotation matrices as they are published, with a few digits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.observation import Companion, Observation
from datasets.observation_files import read_observation, write_observation
from datasets.vocabulary.frames import geodesic_angle, is_rotation


def rounded(obs: Observation, digits: int) -> Observation:
    """The observation with the matrices of its camera and of its second view rounded."""
    R = np.round(Rotation.from_rotvec([0.3, -0.2, 0.7]).as_matrix(), digits)
    views = (obs.views[0], replace(obs.views[1], R_cam_particle=R))
    return replace(obs, cameras=(replace(obs.cameras[0], R_cam_world=R),), views=views)


def through_files(obs: Observation, folder: Path) -> Observation:
    write_observation(obs, folder)
    return read_observation(folder)


@pytest.mark.parametrize(("digits", "angle_rad"), [(5, 1e-5), (4, 1e-4)])
def test_rounded_matrices_become_rotations_and_a_note_says_so(outline_observation, tmp_path, digits, angle_rad):
    given = rounded(outline_observation, digits)
    found = through_files(given, tmp_path / "o")
    for before, after in (
        (given.cameras[0].R_cam_world, found.cameras[0].R_cam_world),
        (given.views[1].R_cam_particle, found.views[1].R_cam_particle),
    ):
        assert not is_rotation(before)
        assert is_rotation(after, tolerance=1e-14)
        assert geodesic_angle(Rotation.from_rotvec([0.3, -0.2, 0.7]).as_matrix(), after) < angle_rad
    (note,) = found.notes
    assert note.startswith(f"{tmp_path / 'o' / 'observation.json'}: at $.cameras[0].R_cam_world (and 1 more): rows miss")


def test_exact_matrices_stay_as_they_are(outline_observation, tmp_path):
    found = through_files(outline_observation, tmp_path / "o")
    assert found.notes == ()
    assert np.array_equal(found.views[1].R_cam_particle, outline_observation.views[1].R_cam_particle)


def test_two_digits_are_too_few(outline_observation, tmp_path):
    with pytest.raises(InputError, match=r"R_cam_world: expected a rotation .*miss orthonormality by 0\.00"):
        through_files(rounded(outline_observation, 2), tmp_path / "o")


def test_views_of_a_second_particle(outline_observation, tmp_path):
    given = rounded(outline_observation, 5)
    pair = replace(
        outline_observation,
        companion=Companion(given.views, given.view_recording),
        further_recordings=outline_observation.recordings,
    )
    found = through_files(pair, tmp_path / "o")
    assert found.companion is not None
    assert is_rotation(found.companion.views[1].R_cam_particle, tolerance=1e-14)
    assert "$.companion.views.cameras[1].R_cam_particle" in found.notes[0]
