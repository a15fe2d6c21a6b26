"""What outlines have beside a model: noise from frame to frame, outlines that are off as a whole, and pushes while surfaces are made."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.data.configuration import Configuration
from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import layout_of
from estimator.measurements.outlines import contacts
from estimator.measurements.outlines.frame_noise import whole, with_frame_noise, with_noise_beside_poses
from estimator.measurements.outlines.registration import by_samples
from estimator.measurements.outlines.surfaces import Flown, _known
from estimator.measurements.outlines.task import OutlineResiduals, OutlineTask, outline_errors
from estimator.motion.flight import N_PARAMETERS, OFFSET
from estimator.surface.joint import HELD
from tests.estimator import small_campaign
from tests.estimator.measurements.outlines import sampled_campaign

Array = NDArray[np.float64]
OFF_PX, DRAG, SHIFT_PX = 1.5, 4.0, np.array([2.4, -1.8])
SLIGHTLY_PX = 0.35


def residuals(number: int) -> OutlineResiduals:
    return sampled_campaign.fitted().equations[number].errors


@pytest.mark.parametrize("frames", [1, 2])
def test_noise_is_as_alike_as_it_was_drawn(frames: int) -> None:
    rng, tasks = np.random.default_rng(4), sampled_campaign.registered().campaign.sequences
    drawn = [
        np.sum([wide[k : k + len(task.task.sightings)] for k in range(frames)], axis=0) / np.sqrt(frames)
        for task, wide in _noise(tasks, rng)
    ]
    left = [replace(residuals(i), e=e) for i, e in enumerate(drawn)]
    made = with_noise_beside_poses(tasks, left)
    assert [each.alike for each in made] == pytest.approx([frames] * len(tasks), rel=0.2)
    assert made[0].repeats == pytest.approx(np.full(len(made[0].repeats), made[0].alike))


def _noise(tasks: tuple[OutlineTask, ...], rng: np.random.Generator) -> list[tuple[OutlineTask, Array]]:
    return [(task, rng.normal(size=(len(task.task.sightings) + 3, len(task.repeats)))) for task in tasks]


def test_what_moves_a_body_is_no_noise() -> None:
    """Poses that are off by ten times the noise, as under a missing force, change neither its size nor its likeness."""
    rng, tasks = np.random.default_rng(5), sampled_campaign.registered().campaign.sequences
    left, off = [], []
    for number, (task, wide) in enumerate(_noise(tasks, rng)):
        of = residuals(number)
        e = np.where(of.seen, wide[: len(task.task.sightings)], 0.0)
        by_pose = of.met.by_pose * (of.seen / np.sqrt(of.variance))[..., None]
        size = np.linalg.norm(by_pose, axis=1) / np.sqrt(of.seen.sum(axis=1))[:, None]
        moved = np.einsum("nkj,nj->nk", by_pose, rng.normal(size=size.shape) / size)
        left.append(replace(of, e=e))
        off.append(replace(of, e=e + 10.0 * moved))
    plain, pushed = with_noise_beside_poses(tasks, left), with_noise_beside_poses(tasks, off)
    assert [each.noise for each in plain] == pytest.approx([task.noise for task in tasks], rel=0.1)
    assert [each.noise for each in pushed] == pytest.approx([each.noise for each in plain])
    assert [each.alike for each in pushed] == pytest.approx([each.alike for each in plain])


def test_an_outline_beside_the_surfaces_meets_what_it_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shifted by three pixels, as where a frame's time is wrong, its samples meet the same places within half a pixel."""
    task = sampled_campaign.registered().campaign.sequences[0]
    samples = np.concatenate(task.task.sightings.outlines_px)
    px_m = np.ptp(task.task.sightings.outlines_px[0], axis=0).max() / np.ptp(_met(task, samples), axis=0).max()
    apart = px_m * np.linalg.norm(_met(task, samples) - _met(task, samples + SHIFT_PX), axis=1)
    monkeypatch.setattr(contacts, "SHIFTED", 1)
    unshifted = px_m * np.linalg.norm(_met(task, samples) - _met(task, samples + SHIFT_PX), axis=1)
    assert np.median(apart) < 0.5 * contacts.MOVED_PX
    assert np.median(unshifted) > 4.0 * np.median(apart)


def _met(task: OutlineTask, samples_px: Array) -> Array:
    found = contacts.contacts_at(task.amplitudes, task.contacts.amplitude, task.task.sightings, task.contacts.placed, samples_px)
    return np.asarray(found.point)


def test_noise_that_is_alike_says_less() -> None:
    """The variance of a flight is as many times as large as noise is alike over frames."""
    campaign, fit = sampled_campaign.registered().campaign, sampled_campaign.fitted()
    task, flight, theta = campaign.sequences[0], fit.state.flights[0], fit.state.theta[0]
    errors = outline_errors(task, flight, fit.model, theta)
    said = [campaign.kind.equations(replace(campaign, sequences=(each,)), 0, errors, fit.model, theta).frames.H for each in _alike(task)]
    assert said[0] == pytest.approx(3.0 * said[1])


def _alike(task: OutlineTask) -> tuple[OutlineTask, OutlineTask]:
    return replace(task, alike=1.0), replace(task, alike=3.0)


@pytest.mark.parametrize("number", [0, 1, 11, 29])
def test_an_outline_off_as_a_whole_is_not_used(number: int) -> None:
    """At the ends of a flight, too."""
    registered = small_campaign.registered()
    first = registered.campaign.sequences[0]
    silhouettes = first.task.sightings.silhouettes
    xy = silhouettes.xy.copy()
    xy[silhouettes.slice_of(number)] += [OFF_PX, -OFF_PX] / silhouettes.focal_px[number]
    sightings = replace(first.task.sightings, silhouettes=replace(silhouettes, xy=xy))
    shifted = replace(first, task=replace(first.task, sightings=sightings))
    campaign = replace(registered.campaign, sequences=(shifted, *registered.campaign.sequences[1:]))
    kept = [np.flatnonzero(~each).tolist() for each in whole(replace(registered, campaign=campaign))]
    assert kept == [[number], []]
    assert [each.all() for each in whole(registered)] == [True, True]


def _task_with_shifts(px: dict[int, tuple[float, float]]) -> OutlineTask:
    """The first sequence with outlines that are shifted as a whole."""
    task = sampled_campaign.registered().campaign.sequences[0]
    sightings = task.task.sightings
    outlines = tuple(each + px.get(number, (0.0, 0.0)) for number, each in enumerate(sightings.outlines_px))
    return replace(task, task=replace(task.task, sightings=replace(sightings, outlines_px=outlines)))


def _dropped(task: OutlineTask) -> list[int]:
    fit = sampled_campaign.fitted()
    made = with_frame_noise([task], [(fit.state.flights[0], fit.model, fit.state.theta[0])])
    return np.flatnonzero(~made[0].kept).tolist()


def test_samples_tell_outlines_that_are_off_by_little_in_any_direction_and_at_the_ends() -> None:
    """By less than twice the noise of a sample, along the motion, too."""
    last = len(sampled_campaign.registered().campaign.sequences[0].kept) - 1
    assert _dropped(_task_with_shifts({})) == []
    for off in ((SLIGHTLY_PX, 0.0), (-SLIGHTLY_PX, 0.0), (0.0, SLIGHTLY_PX), (0.0, -SLIGHTLY_PX)):
        assert _dropped(_task_with_shifts({0: off, 11: off, last: off})) == [0, 11, last]


def test_an_outline_that_was_set_aside_comes_back_where_it_is_not_off() -> None:
    task = _task_with_shifts({})
    assert _dropped(replace(task, kept=np.arange(len(task.kept)) != 7)) == []


def test_what_moves_all_outlines_sets_none_aside() -> None:
    rng = np.random.default_rng(2)
    drawn = rng.normal(scale=SLIGHTLY_PX, size=(len(sampled_campaign.registered().campaign.sequences[0].kept), 2))
    assert _dropped(_task_with_shifts({number: (float(x), float(y)) for number, (x, y) in enumerate(drawn)})) == []


def test_a_push_that_free_flight_lacks_bends_no_surface() -> None:
    """Samples lie about the first surface as their noise has them; about one made with free flights they lay 2.3 times as far off."""
    effects = [catalogue()[key] for key in ("quadratic_drag", "outline_offset")]
    made = by_samples(small_campaign.registered(drag=DRAG), effects, Configuration(), subdivisions=sampled_campaign.COARSE)
    assert [each.noise for each in made.campaign.sequences] == pytest.approx([1.0, 1.0], abs=0.15)
    assert [each.under for each in made.campaign.sequences] == [(), ()]


def test_what_moves_outlines_in_pictures_is_held_while_edges_form() -> None:
    campaign, model = sampled_campaign.registered().campaign, Model((MODELS["gravity"], MODELS["outline_offset"]))
    layout = layout_of(campaign, model)
    theta, flights = np.zeros(model.size), sampled_campaign.registered().start.flights
    each = zip(campaign.sequences, flights, layout.places, strict=True)
    known = _known([Flown(task, flight, model, theta, place) for task, flight, place in each], layout.p)
    more = np.diag(known.held.information - known.information)
    place = layout.places[0][N_PARAMETERS:]
    assert np.all(more[place[:3]] == 0.0)
    assert more[place[3]] == pytest.approx((HELD * model.steps[3]) ** -2.0)
    assert np.count_nonzero(more) == 1 + len({int(each[OFFSET.start]) for each in layout.places})
