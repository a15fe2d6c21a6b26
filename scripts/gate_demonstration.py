"""What the regression gate catches: five planted faults in the estimator must fail, five harmless changes must pass.

``python -m scripts.gate_demonstration --result docs/results/gate_demonstration.json``. The sequences are made from the recipe that the
committed baseline names. A fault replaces one function of the estimator for the length of a run, as a programming mistake would; the
observations stay as they are. A harmless change is another setting, or the calibrated views in another order. Each run is compared
with the baseline as ``tumble gate`` does it. Scores are kept per change in ``--out``, so a run that was killed goes on; they are made
anew when the baseline, the recipe, the sources or this file have changed.
"""

import argparse
import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from datasets.atomic_files import written_whole
from datasets.json_documents import plain, revived
from datasets.observation import Observation
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import load_recipe
from datasets.scoring.score import Row, score
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.fitting import refinement, tasks
from estimator.geometry import tangent_hull
from estimator.measuring import free_flight
from estimator.motion import flight as flight_model
from estimator.motion.flight import Flight
from estimator.motion.rigid_body import rotation_matrices
from estimator.outlines import sightings
from estimator.outlines.result import OutlineTrack
from estimator.reports import reporting
from synth.sequence import build_silhouette_sequence
from tumble.cli.gate import verdict
from tumble.gating import recipe_file
from tumble.versions import sources_digest

GROWTH_PX = 0.01
"""By how much a sinking threshold widens the outlines from each frame to the next."""


@contextmanager
def sinking_threshold() -> Iterator[None]:
    """Outlines cut at a threshold that sinks from frame to frame, so that each is a little wider than the one before."""
    original = sightings.outlines_of

    def sinking(*arguments: Any, **settings: Any) -> OutlineTrack:
        track = original(*arguments, **settings)
        frames = tuple(replace(f, outline=_widened(f.outline, GROWTH_PX * k)) for k, f in enumerate(track.frames))
        return OutlineTrack(frames)

    with mock.patch.object(sightings, "outlines_of", sinking):
        yield


def _widened(outline: Outline, by_px: float) -> Outline:
    from_middle = outline.points_px - outline.points_px.mean(axis=0)
    return Outline(outline.points_px + by_px * from_middle / np.linalg.norm(from_middle, axis=1, keepdims=True))


@contextmanager
def body_axes() -> Iterator[None]:
    """Angular velocities reported in body axes where world axes are promised."""
    original = reporting.velocities

    def mixed(flight: Flight, steps: Any, time_s: float) -> tuple[Any, Any]:
        v, omega = original(flight, steps, time_s)
        return v, omega @ rotation_matrices(flight.q)

    with mock.patch.object(reporting, "velocities", mixed):
        yield


@contextmanager
def short_steps() -> Iterator[None]:
    """A flight that advances 1% too little in every step."""
    original = flight_model.propagate

    def short(start: Any, inverse: Any, times_s: Any, *, start_time_s: float, acceleration: Any) -> Any:
        return original(
            start, inverse, start_time_s + 0.99 * (times_s - start_time_s), start_time_s=start_time_s, acceleration=acceleration
        )

    with mock.patch.object(flight_model, "propagate", short):
        yield


@contextmanager
def large_hulls() -> Iterator[None]:
    """Hulls of all outlines but the degraded views 2% too large."""
    original = tangent_hull.tangent_hull

    def fat(points_px: Any, *, window: int = 5) -> tangent_hull.TangentHull:
        hull = original(points_px, window=window)
        middle = hull.points_px.mean(axis=0) if len(hull.points_px) else 0.0
        return replace(hull, points_px=middle + 1.02 * (hull.points_px - middle))

    with mock.patch("estimator.geometry.silhouettes.tangent_hull", fat):
        yield


@contextmanager
def boastful_covariance() -> Iterator[None]:
    """Error bars four times too small."""
    original = refinement.refine

    def boast(*arguments: Any, **settings: Any) -> refinement.Refined[Any]:
        refined = original(*arguments, **settings)
        return replace(refined, covariance=refined.covariance / 16.0)

    with mock.patch.object(tasks, "refine", boast):
        yield


def reversed_views(observation: Observation) -> Observation:
    """The calibrated views in the opposite order."""
    return replace(observation, views=observation.views[::-1], view_recording=tuple(observation.view_recording)[::-1])  # type: ignore[arg-type]


def unchanged(observation: Observation) -> Observation:
    """As it is."""
    return observation


@dataclass(frozen=True)
class Change:
    """One change to a run: the estimator's functions replaced while it lasts, its settings, or the order of what is observed."""

    name: str
    patched: Callable[[], Any] = nullcontext
    configuration: Configuration = field(default_factory=Configuration)
    observed: Callable[[Observation], Observation] = unchanged


FAULTS = (
    Change("angular velocity in body axes", body_axes),
    Change("flight 1% too slow", short_steps),
    Change("threshold sinks: outlines grow by 0.01 px a frame", sinking_threshold),
    Change("hulls 2% too large", large_hulls),
    Change("error bars four times too small", boastful_covariance),
)
HARMLESS = (
    Change("another seed", configuration=Configuration(seed=1)),
    Change("more pose starts", configuration=Configuration(pose_starts=96)),
    Change("hull of 72 instead of 64 voxels", configuration=Configuration(hull_resolution=72)),
    Change("views in another order", observed=reversed_views),
    Change("more viewing directions in the catalogue", configuration=Configuration(directions=900)),
)


def rows_of(recipe: Recipe, change: Change) -> list[Row]:
    """Scores of all sequences under one change."""
    rows = []
    for index in range(recipe.sequences):
        observation, truth = build_silhouette_sequence(recipe, index)
        with change.patched():
            rows.append(score(free_flight.estimate(change.observed(observation), change.configuration), truth))
    return rows


def kept_rows(recipe: Recipe, change: Change, kept: Path) -> list[Row]:
    """The same, from ``kept`` where they are there."""
    if not kept.exists():
        with written_whole(kept) as temporary:
            temporary.write_text(json.dumps(plain(rows_of(recipe, change))) + "\n", encoding="utf-8")
    rows: list[Row] = revived(json.loads(kept.read_text(encoding="utf-8")))
    return rows


def place_of_rows(out: Path, *inputs: Path) -> Path:
    """A folder in ``out`` that no run of other sources, recipe or script shares."""
    texts = b"".join(path.read_bytes() for path in (*inputs, Path(__file__)))
    return out / hashlib.sha256(sources_digest(("datasets", "synth", "estimator")).encode() + texts).hexdigest()[:12]


def judged(baseline: Path, rows: list[Row], change: Change, *, is_fault: bool) -> dict[str, Any]:
    """The gate's verdict on one change, and whether it is right."""
    found = verdict(baseline, rows)
    return {
        "kind": "fault" if is_fault else "harmless",
        "change": change.name,
        "worse": found.worse,
        "right": found.worse == is_fault,
        "sequences": list(found.sequences),
        "sentences": list(found.sentences)[:6],
    }


def main() -> int:
    """Run all ten; exit code 1 when the gate errs on one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--baseline", type=Path, default=Path("baselines/quick.json"))
    parser.add_argument("--out", type=Path, default=Path("out/gate_demonstration"), help="folder of the scores, kept to go on with")
    parser.add_argument("--result", type=Path, default=Path("out/gate_demonstration.json"))
    words = parser.parse_args()
    source = recipe_file(words.baseline)
    recipe, place = load_recipe(source, ()), place_of_rows(words.out, source)
    results = []
    for number, change in enumerate((*FAULTS, *HARMLESS)):
        rows = kept_rows(recipe, change, place / f"{number:02d}.json")
        results.append(judged(words.baseline, rows, change, is_fault=change in FAULTS))
        said = "worse" if results[-1]["worse"] else "not worse"
        print(f"{results[-1]['kind']:9s} {change.name:50s} gate says {said:9s} {'right' if results[-1]['right'] else 'WRONG'}", flush=True)
    with written_whole(words.result) as temporary:
        temporary.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0 if all(entry["right"] for entry in results) else 1


if __name__ == "__main__":
    raise SystemExit(main())
