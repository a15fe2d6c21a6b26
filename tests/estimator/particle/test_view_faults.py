"""Views that contradict one another are said to, with the mistake that explains it; views that are misplaced a little are not."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.recipes.recipe import ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.particle.particle import particle_of
from estimator.particle.view_faults import agreed_hull, mirrored, upside_down, view_fault
from synth.sequence import plan_sequence, view_outlines

SMALL = Configuration(hull_resolution=32, directions=50)
Given = tuple[list[Outline], list[CalibratedView]]


@pytest.fixture(scope="module")
def given() -> Given:
    """Six views of one drop, in the first camera's frame."""
    recipe = Recipe(seed=3, particle=ParticleRecipe(irregularity=0.8, size_mm=(6.0, 6.0)), rig=RigRecipe(drops=1))
    plan = plan_sequence(recipe, 0)
    first = plan.views[0]
    turns = [v.R_cam_particle @ first.R_cam_particle.T for v in plan.views]
    views = [
        replace(v, R_cam_particle=R, t_cam_particle=v.t_cam_particle - R @ first.t_cam_particle)
        for v, R in zip(plan.views, turns, strict=True)
    ]
    return list(view_outlines(plan, recipe.noise, np.random.default_rng(1))), views


def turned(given: Given) -> list[Outline]:
    return [mirrored(upside_down(o, v.intrinsics.height_px), v.intrinsics.width_px) for o, v in zip(*given, strict=True)]


def test_poses_from_camera_to_world_are_named(given: Given) -> None:
    outlines, views = given
    inverted = [replace(v, R_cam_particle=v.R_cam_particle.T, t_cam_particle=-v.R_cam_particle.T @ v.t_cam_particle) for v in views]
    assert "poses are inverted" in view_fault(outlines, inverted)


def test_pictures_turned_or_in_the_reverse_order_are_named(given: Given) -> None:
    outlines, views = given
    assert "turned by 180 degrees" in view_fault(turned(given), views)
    assert "in the reverse order" in view_fault(outlines[::-1], views)


def test_what_is_wrong_is_named_where_views_leave_no_hull(given: Given) -> None:
    """The reason was lost: carving raises before mistakes are looked for."""
    outlines, views = given
    transposed = [replace(v, R_cam_particle=v.R_cam_particle.T) for v in views]
    with pytest.raises(InputError, match=r"empty visual hull; a view may not belong\. The calibrated views agree if .*transposed"):
        agreed_hull(outlines, transposed, resolution=24)
    with pytest.raises(InputError, match="transposed"):
        particle_of(outlines, transposed, SMALL)


def test_views_that_contradict_one_another_are_no_body(given: Given) -> None:
    """Also where no mistake explains it: principal points that are off by a third of the body."""
    outlines, views = given
    radius_px = 0.5 * float(np.median([np.ptp(o.points_px, axis=0).max() for o in outlines]))
    shifted = [Outline(o.points_px + np.array([0.3 * radius_px, 0.0])) for o in outlines]
    particle = particle_of(shifted, views, SMALL)
    assert particle.contradictory
    assert particle.fault == ""
    assert "they contradict one another, and no body is measured" in particle.sentence
    assert "uncertainties contain" not in particle.sentence
    named = particle_of(turned(given), views, SMALL)
    assert named.contradictory
    assert "turned by 180 degrees" in named.sentence


def test_views_misplaced_a_little_are_a_body(given: Given) -> None:
    outlines, views = given
    rng = np.random.default_rng(5)
    particle = particle_of([Outline(o.points_px + rng.normal(0.0, 2.0, 2)) for o in outlines], views, SMALL)
    assert particle.disagreement.calibration_px > 0.5
    assert not particle.contradictory
    assert "which the uncertainties contain" in particle.sentence
