"""Sets of views merged: placements against the truth, derivatives, covariance, and what does not belong."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.recipe import ParticleRecipe
from datasets.vocabulary.outline import Outline
from estimator.data.views import Poses
from estimator.geometry.silhouettes import silhouettes
from estimator.merging import merge as merge_module
from estimator.merging.consistency import agree
from estimator.merging.even_rotations import even_rotations
from estimator.merging.fitted import MergeSettings
from estimator.merging.joint import JointTask, Placements, RigErrors, _equations, _linear, fit_jointly
from estimator.merging.leaving_out import sets_again
from estimator.merging.merge import Merged, merge
from estimator.merging.prediction import largest_gap, predicted_views
from estimator.merging.set_motion import MotionEffort, SetMotions, find_motions
from estimator.merging.solid import solid_figures
from estimator.merging.view_set import ViewSet, view_set
from estimator.motion.rotation import rotation_from_vector
from scripts.trials.study_shape import Rendered, against_truth, rendered, sets_of, withheld
from tests.estimator.exact import ellipsoid_outline, rig

SETTINGS = MergeSettings(effort=MotionEffort(starts=600, coarse=24))
STONE = ParticleRecipe(size_mm=(6.0, 6.0))


@pytest.fixture(scope="module")
def made() -> Rendered:
    return rendered("stone", STONE, 21, drops=4)


@pytest.fixture(scope="module")
def sets(made: Rendered) -> list[ViewSet]:
    return sets_of(made.drops)


@pytest.fixture(scope="module")
def merged(sets: list[ViewSet]) -> Merged:
    return merge(sets, SETTINGS)


@pytest.fixture(scope="module")
def foreign() -> Rendered:
    return rendered("other", STONE, 77, drops=1)


def task_of(sets: list[ViewSet]) -> JointTask:
    outlines, views = [o for s in sets for o in s.outlines], [v for s in sets for v in s.views]
    return JointTask(
        seen=silhouettes(outlines, [v.intrinsics for v in views]),
        in_set=replace(sets[0].poses, R=np.concatenate([s.poses.R for s in sets]), t=np.concatenate([s.poses.t for s in sets])),
        set_of=np.repeat(np.arange(len(sets)), [len(s) for s in sets]),
        pivot=sets[0].centre,
        used=np.ones(len(views), dtype=np.bool_),
        huber=4.0,
    )


def true_placements(made: Rendered) -> Placements:
    R = made.R @ made.R[0].T
    return Placements(R, made.t - R @ made.t[0])


def test_sets_are_placed_as_they_truly_lie(made: Rendered, merged: Merged) -> None:
    found = against_truth(merged, made.R, made.t, np.zeros(3))
    assert merged.placed == (0, 1, 2, 3)
    assert merged.left_out == ()
    assert found["relative_rotation_deg"]["largest"] < 0.25
    assert found["chi_square_per_number"] < 2.5
    assert all(edge.votes == 2 for edge in merged.consensus.edges.values())
    assert float(merged.set_rms_px.max()) < 0.25


def test_a_set_taken_out_is_placed_again_by_the_others(sets: list[ViewSet], merged: Merged) -> None:
    again = sets_again(sets[:3], merge(sets[:3], SETTINGS), SETTINGS)
    assert [a.fault for a in again] == ["", "", ""]
    assert max(a.turned_deg for a in again) < 0.2
    assert max(a.moved_m for a in again) < 2e-6


def test_derivatives_are_those_of_differences(made: Rendered, sets: list[ViewSet]) -> None:
    task, at = task_of(sets), true_placements(made)
    J = _linear(task, at)[1].J
    for column in (0, 4, 8, 11, 17):
        step = np.zeros(24)
        step[6 + column] = 1e-7 if column % 6 < 3 else 1e-6
        ahead, behind = (_linear(task, at.moved(sign * step.reshape(4, 6), task.pivot))[1].e for sign in (1.0, -1.0))
        difference = (ahead - behind) / (2.0 * step[6 + column])
        assert np.quantile(np.abs(difference - J[:, column]), 0.9) <= 1e-5 * np.abs(J[:, column]).max()


def test_derivatives_by_the_cameras_are_those_of_differences(made: Rendered, sets: list[ViewSet], rng: np.random.Generator) -> None:
    task, at = task_of(sets), true_placements(made)
    camera_of = np.array([v.camera for s in sets for v in s.views])
    rig = RigErrors(camera_of, np.tile([1e-4, -2e-4, 1.2], (6, 1)), np.ones((6, 6)))
    task = replace(task, rig=rig)
    at = replace(at, rig_R=rotation_from_vector(rng.normal(0.0, 3e-3, (6, 3))), rig_t=rng.normal(0.0, 1e-5, (6, 3)))
    J = _linear(task, at)[1].J
    assert J.shape[1] == 18 + 36
    for column in (18, 21, 28, 40, 53):
        step = np.zeros(54)
        step[column] = 1e-7 if (column - 18) % 6 < 3 else 1e-6
        ahead, behind = (_linear(task, task.moved(at, sign * step))[1].e for sign in (1.0, -1.0))
        difference = (ahead - behind) / (2.0 * step[column])
        assert np.quantile(np.abs(difference - J[:, column]), 0.9) <= 1e-5 * np.abs(J[:, column]).max()


def test_errors_of_the_rig_are_found_and_taken_back(made: Rendered, sets: list[ViewSet], rng: np.random.Generator) -> None:
    """Every camera is off by some 10 µm (0.6 px) and 3 mrad about where the particle was first, in all drops alike."""
    off = [(rotation_from_vector(rng.normal(0.0, 3e-3, (1, 3)))[0], rng.normal(0.0, 1e-5, 3)) for _ in range(6)]
    moved = []
    for one in sets[:3]:
        views = []
        for view, (Q, step) in zip(one.views, off, strict=True):
            about = view.R_cam_particle @ sets[0].centre + view.t_cam_particle
            views.append(
                replace(view, R_cam_particle=Q @ view.R_cam_particle, t_cam_particle=Q @ (view.t_cam_particle - about) + about + step)
            )
        moved.append(view_set(one.name, one.outlines, views))
    merged = merge(moved, SETTINGS)
    assert merged.left_out == ()
    assert len(merged.rig) == 6
    assert merged.calibration_px == 0.0
    assert float(merged.set_rms_px.max()) < 0.25
    assert against_truth(merged, made.R, made.t, np.zeros(3))["relative_rotation_deg"]["largest"] < 0.6


def test_the_gauge_moves_nothing(made: Rendered, sets: list[ViewSet]) -> None:
    task, at = task_of(sets), true_placements(made)
    alike = np.tile([1e-4, -2e-4, 1e-4, 0.02, 0.01, -0.03], (4, 1))
    before, after = _linear(task, at)[1].e, _linear(task, at.moved(alike, task.pivot))[1].e
    np.testing.assert_allclose(before, after, atol=1e-6)


def test_the_fit_ends_where_the_gradient_is_nothing(made: Rendered, sets: list[ViewSet]) -> None:
    task, start = task_of(sets), true_placements(made)
    joint = fit_jointly(task, start)
    equations = _equations(task, joint.placements, _linear(task, joint.placements)[1])
    step = np.linalg.solve(equations.H, equations.g)
    assert joint.settled
    assert float(equations.g @ step) < 1e-3 * equations.cost
    assert np.linalg.eigvalsh(joint.covariance[6:, 6:]).min() > 0.0
    assert not joint.covariance[:6].any()


def test_a_foreign_set_is_named(sets: list[ViewSet], foreign: Rendered) -> None:
    other = view_set("other", foreign.drops[0].outlines, foreign.drops[0].views)
    merged = merge([sets[0], other, *sets[1:3]], SETTINGS)
    assert merged.placed == (0, 2, 3)
    assert [(out.name, out.view) for out in merged.left_out] == [("other", None)]
    assert "out of their hull" in merged.left_out[0].reason


def test_sets_of_another_particle_are_a_group_of_their_own(sets: list[ViewSet], rng: np.random.Generator) -> None:
    """Right motions between sets 0, 2, 4 and 6 and between sets 1, 3 and 5, wrong ones between the two groups."""
    seven = [sets[k % 4] for k in range(7)]
    turned = Rotation.random(7, rng=rng).as_matrix()
    motions = {}
    for i in range(7):
        for j in range(i):
            R = turned[i] @ turned[j].T if (i - j) % 2 == 0 else Rotation.random(rng=rng).as_matrix()
            motions[i, j] = SetMotions(i, j, Poses(R[None], (R @ seven[j].centre)[None], np.ones(1)), np.ones(1))
    consensus = agree(seven, motions)
    assert consensus.placed == (0, 2, 4, 6)
    assert consensus.others == ((1, 3, 5),)
    np.testing.assert_allclose(consensus.placements.R, turned[[0, 2, 4, 6]] @ turned[0].T, atol=1e-9)


def test_a_foreign_view_is_named(made: Rendered, sets: list[ViewSet], foreign: Rendered) -> None:
    outlines = list(made.drops[2].outlines)
    outlines[4] = foreign.drops[0].outlines[4]
    mixed = view_set("drop2", outlines, made.drops[2].views)
    merged = merge([*sets[:2], mixed], SETTINGS)
    assert [(out.name, out.view) for out in merged.left_out] == [("drop2", 4)]
    assert len(merged.views) == 17


def test_a_view_that_spoils_the_hull_of_its_drop_is_named_alone() -> None:
    """The drop's middle is far off by it, so that no motion fits the whole drop."""
    own, other = rendered("own", STONE, 111, drops=3), rendered("other", STONE, 511, drops=1)
    outlines = [*own.drops[1].outlines[:5], other.drops[0].outlines[5]]
    spoiled = view_set("spoiled", outlines, own.drops[1].views)
    whole = [view_set(own.drops[k].name, own.drops[k].outlines, own.drops[k].views) for k in (0, 2)]
    merged = merge([whole[0], spoiled, whole[1]], SETTINGS)
    assert [(out.name, out.view) for out in merged.left_out] == [("spoiled", 5)]
    assert "among the drop's views" in merged.left_out[0].reason
    assert len(merged.views) == 17


def test_a_drop_of_one_view_is_placed_by_the_others(made: Rendered, sets: list[ViewSet]) -> None:
    one = view_set("one", made.drops[3].outlines[2:3], made.drops[3].views[2:3])
    merged = merge([one, *sets[:2]], SETTINGS)
    assert merged.placed == (1, 2, 0)
    order = [3, 0, 1]
    found = against_truth(merged, made.R[order], made.t[order], np.zeros(3))
    assert found["relative_rotation_deg"]["largest"] < 0.5
    with pytest.raises(InputError, match="expected one with at least 3 usable views"):
        merge([one], SETTINGS)


def test_two_particles_alone_are_refused(sets: list[ViewSet], foreign: Rendered) -> None:
    other = view_set("other", foreign.drops[0].outlines, foreign.drops[0].views)
    with pytest.raises(InputError, match="best pair of drops is off by"):
        merge([sets[0], other], SETTINGS)


def test_two_sets_of_a_symmetric_body_are_ambiguous() -> None:
    axes = np.array([2.0e-3, 2.6e-3, 3.1e-3])
    views = rig(2)
    outlines = [Outline(ellipsoid_outline(axes, v.intrinsics, (v.R_cam_particle, v.t_cam_particle), points=900)) for v in views]
    pair = [view_set(f"drop{k}", *withheld(outlines[6 * k : 6 * k + 6], views[6 * k : 6 * k + 6])) for k in range(2)]
    with pytest.raises(InputError, match="that fits the first, got 4, as a symmetric body has"):
        merge(pair, SETTINGS)


def test_drops_that_fit_in_pairs_but_close_no_loop_are_not_called_a_symmetric_pair(
    sets: list[ViewSet], rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of three drops of a ball, or of particles that look alike, any turn fits, and no three turns agree."""

    def any_turn(first: ViewSet, second: ViewSet, pair: tuple[int, int], effort: MotionEffort) -> SetMotions:
        R = Rotation.random(3, rng=rng).as_matrix()
        return SetMotions(*pair, Poses(R, np.tile(first.centre, (3, 1)), np.ones(3)), np.ones(3))

    monkeypatch.setattr(merge_module, "find_motions", any_turn)
    for judged in ("fitting", "stands"):
        monkeypatch.setattr(merge_module, judged, lambda *given: (np.arange(3), ""))
    with pytest.raises(InputError) as refused:
        merge(sets[:3], SETTINGS)
    said = str(refused.value)
    assert "ways of turning them that agree around three drops, got none. 3 of 3 pairs of drops fit each other in several ways" in said
    assert "one of these drops alone makes a particle file" in said
    assert "as a symmetric body has" not in said


def test_wrong_motions_close_no_loop(sets: list[ViewSet]) -> None:
    motions = {(i, j): find_motions(sets[i], sets[j], (i, j), SETTINGS.effort) for i in range(3) for j in range(i)}
    spoiled = motions[2, 0]
    turned = replace(spoiled.poses, R=np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]) @ spoiled.poses.R)
    consensus = agree(sets[:3], {**motions, (2, 0): SetMotions(2, 0, turned, spoiled.rms_px)})
    assert consensus.edges == {}
    assert len(consensus.placed) == 1


def test_even_rotations_leave_no_large_hole(rng: np.random.Generator) -> None:
    q = Rotation.from_matrix(even_rotations(2000)).as_quat()
    there = Rotation.random(500, rng=rng).as_quat()
    assert np.rad2deg(2.0 * np.arccos(np.abs(there @ q.T).max(axis=1))).max() < 18.0


def test_volume_and_moments_are_inside_what_is_stated(made: Rendered, merged: Merged) -> None:
    solid = trimesh.Trimesh(made.vertices, made.faces)
    found = solid_figures(merged.outlines, merged.views, np.random.default_rng(0))
    moments = np.linalg.eigvalsh(solid.moment_inertia)
    assert abs(found.volume_m3 / solid.volume - 1.0) < 0.02
    assert abs(found.volume_m3 - solid.volume) < 2.0 * found.volume_sigma_m3
    assert np.abs(found.body.inertia_ratios - moments / moments[2]).max() < 0.02


def test_views_are_predicted_from_the_others(merged: Merged) -> None:
    predicted = predicted_views(merged.outlines, merged.views, np.zeros(3))
    assert predicted is not None
    assert np.nanmax(predicted.outside_px) < 1.5
    assert -0.2 < np.nanmean(predicted.excess_px) < 2.0
    assert predicted_views(merged.outlines[:3], merged.views[:3], np.zeros(3)) is None


def test_the_largest_gap_is_where_nobody_looks_from(merged: Merged) -> None:
    gap = largest_gap(merged.views)
    looking = np.stack([v.R_cam_particle[2] for v in merged.views])
    assert np.rad2deg(np.arccos(np.abs(looking @ gap.direction).max())) == pytest.approx(gap.gap_deg)
    assert 10.0 < gap.gap_deg < 60.0


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)
