"""Campaigns whose calibrated views disagree go on with views where the surface's fit has moved them to."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.observation import CalibratedView
from estimator.data.configuration import Configuration
from estimator.measurements.outlines.registration import by_samples
from estimator.measurements.silhouettes.registration import register
from synth.rig import miscalibrated
from tests.estimator import small_campaign
from tests.estimator.measurements.outlines.sampled_campaign import COARSE, registered

OFF_PX, RADIUS_M = 1.0, 3e-3


def off_rad(views: Sequence[CalibratedView], true: Sequence[CalibratedView]) -> float:
    """RMS angle (rad) by which views are turned from where they are, but for one turn of all."""
    each = Rotation.from_matrix([t.R_cam_particle.T @ v.R_cam_particle for v, t in zip(views, true, strict=True)])
    return float(np.sqrt(np.mean((each.mean().inv() * each).magnitude() ** 2)))


def test_views_that_disagree_are_where_the_surface_meets_them() -> None:
    """Left where they were, they were lengths, a frame rate or an acceleration of campaigns in which nothing is hidden."""
    given, rng = small_campaign.observations(), np.random.default_rng(8)
    off = tuple(miscalibrated(view, np.zeros(3), RADIUS_M, OFF_PX, rng) for view in given[0].views)
    seen = register([replace(each, views=off) for each in given], Configuration())
    assert seen.particles[0].disagreement.beyond_noise
    found = by_samples(seen, [], Configuration(campaign_surface_fit=2), subdivisions=COARSE)
    views = {id(each.particle): each.particle.calibrated for each in found.campaign.sequences}
    assert len(views) == 1
    assert off_rad(*views.values(), given[0].views) < 0.5 * off_rad(off, given[0].views)


def test_views_that_agree_stay() -> None:
    task = registered().campaign.sequences[0]
    assert not task.particle.disagreement.beyond_noise
    assert task.particle.calibrated is registered().particles[0].calibrated
