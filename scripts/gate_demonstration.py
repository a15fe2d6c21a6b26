"""What the regression gate catches: five planted faults in the estimator must fail, five harmless changes must pass.

``python -m scripts.gate_demonstration --truth-dataset out/quick --result docs/results/gate_demonstration.json``, after
``tumble render --config baselines/quick.toml --out out/quick``. Each change is a context manager or another configuration; the same
sequences are estimated and compared with the committed baseline, as ``tumble gate`` does.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from datasets.dataset_files import observation_folder, read_dataset, truth_folder
from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.scoring.gate import compare, load_baseline
from datasets.scoring.score import score
from datasets.truth_files import read_truth
from datasets.vocabulary.outline import Outline
from estimator import pipeline, reporting
from estimator.configuration import Configuration
from estimator.fitting import refinement
from estimator.geometry import tangent_hull
from estimator.motion import flight as flight_model
from estimator.motion.flight import Flight
from estimator.motion.rigid_body import rotation_matrices

Change = Callable[[Observation], Observation]


def drifting_outlines(observation: Observation) -> Observation:
    """Outlines that drift to the right by 0.02 px a frame, as a threshold that follows a fading light would make them."""
    moved = tuple(Outline(o.points_px + np.array([0.02 * i, 0.0])) for i, o in enumerate(observation.recordings[0]))  # type: ignore[arg-type]
    return replace(observation, recordings=(moved,))


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
    original = refinement.refine_flight

    def boast(*arguments: Any, **settings: Any) -> refinement.Refined:
        refined = original(*arguments, **settings)
        return replace(refined, covariance=refined.covariance / 16.0)

    with mock.patch.object(pipeline, "refine_flight", boast):
        yield


def reversed_views(observation: Observation) -> Observation:
    """The calibrated views in the opposite order."""
    return replace(observation, views=observation.views[::-1], view_recording=tuple(observation.view_recording)[::-1])  # type: ignore[arg-type]


def unchanged(observation: Observation) -> Observation:
    """As it is."""
    return observation


FAULTS: tuple[tuple[str, Change, Configuration, Callable[[], Any]], ...] = (
    ("angular velocity in body axes", unchanged, Configuration(), body_axes),
    ("flight 1% too slow", unchanged, Configuration(), short_steps),
    ("outlines drift by 0.02 px a frame", drifting_outlines, Configuration(), nullcontext),
    ("hulls 2% too large", unchanged, Configuration(), large_hulls),
    ("error bars four times too small", unchanged, Configuration(), boastful_covariance),
)
HARMLESS: tuple[tuple[str, Change, Configuration, Callable[[], Any]], ...] = (
    ("another seed", unchanged, Configuration(seed=1), nullcontext),
    ("more pose starts", unchanged, Configuration(pose_starts=96), nullcontext),
    ("hull of 72 instead of 64 voxels", unchanged, Configuration(hull_resolution=72), nullcontext),
    ("views in another order", reversed_views, Configuration(), nullcontext),
    ("more viewing directions in the catalogue", unchanged, Configuration(directions=900), nullcontext),
)


def rows_of(dataset: Path, change: Change, configuration: Configuration, patched: Callable[[], Any]) -> list[dict[str, Any]]:
    """Scores of all sequences under one change."""
    rows = []
    with patched():
        for name in read_dataset(dataset).sequences:
            observation = change(read_observation(observation_folder(dataset, name)))
            rows.append(score(pipeline.estimate(observation, configuration), read_truth(truth_folder(dataset, name))))
    return rows


def main() -> int:
    """Run all ten; exit code 1 when the gate errs on one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--truth-dataset", type=Path, default=Path("out/quick"))
    parser.add_argument("--baseline", type=Path, default=Path("baselines/quick.json"))
    parser.add_argument("--result", type=Path, default=Path("out/gate_demonstration.json"))
    arguments = parser.parse_args()
    baseline = load_baseline(arguments.baseline)
    results = []
    for kind, changes in (("fault", FAULTS), ("harmless", HARMLESS)):
        for name, change, configuration, patched in changes:
            found = compare(baseline, rows_of(arguments.truth_dataset, change, configuration, patched), rng=np.random.default_rng(0))
            right = found.worse == (kind == "fault")
            results.append({"kind": kind, "change": name, "worse": found.worse, "right": right, "sentences": list(found.sentences)[:6]})
            print(
                f"{kind:9s} {name:42s} gate says {'worse' if found.worse else 'not worse':9s} {'right' if right else 'WRONG'}", flush=True
            )
    arguments.result.parent.mkdir(parents=True, exist_ok=True)
    arguments.result.write_text(json.dumps(results, indent=1) + "\n")
    return 0 if all(r["right"] for r in results) else 1


if __name__ == "__main__":
    raise SystemExit(main())
