"""Two particles from recipe to score, by the verbs a person types; and what is refused where there is no collision to measure."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from datasets.errors import InputError
from datasets.estimate import Status
from datasets.estimate_files import read_estimate
from datasets.observation import Companion, Observation
from datasets.observation_files import read_observation, write_observation
from datasets.scoring.collisions import score_collision, true_collision
from datasets.truth_files import read_truth
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.measure import measure
from synth.pair_outlines import outlines_of_two
from tumble.cli.main import main

RECIPE = """
seed = 7
[particle]
irregularity = 0.5
size_mm = [4.5, 6.5]
[motion]
spin_rads = [40.0, 120.0]
[rig]
drops = 4
[pair]
closing_ms = [0.8, 1.5]
out_of_plane_deg = [0.0, 10.0]
frames_before = [16, 16]
frames_after = [16, 16]
[contact]
restitution = 0.7
friction = 0.2
"""
EFFORT = {"hull_resolution": 32, "directions": 200, "pose_starts": 24, "momentum_starts": 0, "bias_pairs": 2}
NONE = Outline(np.zeros((0, 2)))
NAME = "cut_stone-pair-0000"
FAST = [word for key, value in EFFORT.items() for word in ("--set", f"{key}={value}")]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Dataset, estimates and scores of one pair."""
    folder = tmp_path_factory.mktemp("pair")
    (folder / "recipe.toml").write_text(RECIPE)
    assert main(["render", "--config", str(folder / "recipe.toml"), "--out", str(folder / "data"), "--jobs", "1", "-q"]) == 0
    assert main(["estimate", str(folder / "data"), "--out", str(folder / "estimates"), "--jobs", "1", "-q", *FAST]) == 0
    truth = str(folder / "data" / "truth")
    assert main(["score", str(folder / "estimates"), "--truth", truth, "--out", str(folder / "scores"), "-q"]) == 0
    return folder


@pytest.fixture(scope="module")
def observation(made: Path) -> Observation:
    return read_observation(made / "data" / "observations" / NAME)


def outlines(observation: Observation) -> tuple[list[Outline], list[Outline]]:
    return list(observation.recordings[0]), list(observation.further_recordings[0])  # type: ignore[arg-type]


def test_the_measured_collision_is_the_true_one(made: Path) -> None:
    estimate = read_estimate(made / "estimates" / f"{NAME}.estimate.json")
    truth = read_truth(made / "data" / "truth" / NAME)
    assert truth.companion is not None
    assert estimate.companion is not None
    assert estimate.collision is not None
    assert estimate.status is Status.CONVERGED, estimate.message
    frame_s = 1 / 4000.0
    assert abs(estimate.collision.time_s - truth.impacts[0].time_s) < 0.3 * frame_s
    assert estimate.impacts[0].time_s == estimate.companion.impacts[0].time_s == estimate.collision.time_s
    for measured, true in ((estimate, truth), (estimate.companion, truth.companion)):
        after, impact = measured.impacts[0].after, true.impacts[0]
        assert np.abs(after.v_world - impact.v_after)[:2].max() < 0.01
        assert np.linalg.norm(after.omega_world - impact.omega_after) < 6.0
        left_out = {f.reason for f in measured.frames if not f.used}
        assert left_out == {"merged with the other particle's outline"}
    ratio = truth.mass_kg / truth.companion.mass_kg
    told = true_collision(truth.impacts[0], truth.companion.impacts[0], ratio)
    assert estimate.collision.mass_source == "volumes"
    assert estimate.collision.momentum_kept
    for name in ("restitution", "momentum_mass_ratio", "approach_ms"):
        found = getattr(estimate.collision, name)
        assert abs(found.value - told[name]) < 4 * found.sigma
    assert "equal density taken for granted" in estimate.message


def test_scores_have_both_particles_and_the_collision(made: Path) -> None:
    scores, impacts, collisions = (pd.read_csv(made / "scores" / f"{name}.csv") for name in ("scores", "impacts", "collisions"))
    assert list(scores["sequence"]) == [NAME, f"{NAME} (companion)"]
    assert list(impacts["sequence"]) == [NAME, f"{NAME} (companion)"]
    assert impacts["found"].all()
    assert list(collisions["sequence"]) == [NAME]
    assert collisions["normal_error_deg"][0] < 45


def test_an_estimate_without_a_collision_is_not_found(made: Path) -> None:
    estimate = read_estimate(made / "estimates" / f"{NAME}.estimate.json")
    truth = read_truth(made / "data" / "truth" / NAME)
    assert score_collision(replace(estimate, collision=None), truth) == [{"sequence": NAME, "status": "converged", "found": False}]
    assert score_collision(estimate, replace(truth, companion=None)) == []


def test_other_verbs_leave_pairs_alone(made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["compare", str(made / "data"), "--out", str(tmp_path / "compared"), "-q"]) == 2
    assert "expected one particle, since campaigns are of one, got two" in capsys.readouterr().err
    assert (
        main(["validate-contact", str(made / "estimates"), "--observations", str(made / "data"), "--out", str(tmp_path / "v"), "-q"]) == 2
    )
    assert "two particles collide in it, and none hits a plate" in capsys.readouterr().err


def only_one(observation: Observation) -> Observation:
    larger, _ = outlines(observation)
    return replace(observation, recordings=(tuple(larger),), further_recordings=((NONE,) * len(larger),))


def never_apart(observation: Observation) -> Observation:
    """Both move as one: each outline is that of two which overlap."""
    larger, smaller = outlines(observation)
    merged = []
    for one, other in zip(larger, smaller, strict=True):
        if other.empty:
            merged.append(one)
            continue
        apart = one.points_px.mean(axis=0) - other.points_px.mean(axis=0)
        merged.append(Outline(outlines_of_two(one.points_px, other.points_px + apart * 0.6)[0]))
    return replace(observation, recordings=(tuple(merged),), further_recordings=((NONE,) * len(larger),))


def apart_before_only(observation: Observation) -> Observation:
    _, smaller = outlines(observation)
    last = max(k for k, outline in enumerate(smaller) if outline.empty)
    return replace(observation, further_recordings=((*smaller[:last], *(NONE,) * (len(smaller) - last)),))


def passing(observation: Observation) -> Observation:
    """No collision: the pictures before it, each moved on as it was moving."""
    larger, smaller = outlines(observation)
    first = min(k for k, outline in enumerate(smaller) if outline.empty)
    seen = [[o.points_px for o in side[:first]] for side in (larger, smaller)]
    followed: list[list[np.ndarray]] = [[seen[0][0]], [seen[1][0]]]
    for frame in range(1, first):
        near = np.linalg.norm(followed[0][-1].mean(axis=0) - seen[0][frame].mean(axis=0))
        crossed = near > np.linalg.norm(followed[0][-1].mean(axis=0) - seen[1][frame].mean(axis=0))
        for k in (0, 1):
            followed[k].append(seen[1 - k if crossed else k][frame])
    recorded: tuple[list[Outline], list[Outline]] = ([], [])
    middle = len(larger) / 2
    for frame in range(len(larger)):
        shown = [
            side[frame % first] - side[frame % first].mean(axis=0) + [300.0 + sign * (frame - middle) * 8, 400.0 + 30 * sign]
            for side, sign in zip(followed, (1.0, -1.0), strict=True)
        ]
        drawn = outlines_of_two(*shown)
        recorded[0].append(Outline(drawn[0]))
        recorded[1].append(Outline(drawn[1]) if len(drawn) == 2 else NONE)
    return replace(observation, recordings=(tuple(recorded[0]),), further_recordings=(tuple(recorded[1]),))


def without_views(observation: Observation) -> Observation:
    return replace(observation, companion=Companion((), ()))


@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (only_one, r"two outlines, before and after a collision, got none in a row: only the (first|second) particle is seen"),
        (never_apart, "got none in a row: the particles never separate"),
        (apart_before_only, "expected two particles that are apart before and after they collide, got them apart only before"),
        (passing, r"expected two particles that collide, got two that pass one another: their paths bend by \d\.\d\d and"),
        (without_views, "expected calibrated views of both particles, got none of the second one"),
    ],
)
def test_no_collision_to_measure(observation: Observation, spoilt: Callable[[Observation], Observation], message: str) -> None:
    with pytest.raises(InputError, match=message):
        measure(spoilt(observation), Configuration(**EFFORT))  # type: ignore[arg-type]


def test_refused_by_the_verb_with_nothing_written(observation: Observation, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_observation(without_views(observation), tmp_path / "in" / NAME)
    assert main(["estimate", str(tmp_path / "in"), "--out", str(tmp_path / "out"), "--jobs", "1", "-q", *FAST]) == 2
    assert "expected calibrated views of both particles, got none of the second one" in capsys.readouterr().err
    assert not list((tmp_path / "out").glob("*.estimate.json"))


def test_files_that_do_not_fit_one_another(observation: Observation, tmp_path: Path) -> None:
    folder = tmp_path / NAME
    write_observation(observation, folder)
    document = json.loads((folder / "observation.json").read_text())
    del document["sha256"]
    without = {**document, "cameras": [{k: v for k, v in c.items() if k != "further_recording"} for c in document["cameras"]]}
    (folder / "observation.json").write_text(json.dumps(without))
    with pytest.raises(InputError, match="expected a further_recording of every camera, since there is a companion, got 0 of 1"):
        read_observation(folder)
    (folder / "observation.json").write_text(json.dumps({k: v for k, v in document.items() if k != "companion"}))
    with pytest.raises(InputError, match="expected a further_recording of no camera, since there is no companion"):
        read_observation(folder)
    (folder / "observation.json").write_text(json.dumps({**document, "companion": {"views": {}}}))
    with pytest.raises(InputError, match=r"\$\.companion\.views"):
        read_observation(folder)


def test_the_table_has_both_particles(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    again = ["estimate", str(made / "data"), "--out", str(made / "estimates"), "--jobs", "1", "--resume", "--json", *FAST]
    assert main(again) == 0
    told = json.loads(capsys.readouterr().out)
    assert [row["sequence"] for row in told] == [NAME, f"{NAME} (companion)"]
    assert {row["status"] for row in told} == {"converged"}


def test_too_few_pictures_after_the_collision(observation: Observation) -> None:
    larger, smaller = outlines(observation)
    last = max(k for k, outline in enumerate(smaller) if outline.empty)
    cut = slice(0, last + 4)
    short = replace(
        observation,
        recordings=(tuple(larger[cut]),),
        further_recordings=(tuple(smaller[cut]),),
        clock=replace(observation.clock, times_s=observation.clock.times_s[cut]),
    )
    found = measure(short, Configuration(**EFFORT))  # type: ignore[arg-type]
    assert found.status is Status.IMPACT_AT_EDGE
    assert re.search(r"the first particle is apart in 3 pictures after the collision \(frame \d+\.\d\): too few to measure", found.message)
    assert found.companion is not None
    assert found.companion.status is Status.IMPACT_AT_EDGE
    assert found.collision is None
