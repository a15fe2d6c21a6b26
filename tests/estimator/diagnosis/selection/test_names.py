"""One number with several names: what the names leave open widens v, and intervals hold the truth whichever name is right."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.data.configuration import Configuration
from estimator.diagnosis.explain import explain
from estimator.diagnosis.selection.names import possible_names
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.considered import considered
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.reports.campaign_reporting import campaign_estimates
from tests.estimator.confounded_campaigns import CONFOUNDED, confounded

CATALOGUE = {key: effect for key, effect in catalogue().items() if key in CONFOUNDED}


def inside(seed: int) -> np.ndarray:
    """Which components (2, 3, 3) of v, as it is told, lie inside their 95% interval, plain and with what is possible considered."""
    _, _, trajectories, truth = confounded(seed)
    registered = register_trajectories(trajectories)
    found = explain(registered.campaign, registered.start, CATALOGUE)
    best = found.path[-1]
    registered, covariance = replace(registered, campaign=best.campaign), campaign_covariance(best.campaign, best.fit)
    made = {trajectory.name: trajectory for trajectory in trajectories}
    held = []
    for possible in ((), possible_names(best, found.groups)):
        at = considered(best.campaign, best.fit, covariance, possible)
        middles = [each.middle for each in campaign_estimates(registered, made, best.fit, at, Configuration())]
        pulls = [(m.v_world - v) / np.sqrt(np.diag(m.covariance)[:3]) for m, v in zip(middles, truth, strict=True) if m is not None]
        held.append(np.abs(pulls) < 1.96)
    return np.array(held)


def test_intervals_hold_the_truth_whichever_name_is_right() -> None:
    plain, wide = np.array([inside(seed) for seed in (1, 3, 4, 5, 8, 9, 10, 11)]).mean(axis=(0, 2, 3))
    assert plain < 0.75
    assert wide > 0.85


def test_the_number_has_the_same_size_under_each_name() -> None:
    """A clock that is fast by r is lengths short by 2 r, or gravity too strong by 2 r."""
    kind, size, trajectories, _ = confounded(4)
    assert kind == "length_scale"
    registered = register_trajectories(trajectories)
    found = explain(registered.campaign, registered.start, CATALOGUE)
    (group,) = found.groups
    value = {name.key: name.parts[0].mean for name in group if not name.unknown}
    assert value["length_scale"][0] == pytest.approx(size, abs=0.1 * abs(size) + 1e-3)
    assert value["frame_rate"][0] == pytest.approx(0.5 * value["length_scale"][0], rel=0.15)
    assert sum(name.probability for name in group) == pytest.approx(1.0)
    (other, *_) = possible_names(found.path[-1], [group])
    (part,) = group[1].parts
    assert other.covariance[0, 0] == pytest.approx(group[1].probability * (part.mean[0] ** 2 + part.sigma[0] ** 2))
