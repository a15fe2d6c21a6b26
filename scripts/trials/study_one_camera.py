"""Effects that one camera of two has: whether ``explain`` names the right effect of the right camera, and nothing where nothing is hidden.

``python -m scripts.trials.study_one_camera --campaigns 12 --seed N --result F.json --page F.md``. Every campaign is three
flights of a stone before two cameras at a right angle; in two of three campaigns an effect of one of them is hidden, its size log-uniform
in ``HIDDEN``. The mess of the field challenge is in all: outlines with heavy tails that are alike over frames, some shifted as a whole,
pushes of every flight, both focal lengths off by a little, as their calibration states. Where a clock is hidden, nothing is stated of it.
"""

import argparse
import json
import secrets
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.json_documents import plain
from datasets.observation import Observation
from datasets.recipes.recipe import EffectRecipe, FurtherHsvRecipe, HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.effects import EFFECTS, in_words, of_camera
from estimator.data.configuration import Configuration
from estimator.diagnosis.explain import explain
from estimator.effects.choosing import catalogue
from estimator.measurements.silhouettes.registration import register
from scripts.trials.body_studies import LARGEST_SEED
from studies.reporting.words import write_page
from synth.frame_outlines import frame_outlines
from synth.plan import SequencePlan
from synth.sequence import exact_view_outlines, observation_of, plan_sequence
from synth.silhouette import outline_mesh
from tumble.challenge.answers import answer
from tumble.challenge.field_silhouettes import messy
from tumble.challenge.field_spans import log_uniform

Array = NDArray[np.float64]
CAMERAS = ("hsv", "hsv_2")
HIDDEN: dict[str, tuple[float, float]] = {
    "focal_length": (2e-3, 1e-2),
    "principal_point": (2.0, 8.0),
    "radial_distortion": (1.0, 4.0),
    "pixel_aspect": (2e-3, 8e-3),
    "rolling_shutter": (1e-7, 3e-7),
    "outline_offset": (0.15, 0.6),
    "blooming": (0.3, 1.2),
    "frame_rate": (3e-3, 1.5e-2),
    "clock_offset": (2e-5, 2e-4),
}
"""Sizes that are hidden, in the catalogue's units: of effects with several parameters the length of a vector with a random direction."""
ONE_SIGN = ("blooming",)
PUSH_MS2, FOCAL = 0.1, 1e-4
"""Standard deviations of every flight's push, and of what both focal lengths are off by, relative, which is stated of both lenses."""
SHARE = 2.0 / 3.0
ATTEMPTS = 10
INSIDE = 7.815
"""Of chi-squared with three degrees of freedom, 95%."""


@dataclass(frozen=True)
class Case:
    """One campaign: its ``recipe`` and noise (px), and what is hidden of which camera, nothing for a control."""

    recipe: Recipe
    outline_px: float
    view_px: float
    repeats: int
    key: str = ""
    values: dict[str, float] | None = None


def drawn(rng: np.random.Generator) -> Case:
    """A campaign."""
    family: Literal["cut_stone", "jagged"] = "cut_stone" if rng.random() < 0.5 else "jagged"
    recipe = Recipe(
        seed=int(rng.integers(LARGEST_SEED)),
        sequences=3,
        same_particle=True,
        particle=ParticleRecipe(family=family, irregularity=float(rng.uniform(0.3, 0.8))),
        motion=MotionRecipe(frames=25, speed_ms=(0.5, 2.0), spin_rads=(50.0, 200.0)),
        hsv=HsvRecipe(),
        rig=RigRecipe(drops=int(rng.integers(4, 7))),
        further_hsv=(FurtherHsvRecipe(angle_deg=90.0, delay_frames=float(rng.uniform(0.0, 0.5))),),
    )
    noise = log_uniform((0.1, 0.3), rng), log_uniform((0.1, 0.3), rng), int(rng.integers(2, 4))
    pushes = {f"a_{axis}": tuple(rng.normal(scale=PUSH_MS2, size=3).tolist()) for axis in "xyz"}
    off = [{"relative": float(rng.normal(scale=FOCAL))} for _ in CAMERAS]
    key, camera, values = _hidden(rng)
    if key == "focal_length":
        off[camera]["relative"] += values["relative"]
        values = off[camera]
    hidden = [EffectRecipe(key, {**values}, camera)] if key not in ("", "focal_length") else []
    lenses = [EffectRecipe("focal_length", {**each}, number) for number, each in enumerate(off)]
    effects = (EffectRecipe("uniform_acceleration", pushes), *lenses, *hidden)
    name = of_camera(key, CAMERAS[camera]) if key else ""
    return Case(replace(recipe, effects=effects), *noise, name, values or None)


def _hidden(rng: np.random.Generator) -> tuple[str, int, dict[str, float]]:
    """An effect, the number of its camera, and its values; none in controls."""
    key = list(HIDDEN)[int(rng.integers(len(HIDDEN)))]
    camera, size = int(rng.integers(len(CAMERAS))), log_uniform(HIDDEN[key], rng)
    if rng.random() >= SHARE:
        return "", 0, {}
    names = EFFECTS[key].names if key == "principal_point" else EFFECTS[key].names[:1]
    along = rng.normal(size=len(names))
    along = np.abs(along) if key in ONE_SIGN else along
    camera = 1 if key == "clock_offset" else camera
    return key, camera, dict(zip(names, (size * along / np.linalg.norm(along)).tolist(), strict=True))


def filmed(case: Case) -> tuple[list[Observation], list[SequencePlan]]:
    """What is recorded of every flight, and the flights.

    Raises
    ------
    InputError
        Where no flight stays in the pictures.
    """
    plans = [plan_sequence(case.recipe, number) for number in range(case.recipe.sequences)]
    rng = np.random.default_rng([case.recipe.seed, 1])
    views = messy(exact_view_outlines(plans[0]), case.view_px, 1, 0.0, rng)
    recorded = []
    for plan in plans:
        exact = [frame_outlines(each, outline_mesh(each.vertices, each.faces)) for each in plan.by_camera]
        recorded.append([messy(outlines, case.outline_px, case.repeats, 0.015, rng) for outlines in exact])
    return [_stated(observation_of(plan, frames, views)) for plan, frames in zip(plans, recorded, strict=True)], plans


def _stated(observation: Observation) -> Observation:
    """The observation with focal lengths that are stated to be as uncertain as they are."""
    errors = [np.array([FOCAL * c.intrinsics.fx_px, FOCAL * c.intrinsics.fy_px, *(0.0,) * 7]) for c in observation.cameras]
    cameras = (replace(c, lens_covariance=np.outer(error, error)) for c, error in zip(observation.cameras, errors, strict=True))
    return replace(observation, cameras=tuple(cameras))


def solved(case: Case, configuration: Configuration) -> dict[str, Any]:
    """What ``explain`` says of a campaign, and whether it is right."""
    observations, plans = filmed(case)
    began = time.process_time()
    registered = register(observations, configuration)
    explained = explain(registered.campaign, registered.start, catalogue(registered.campaign.cameras))
    told = answer(explained)
    steps = [step for step in told["steps"] if step["established"] and step["added"] != "uniform_acceleration"]
    groups = [[name for name in step["names"] if name != ["unknown"]] for step in steps]
    values = {(row["effect"], row["parameter"]): row for row in told["parameters"]}
    pulls = []
    for name, true in (case.values or {}).items():
        row = values.get((case.key, name))
        pulls += [] if row is None else [(row["value"] - true) / row["sigma"]]
    return {
        "hidden": case.key,
        "values": case.values,
        "found": [step["added"] for step in steps],
        "suspected": [step["added"] for step in told["steps"] if not step["established"]],
        "unknown": told["unknown"],
        "first": case.key in [step["added"] for step in steps],
        "named": any([case.key] in names for names in groups),
        "false": [s["added"] for s, names in zip(steps, groups, strict=True) if [case.key] not in names],
        "pulls": pulls,
        "chi2": [_chi2(plan, state) for plan, state in zip(plans, told["velocities"]["final"], strict=True)],
        "cpu_s": time.process_time() - began,
        "case": {"outline_px": case.outline_px, "view_px": case.view_px, "particle": asdict(case.recipe.particle)},
    }


def _chi2(plan: SequencePlan, state: dict[str, Any]) -> tuple[float, float]:
    """Chi-squared of v and of omega of a flight at its reference time."""
    at = plan.flight.at(plan.effects.true_times(np.array([plan.clock.times_s[0], state["time_s"]]), np.random.default_rng(0))[1:])
    covariance = np.array(state["covariance"])
    error = np.concatenate([state["v_world"], state["omega_world"]]) - np.concatenate([at.v_world[0], at.omega_world[0]])
    v, omega = (float(error[part] @ np.linalg.solve(covariance[part, part], error[part])) for part in (slice(0, 3), slice(3, 6)))
    return v, omega


def study(campaigns: int, seed: int, configuration: Configuration) -> Iterator[dict[str, Any]]:
    """A row per campaign; what does not fly is drawn again."""
    for number in range(campaigns):
        for attempt in range(ATTEMPTS):
            try:
                row = solved(drawn(np.random.default_rng([seed, number, attempt])), configuration)
                break
            except InputError as error:
                print(f"campaign {number + 1}, attempt {attempt + 1}: {error}", flush=True)
        else:
            continue
        print(f"{_line(row)} {', '.join(f'{v:.1f}' for v, _ in row['chi2'])}", flush=True)
        yield row


def page_of(rows: Sequence[dict[str, Any]], seed: int, command: str) -> list[str]:
    """The page."""
    hidden, controls = [r for r in rows if r["hidden"]], [r for r in rows if not r["hidden"]]
    chi2, pulls = np.array([c for r in rows for c in r["chi2"]]), np.array([p for r in rows for p in r["pulls"]])
    inside, held, mean = (chi2 < INSIDE).mean(axis=0), np.mean(np.abs(pulls) < 1.96), chi2.mean(axis=0)
    clean = np.sum([np.less(c, INSIDE) for r in controls for c in r["chi2"]], axis=0)
    lines = [
        "# Effects of one camera of two",
        f"`{command}`, seed {seed}. {len(rows)} campaigns of three flights before two cameras at a right angle, {len(controls)} of them "
        "with nothing hidden; in all of them the mess of the field challenge.",
        f"Named with its camera: {sum(r['first'] for r in hidden)} of {len(hidden)}, or among the names of what was found "
        f"{sum(r['named'] for r in hidden)}. Campaigns with a false name: {sum(bool(r['false']) for r in hidden)} of {len(hidden)}, of "
        f"controls {sum(bool(r['false']) or r['unknown'] for r in controls)} of {len(controls)}. v inside its 95% ellipsoid "
        f"{inside[0]:.0%}, ω {inside[1]:.0%}, of controls {clean} of {sum(len(r['chi2']) for r in controls)}; chi-squared in the mean "
        f"{mean[0]:.1f} and {mean[1]:.1f}, 3 expected; effects' parameters within 1.96 standard deviations {held:.0%} of {len(pulls)}. "
        f"CPU in the median {np.median([r['cpu_s'] for r in rows]):.0f} s, at most {max(r['cpu_s'] for r in rows):.0f} s.",
        "| hidden | values | established | suspected | pulls | CPU, s |\n| --- | --- | --- | --- | --- | --- |\n"
        + "\n".join(_line(row) for row in rows),
    ]
    return lines


def _line(row: dict[str, Any]) -> str:
    values = ", ".join(f"{name} {value:.3g}" for name, value in (row["values"] or {}).items())
    found, suspected = (", ".join(map(in_words, row[part])) for part in ("found", "suspected"))
    more = ", something unknown" if row["unknown"] else ""
    pulls = ", ".join(f"{p:+.1f}" for p in row["pulls"])
    return f"| {in_words(row['hidden']) or 'nothing'} | {values} | {found}{more} | {suspected} | {pulls} | {row['cpu_s']:.0f} |"


def main() -> int:
    """All campaigns, printed and written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--campaigns", type=int, default=12)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--result", type=Path)
    parser.add_argument("--page", type=Path)
    told = parser.parse_args()
    seed = secrets.randbelow(LARGEST_SEED) if told.seed is None else told.seed
    rows: list[dict[str, Any]] = []
    for row in study(told.campaigns, seed, Configuration()):
        rows.append(row)
        if told.result:
            with written_whole(told.result) as temporary:
                temporary.write_text(json.dumps(plain({"seed": seed, "rows": rows}), indent=1) + "\n", encoding="utf-8")
    command = f"python -m scripts.trials.study_one_camera --campaigns {told.campaigns}"
    page = page_of(rows, seed, command)
    print("\n\n".join(page))
    if told.page:
        write_page(page, told.page)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
