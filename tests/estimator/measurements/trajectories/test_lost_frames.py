"""Frames that were lost and not counted are no noise: they are found as what they are, in few flights or in all."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.trajectory import Trajectory
from estimator.diagnosis.explain import explain
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign


def without_two(each: Trajectory) -> Trajectory:
    """A recording that lost two frames and counted on."""
    kept = np.delete(np.arange(len(each.times_s)), [6, 7])
    q = each.q_world_tracked
    return replace(each, times_s=each.times_s[:-2], x_world=each.x_world[kept], q_world_tracked=None if q is None else q[kept])


@pytest.mark.parametrize("lost", [2, 8])
def test_frames_that_were_lost_are_not_told_as_drag(lost: int) -> None:
    made = campaign(4, Hidden(), Tracker(rows=18), sequences=8)
    registered = register_trajectories([without_two(each) if i < lost else each for i, each in enumerate(made)])
    whole = register_trajectories(made)
    assert np.all(registered.campaign.sequences[-1].sigma[5] < 2.0 * whole.campaign.sequences[-1].sigma[5])
    found = explain(registered.campaign, registered.start, catalogue())
    assert found.found == ("dropped_frames",)
    part = found.fit.model.slices[found.fit.model.keys.index("dropped_frames")]
    counts = [theta[part][0] for theta in found.fit.state.theta]
    np.testing.assert_allclose(counts[:lost], 2.0, atol=0.2)
