"""Bodies that are not what the calibrated views show."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.recipe import EffectRecipe, MotionRecipe, NoiseRecipe, Recipe, RigRecipe
from datasets.vocabulary.outline import signed_area
from synth.plan import particle_poses_in_camera
from synth.sequence import build_silhouette_sequence, plan_sequence

RECIPE = Recipe(
    seed=3,
    motion=MotionRecipe(frames=6, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0)),
    rig=RigRecipe(drops=1),
    noise=NoiseRecipe(hsv_boundary_px=0.0, rig_boundary_px=0.0, spacing_px=0.2),
)


def with_effect(key: str, **values: float) -> Recipe:
    return replace(RECIPE, effects=(EffectRecipe(key, values),))


def test_a_larger_body(in_force, body) -> None:
    larger = in_force("length_scale", relative=0.1).flying_body(body)
    centre = body.body.com_particle
    np.testing.assert_allclose(larger.vertices - centre, 1.1 * (body.vertices - centre), atol=1e-18)
    assert larger.mass_kg == pytest.approx(1.1**3 * body.mass_kg)
    np.testing.assert_allclose(larger.inertia_kgm2, 1.1**5 * body.inertia_kgm2)
    np.testing.assert_array_equal(larger.body.inertia_ratios, body.body.inertia_ratios)


def test_frames_show_the_larger_body_and_views_do_not() -> None:
    (plain, _), (seen, truth) = (build_silhouette_sequence(r, 0) for r in (RECIPE, with_effect("length_scale", relative=0.02)))
    for a, b in zip(plain.view_recording, seen.view_recording, strict=True):
        np.testing.assert_array_equal(a.points_px, b.points_px)
    ratios = [signed_area(b.points_px) / signed_area(a.points_px) for a, b in zip(plain.recordings[0], seen.recordings[0], strict=True)]
    np.testing.assert_allclose(ratios, 1.02**2, rtol=2e-3)
    assert seen.mass_kg == pytest.approx(plain.mass_kg * 1.02**3)
    assert truth.mass_kg == seen.mass_kg


def test_gravity_acts_at_the_displaced_centre_of_mass(in_force, body) -> None:
    moved = in_force("centre_of_mass", c1=1e-4, c3=-2e-4).flying_body(body)
    np.testing.assert_allclose(moved.body.com_particle - body.body.com_particle, [1e-4, 0, -2e-4], atol=1e-19)
    np.testing.assert_array_equal(moved.inertia_kgm2, body.inertia_kgm2)
    np.testing.assert_array_equal(moved.vertices, body.vertices)


def test_the_shape_turns_about_the_displaced_centre_of_mass() -> None:
    plain, plan = plan_sequence(RECIPE, 0), plan_sequence(with_effect("centre_of_mass", c1=2e-4), 0)
    R, t = particle_poses_in_camera(plan.body, plan.motion, plan.hsv)
    com = np.einsum("nij,j->ni", R, plan.body.com_particle) + t
    uniform = np.einsum("nij,j->ni", R, plain.body.com_particle) + t
    fall = 0.5 * plan.gravity_world * plan.true_times_s[:, None] ** 2
    straight = com - fall
    assert np.abs(np.diff(straight, n=2, axis=0)).max() < 1e-15
    assert np.abs(np.diff(uniform - fall, n=2, axis=0)).max() > 1e-8
    np.testing.assert_allclose(np.linalg.norm(uniform - com, axis=1), 2e-4, atol=1e-15)


def test_momentum_is_that_of_the_changed_moments() -> None:
    plan = plan_sequence(with_effect("inertia_ratios", e1=0.2, e2=-0.05), 0)
    plain = plan_sequence(RECIPE, 0)

    def momentum_spread(ratios: np.ndarray) -> float:
        R = Rotation.from_quat(plan.motion.q_world_body)
        momentum = R.apply(ratios * R.inv().apply(plan.motion.omega_world))
        return float(np.ptp(momentum, axis=0).max() / np.linalg.norm(momentum[0]))

    assert momentum_spread(plan.body.inertia_ratios) < 1e-12
    assert momentum_spread(plain.body.inertia_ratios) > 1e-6
    np.testing.assert_allclose(plan.inertia_kgm2 / plain.inertia_kgm2, [1.2, 0.95, 1.0])


def test_moments_that_no_body_has(in_force, body) -> None:
    with pytest.raises(InputError, match="no moment exceeds the sum of the others"):
        in_force("inertia_ratios", e1=-0.6, e2=-0.3).flying_body(body)


def test_principal_axes_that_are_not_those_of_the_uniform_body(in_force, body) -> None:
    found = in_force("products_of_inertia", e12=0.05, e13=-0.02, e23=0.03).flying_body(body)
    R, root = found.body.R_particle_body, np.sqrt(body.inertia_kgm2)
    unit = np.array([[1.0, 0.05, -0.02], [0.05, 1.0, 0.03], [-0.02, 0.03, 1.0]])
    np.testing.assert_allclose(R @ np.diag(found.inertia_kgm2) @ R.T, root[:, None] * unit * root, rtol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(found.body.inertia_ratios, found.inertia_kgm2 / found.inertia_kgm2.max())
    with pytest.raises(InputError, match="no moment exceeds the sum of the others"):
        in_force("products_of_inertia", e12=0.9, e13=0.0, e23=0.0).flying_body(body)
