"""Heights at impacts are those of the mesh where lengths are right, and tell by how much they are wrong."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.vocabulary.plate import Plate
from estimator.contact_validation.heights import heights_against
from estimator.contact_validation.laws.point_contact import PointContact
from estimator.contact_validation.measured import MeasuredImpact
from tests.estimator.contact_validation.made_impacts import made_impacts

OFFSET = 0.004
SIGMA = 1e-5


def impacts(scale: float, *, count: int = 24, seed: int = 3) -> list[MeasuredImpact]:
    """Impacts on one plane at ``OFFSET``, recorded in lengths ``scale`` too short."""
    rng = np.random.default_rng(seed)
    made = []
    for impact in made_impacts(PointContact(0.6, 0.2), count, seed):
        plate = Plate(np.zeros(3), np.array([0.0, 0.0, 1.0]))
        R = Rotation.random(rng=rng).as_matrix()
        depth = -(impact.particle.vertices_body @ R.T)[:, 2].min()
        x = np.array([*rng.normal(0.0, 0.01, 2), OFFSET + depth / (1.0 + scale)]) + rng.normal(0.0, SIGMA, 3)
        turned = Rotation.from_rotvec(rng.normal(0.0, 1e-3, 3)).as_matrix() @ R
        made.append(replace(impact, plate=plate, state=replace(impact.state, x_world=x, R_world_body=turned)))
    return made


@pytest.mark.parametrize("scale", [0.0, 0.05, -0.03])
def test_lengths_and_the_plane_are_found(scale: float) -> None:
    found = heights_against(impacts(scale))
    assert found is not None
    assert abs(found.scale - scale) < 3.0 * found.scale_sigma
    assert abs(found.offset_m - OFFSET) < 3.0 * found.offset_sigma_m
    assert found.scale_sigma < 0.02


def test_errors_are_as_large_as_stated() -> None:
    found = [heights_against(impacts(0.02, seed=seed)) for seed in range(12)]
    pulls = np.array([(each.scale - 0.02) / each.scale_sigma for each in found if each is not None])
    assert len(pulls) == len(found)
    assert 0.5 < np.sqrt(np.mean(pulls**2)) < 1.6


def test_events_that_are_no_impacts_do_not_matter() -> None:
    made = impacts(0.02)
    for i in (3, 11, 17):
        made[i] = replace(made[i], state=replace(made[i].state, x_world=made[i].state.x_world + np.array([0.0, 0.0, 0.01])))
    found = heights_against(made)
    assert found is not None
    assert abs(found.scale - 0.02) < 3.0 * found.scale_sigma < 0.06


def test_nothing_is_said_of_few_impacts_or_of_several_planes() -> None:
    made = impacts(0.0)
    assert heights_against(made[:3]) is None
    tilted = replace(made[0], plate=Plate(np.zeros(3), np.array([0.0, 0.6, 0.8])))
    assert heights_against([tilted, *made[1:]]) is None
