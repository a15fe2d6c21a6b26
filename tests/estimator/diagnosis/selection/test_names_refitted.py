"""Names of what was found are judged by fits of their own: far from the fit that was found the linearised evidence of a set is too high."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from scipy.signal import lfilter

from datasets.trajectory_files import read_trajectory
from estimator.diagnosis.adding import fit_with
from estimator.diagnosis.explain import Explanation, explain
from estimator.diagnosis.selection.path import looked_at
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, measured

G, HELD, DRAG, NOISE, ALIKE = 9.81, 7.6, 2.7, 0.0017, 0.6
"""m/s2, m/s2, 1/s, m, and correlation of the noise of neighbouring rows."""
ROWS, BEFORE, STEP_S = 27, 50, 0.0247
TOO_WEAK = {"unmeasured_lift", "gravity", "frame_rate", "length_scale", "position_distortion"}
"""What cannot hold a fall back by three quarters of gravity: the lift of a vertical flight is sideways, the others are not that wrong."""


@cache
def light_filter(seed: int) -> Explanation:
    """A filter for coffee that falls along z alone: air carries most of its weight from the start, and slows it."""
    t = STEP_S * np.arange(ROWS)
    limit = (G - HELD) / DRAG
    white = np.random.default_rng(seed).normal(size=ROWS + BEFORE)
    noise = lfilter([NOISE * np.sqrt(1.0 - ALIKE**2)], [1.0, -ALIKE], white)[BEFORE:]
    z = 0.42 - limit * (t - (1.0 - np.exp(-DRAG * t)) / DRAG) + noise
    with TemporaryDirectory() as folder:
        path = Path(folder) / "filter.csv"
        path.write_text("t_s,z_m\n" + "".join(f"{a:.4f},{b:.4f}\n" for a, b in zip(t, z, strict=True)))
        registered = register_trajectories([read_trajectory(path, {"gravity_world": [0.0, 0.0, -G]})])
    return explain(registered.campaign, registered.start, catalogue())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_is_too_weak_is_no_name(seed: int) -> None:
    """About the fit with a drag and a wind a lift had 10% of the wind's probability (seed 2); its own fit is worse by a thousand times."""
    found = light_filter(seed)
    named = {part.key: name.probability for step in found.steps for name in step.names for part in name.parts}
    assert not TOO_WEAK & {key for key, probability in named.items() if probability > 0.01}, named


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_wind_alone_is_nothing(seed: int) -> None:
    """Not even about a fit with a drag, where it has a signature."""
    found = light_filter(seed)
    assert {"linear_drag", "quadratic_drag"} & set(found.last.keys)
    trial = looked_at(found.campaign, found.fit, {"steady_wind": catalogue()["steady_wind"]}).trial
    (wind,) = (e for e, key in enumerate(trial.evidence.of.keys) if key == "steady_wind")
    assert trial.evidence.log_evidence((wind,)) == trial.evidence.log_evidence(())


@pytest.mark.parametrize("seen", [[0, 1, 2], [0, 2]], ids=["in space", "in a plane"])
def test_fits_with_each_name_of_one_number_are_as_probable(seen: list[int]) -> None:
    """Flights are all longer or slower by a factor beside it: what is integrated over them has no unit. Gravity fits noise by two more."""
    rng = np.random.default_rng(6)
    made = [measured(f"toss_{i}", rng, Hidden(), Tracker(rows=20, orientation=False)) for i in range(30)]
    unseen = np.where(np.isin(np.arange(3), seen), 1.0, np.nan)
    registered = register_trajectories([replace(each, x_world=0.95 * each.x_world * unseen) for each in made])
    names, likely = catalogue(), []
    for key in ("length_scale", "frame_rate", "gravity"):
        at = looked_at(*fit_with(registered.campaign, registered.start, [names[key]]), {})
        likely.append(at.trial.evidence.fitted(at.members).log_likelihood)
    assert abs(likely[0] - likely[1]) < 0.3
    assert abs(likely[2] - likely[0]) < 2.5
