"""Something unknown in clock, lens or segmentation is told to sit there, not in the dynamics."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from datasets.observation import Observation
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.effects import Stage
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.diagnosis.diagnose import diagnose
from estimator.fitting.campaigns.base_model import base_fit
from estimator.measurements.silhouettes.registration import register
from synth.sequence import build_silhouette_sequence
from tests.estimator.small_campaign import recipe

Array = np.ndarray
MIDDLE_PX, WAVE_PX = 512.0, 300.0


def with_points(observation: Observation, moved: Callable[[Array], Array]) -> Observation:
    """The observation with the points of its outlines moved."""
    (outlines,) = observation.recordings
    return replace(observation, recordings=(tuple(Outline(moved(each.points_px)) for each in outlines),))  # type: ignore[union-attr]


def clock_that_swings(observation: Observation) -> Observation:
    """Stamps that run ahead and fall behind by 60 us, once within the recording: faster swings are beyond the degrees of the family."""
    times = observation.clock.times_s
    share = (times - times[0]) / (times[-1] - times[0])
    return replace(observation, clock=Clock(times + 6e-5 * np.sin(2.0 * np.pi * share), observation.clock.exposure_s))


def lens_with_waves(observation: Observation) -> Observation:
    """A picture that is displaced by waves of 1.5 px across it."""
    return with_points(observation, lambda points: points + 1.5 * np.sin((points[:, ::-1] - MIDDLE_PX) / WAVE_PX * np.pi))


def lens_that_breathes(observation: Observation) -> Observation:
    """A magnification that swings by 1 % within the recording."""
    (outlines,) = observation.recordings
    grown = 1.0 + 0.01 * np.sin(2.0 * np.pi * np.arange(len(outlines)) / len(outlines))
    moved = tuple(Outline(MIDDLE_PX + (each.points_px - MIDDLE_PX) * g) for each, g in zip(outlines, grown, strict=True))  # type: ignore[arg-type]
    return replace(observation, recordings=(moved,))


@pytest.mark.parametrize(
    ("spoilt", "stage"), [(clock_that_swings, Stage.CLOCK), (lens_with_waves, Stage.OPTICS), (lens_that_breathes, Stage.OPTICS)]
)
def test_an_unknown_outside_of_the_dynamics_is_told_by_its_stage(spoilt: Callable[[Observation], Observation], stage: Stage) -> None:
    made = recipe(frames=40)
    seen = [spoilt(build_silhouette_sequence(made, i)[0]) for i in range(made.sequences)]
    registered = register(seen, Configuration())
    left = diagnose(registered.campaign, base_fit(registered.campaign, registered.start), {}).unknown
    assert (left.present, left.stage) == (True, stage)
