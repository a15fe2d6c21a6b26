"""Flights beside an impact that cannot be flown end the chain they belong to, not the measurement."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.impacts import chains
from estimator.motion.rigid_body import RanAway
from tests.estimator.small_campaign import registered


def test_a_neighbour_that_ran_away_has_no_pose_to_share() -> None:
    sequence, flight = registered().campaign.sequences[0], registered().start.flights[0]
    gone = replace(flight, q=np.full(4, np.nan))
    later = float(sequence.task.sightings.times_s[-1]) + 0.01
    found = chains._shared_pose(sequence.task, flight, later, 0)
    assert np.isfinite(found.poses.R).all()
    with pytest.raises(RanAway):
        chains._shared_pose(sequence.task, gone, later, 0)
