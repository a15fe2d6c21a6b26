"""A usual mistake in the input is named, and only where taking it back makes the outlines fit."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.impacts.chains import Seen
from estimator.measure import measure
from estimator.measuring.input_faults import _of_times, input_fault
from estimator.outlines.sightings import tracks_of
from estimator.particle.observed import observed_particle
from estimator.particle.view_faults import mirrored, upside_down, view_fault
from synth.sequence import build_silhouette_sequence

pytestmark = pytest.mark.long

RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(family="cut_stone", irregularity=0.6),
    motion=MotionRecipe(frames=50, speed_ms=(1.5, 1.5), spin_rads=(120.0, 120.0)),
    rig=RigRecipe(drops=3),
)


@pytest.fixture(scope="module")
def sequence() -> Observation:
    return build_silhouette_sequence(RECIPE, 0)[0]


def outlines_of_views(sequence: Observation) -> list[Outline]:
    return list(sequence.view_recording)  # type: ignore[arg-type]


def test_gravity_upside_down_is_named(sequence: Observation) -> None:
    estimate = measure(replace(sequence, gravity_world=-sequence.gravity_world), Configuration())
    assert estimate.statistics["input_fault"] == "gravity"
    assert "check the sign of gravity_world" in estimate.message


def test_pictures_counted_upwards_are_named(sequence: Observation) -> None:
    height = sequence.cameras[0].intrinsics.height_px
    turned = tuple(upside_down(o, height) for o in sequence.recordings[0])  # type: ignore[union-attr]
    estimate = measure(replace(sequence, recordings=(turned,)), Configuration())
    assert estimate.statistics["input_fault"] == "image_y"


def test_mirrored_pictures_are_named(sequence: Observation) -> None:
    width = sequence.cameras[0].intrinsics.width_px
    turned = tuple(mirrored(o, width) for o in sequence.recordings[0])  # type: ignore[union-attr]
    estimate = measure(replace(sequence, recordings=(turned,)), Configuration())
    assert estimate.statistics["input_fault"] == "image_x"


def test_nothing_is_wrong_with_outlines_that_fit_whatever_does_not_settle(sequence: Observation) -> None:
    """As of a ball, whose turning about itself no outline shows."""
    seen = Seen(sequence, tracks_of(sequence), observed_particle(sequence, Configuration()))
    unsettled = Estimate("ball", Status.NO_CONVERGENCE, "the last refinement did not settle.", statistics={"adequacy": {"adequate": True}})
    assert input_fault(seen, unsettled, Configuration()) is None


def test_transposed_views_are_named(sequence: Observation) -> None:
    transposed = [replace(v, R_cam_particle=v.R_cam_particle.T) for v in sequence.views]
    assert "transposed" in view_fault(outlines_of_views(sequence), transposed)


def test_views_counted_upwards_are_named(sequence: Observation) -> None:
    turned = [upside_down(o, v.intrinsics.height_px) for o, v in zip(outlines_of_views(sequence), sequence.views, strict=True)]
    assert "counted upwards" in view_fault(turned, sequence.views)


def test_mirrored_views_are_named(sequence: Observation) -> None:
    turned = [mirrored(o, v.intrinsics.width_px) for o, v in zip(outlines_of_views(sequence), sequence.views, strict=True)]
    assert "mirrored" in view_fault(turned, sequence.views)


def test_right_views_have_no_fault(sequence: Observation) -> None:
    assert view_fault(outlines_of_views(sequence), sequence.views) == ""


@pytest.mark.parametrize(("factor", "keys"), [(1.0, []), (1e3, ["times_ms"]), (1e6, ["times_us"]), (1e-3, ["times_short"])])
def test_only_times_of_no_camera_are_corrected(factor: float, keys: list[str]) -> None:
    assert [each.key for each in _of_times(factor * np.arange(20) / 4000.0)] == keys
