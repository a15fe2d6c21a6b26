"""Advice on further data, put to the test: for pairs that a campaign cannot tell apart, the recordings on trial are made and added.

``python -m scripts.trials.study_separation --result docs/results/study_separation.json --page docs/studies/study_separation.md``.
Silhouette tier, 0.2 px. A case hides one effect in small campaigns; where its pair is one group, every recording that synth can make is
predicted (:mod:`estimator.diagnosis.separation`) and then made: as many drops as the prediction is for, thrown anew at random within the
changed range. What counts is the log likelihood that the rival loses in place of the effect that is true, before and after.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.atomic_files import written_whole
from datasets.observation import Observation
from datasets.recipes.recipe import EffectRecipe, MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.camera import HsvCamera
from estimator.data.configuration import Configuration
from estimator.diagnosis.candidate_recordings import FARTHER, RECORDINGS
from estimator.diagnosis.diagnose import diagnosis_at
from estimator.diagnosis.selection.groups import exchange
from estimator.diagnosis.selection.path import At, looked_at
from estimator.diagnosis.separation import MARGIN, Prospect, separations
from estimator.effects.choosing import catalogue
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.silhouettes.registration import register
from synth.high_speed_camera import hsv_camera
from synth.plan import SequencePlan
from synth.sequence import hsv_outlines, observation_of, plan_sequence, view_outlines
from synth.streams import streams_of

SEED = 20261121
SEEDS = 3
SEQUENCES = 2
Made = Callable[[Recipe, int], SequencePlan]


@dataclass(frozen=True)
class Case:
    """One hidden effect, the effect it is mistaken for, and the campaign in which that happens."""

    name: str
    hidden: EffectRecipe
    rival: str
    speed_ms: tuple[float, float]
    frames: int = 60

    def recipe(self, seed: int) -> Recipe:
        """The campaign."""
        return Recipe(
            seed=seed,
            sequences=SEQUENCES,
            same_particle=True,
            particle=ParticleRecipe(irregularity=0.6, size_mm=(6.0, 6.0)),
            motion=MotionRecipe(frames=self.frames, speed_ms=self.speed_ms, spin_rads=(50.0, 150.0)),
            rig=RigRecipe(drops=4),
            effects=(self.hidden,),
        )


CASES = (
    Case("frame rate 2 % high", EffectRecipe("frame_rate", {"relative": 0.02}), "length_scale", (1.0, 1.5), frames=100),
    Case("quadratic drag 0.9 per m", EffectRecipe("quadratic_drag", {"per_length": 0.9}), "linear_drag", (1.3, 1.5)),
    Case("outline offset 0.5 px", EffectRecipe("outline_offset", {"offset": 0.5}), "view_outline_offset", (1.0, 1.5)),
)


def _motion(**change: Any) -> Made:
    return lambda recipe, index: plan_sequence(replace(recipe, motion=replace(recipe.motion, **_changed(recipe.motion, change))), index)


def _changed(motion: MotionRecipe, change: Mapping[str, float]) -> dict[str, Any]:
    """Fields of a motion multiplied: numbers, or both ends of a range."""
    values = {name: getattr(motion, name) for name in change}
    return {n: tuple(change[n] * x for x in v) if isinstance(v, tuple) else round(change[n] * v) for n, v in values.items()}


def _nearer(recipe: Recipe, index: int) -> SequencePlan:
    """A flight at half the distance from the camera that all others have."""
    plan = plan_sequence(replace(recipe, hsv=replace(recipe.hsv, distance_m=0.5 * recipe.hsv.distance_m)), index)
    camera = hsv_camera(recipe.hsv)
    return replace(plan, hsv=camera, true_camera=plan.effects.lens(camera.intrinsics))


MADE: dict[str, Made] = {
    "another": _motion(),
    "longer": _motion(frames=2.0),
    "faster": _motion(speed_ms=2.0),
    "slower": _motion(speed_ms=0.5),
    "nearer": _nearer,
    "second_camera": _motion(),
}
"""Recordings that are made, by key."""


def second_camera(first: HsvCamera, at: np.ndarray[Any, np.dtype[np.float64]]) -> HsvCamera:
    """The first camera turned by 90 degrees about the vertical through ``at`` (3,) m, and a little farther away."""
    turn = Rotation.from_euler("y", 90.0, degrees=True).as_matrix()
    R = first.R_cam_world @ turn.T
    place = at + FARTHER * turn @ (-first.R_cam_world.T @ first.t_cam_world - at)
    return HsvCamera("second", first.intrinsics, R, -R @ place)


def recording(recipe: Recipe, index: int, key: str) -> Observation:
    """Sequence ``index`` recorded in the way ``key``."""
    plan = MADE[key](recipe, index)
    stream = streams_of(recipe, index)
    views = view_outlines(plan, recipe.noise, np.random.default_rng(stream.rig_noise))
    rng = np.random.default_rng(stream.hsv_noise)
    seen = replace(observation_of(plan, (hsv_outlines(plan, recipe.noise, rng),), views), name=f"{key}-{index:04d}")
    if key != "second_camera":
        return seen
    other = second_camera(plan.hsv, np.array([0.0, 0.0, recipe.hsv.distance_m]))
    also = hsv_outlines(replace(plan, hsv=other), recipe.noise, rng)
    return replace(seen, cameras=(*seen.cameras, other), recordings=(*seen.recordings, also))


def part(registered: Registered, names: Sequence[str]) -> Registered:
    """The sequences of some names alone."""
    campaign = registered.campaign
    rows = [i for i, s in enumerate(campaign.sequences) if s.name in names]
    chosen = campaign.part(rows)
    start = replace(registered.start, flights=tuple(registered.start.flights[i] for i in rows), theta=tuple(np.zeros(0) for _ in rows))
    return replace(registered, campaign=chosen, start=start)


def candidates() -> dict[str, EffectModel]:
    """Effects on trial: those without a search, which none of the cases needs."""
    return {key: effect for key, effect in catalogue().items() if not effect.entry.searched}


def looked(registered: Registered) -> At:
    """All sets of candidates about the base model's fit."""
    return looked_at(registered.campaign, base_fit(registered.campaign, registered.start), candidates(), unknown=True)


def difference(at: At, true: str, rival: str) -> float:
    """Log likelihood (nats) that is lost where the rival stands for the effect that is true, both free: what groups are made by."""
    one, other = (at.trial.evidence.of.keys.index(key) for key in (true, rival))
    return exchange(at.trial, (one,), one, other)[0]


def run_case(case: Case, seed: int, keys: Sequence[str]) -> dict[str, Any]:
    """What is predicted for one campaign and the recordings ``keys``, and what comes of them."""
    recipe, true = case.recipe(seed), case.hidden.key
    base = [recording(recipe, i, "another") for i in range(SEQUENCES)]
    more = {key: [recording(recipe, SEQUENCES * (1 + n) + i, key) for i in range(SEQUENCES)] for n, key in enumerate(keys)}
    everything = register([*base, *(o for each in more.values() for o in each)], Configuration())
    now = part(everything, [o.name for o in base])
    at = looked(now)
    found = diagnosis_at(at)
    told: dict[str, Any] = {"case": case.name, "seed": seed, "true": true, "rival": case.rival, "p": found.p, "recordings": []}
    told |= {"difference": difference(at, true, case.rival), "left_out": [each.name for each in everything.left_out]}
    told["group"] = {true, case.rival} <= set(found.group)
    if not told["group"] or told["left_out"]:
        return told
    (separation,) = separations(now, at.fit, [f.test for f in found.findings], [(true, case.rival)])[0]
    told["predicted"] = separation.now.difference
    for prospect in (p for p in separation.prospects if p.key in keys):
        names = [o.name for o in [*base, *more[prospect.key][: prospect.drops]]]
        after = looked(part(everything, names))
        told["recordings"].append(outcome(prospect, difference(after, true, case.rival)))
    return told


def outcome(prospect: Prospect, measured: float) -> dict[str, Any]:
    """One recording: predicted and measured."""
    return {
        "key": prospect.key,
        "drops": prospect.drops,
        "predicted": prospect.expected.difference,
        "probability": prospect.expected.probability,
        "measured": measured,
        "told_apart": measured > MARGIN,
    }


def summary(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Per case and recording: how often advised, how often that told the pair apart, and medians of the differences."""
    found = []
    for case in dict.fromkeys(row["case"] for row in rows):
        chosen = [row for row in rows if row["case"] == case and row["recordings"]]
        for key in MADE:
            made = [r for row in chosen for r in row["recordings"] if r["key"] == key]
            if made:
                found.append({"case": case, "key": key, "campaigns": len(made), **_counts(made)})
    return found


def _counts(made: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    advised = [r for r in made if r["probability"] >= 0.95]
    refused = [r for r in made if r["probability"] < 0.05]
    return {
        "drops": float(np.mean([r["drops"] for r in made])),
        "predicted": float(np.median([r["predicted"] for r in made])),
        "measured": float(np.median([r["measured"] for r in made])),
        "advised": len(advised),
        "advised_told_apart": sum(r["told_apart"] for r in advised),
        "refused": len(refused),
        "refused_told_apart": sum(r["told_apart"] for r in refused),
    }


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """The page of a result."""
    words = {r.key: r.words for r in RECORDINGS}
    lines = []
    for each in summary(rows):
        told = f"{each['advised_told_apart']} of {each['advised']}" if each["advised"] else "–"
        vain = f"{each['refused_told_apart']} of {each['refused']}" if each["refused"] else "–"
        sizes = f"{each['drops']:.1f} | {each['predicted']:.1f} | {each['measured']:.1f}"
        lines.append(f"| {each['case']} | {words[each['key']]} | {sizes} | {told} | {vain} |")
    grouped = sum(bool(row["recordings"]) for row in rows)
    made = [r for row in rows for r in row["recordings"]]
    total = _counts(made)
    return PAGE.format(
        campaigns=len(rows),
        grouped=grouped,
        recordings=len(made),
        advised=total["advised"],
        advised_told=total["advised_told_apart"],
        refused=total["refused"],
        between=len(made) - total["advised"] - total["refused"],
        between_told=sum(r["told_apart"] for r in made) - total["advised_told_apart"] - total["refused_told_apart"],
        refused_told=total["refused_told_apart"],
        table="\n".join(lines),
    )


PAGE = """# Telling two effects apart

When a campaign cannot tell two effects apart, `tumble diagnose` and `tumble explain` say which further recording would, and which
would not: the log likelihood that the wrong effect loses is predicted for the campaign with an imagined recording more. Here the
recordings are made and added. Silhouette tier, 0.2 px, two sequences of 60 or 100 frames, 24 views; the rows are in
[study_separation.json](../results/study_separation.json).

Of {campaigns} campaigns with one effect hidden, {grouped} had the pair in one group; {recordings} recordings were made for those.
**{advised} were said to tell the pair apart (with 95% probability or more), and {advised_told} of them did;
{refused} were said to be in vain (less than 5%), and {refused_told} of those told it apart all the same.**
Of the {between} in between, {between_told} told it apart: the advice is cautious.
Told apart: in place of the true effect the rival loses a likelihood ratio of more than 20 (ln 20 = 3.0 nats).

| hidden | further recording | drops (mean) | predicted difference, nats (median) | measured (median) | advised, and did | vain, yet did |
| --- | --- | --- | --- | --- | --- | --- |
{table}

The predicted difference is that of the worse case, whichever of the two effects is true, each at the size that the first campaign gives
it; the measured one, of the fitted effect that is true, knows which that was. Drops are thrown at random within the changed range, not
as the one imagined.

```sh
python -m scripts.trials.study_separation --result docs/results/study_separation.json --page docs/studies/study_separation.md
```
"""


def main() -> None:
    """Run the cases that the result does not have yet, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--result", type=Path, required=True)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--case", help="only the case of this name")
    arguments = parser.parse_args()
    rows = json.loads(arguments.result.read_text(encoding="utf-8"))["rows"] if arguments.result.exists() else []
    done = {(row["case"], row["seed"]) for row in rows}
    for case in CASES:
        for seed in range(SEED, SEED + arguments.seeds):
            if (case.name, seed) in done or arguments.case not in {None, case.name}:
                continue
            rows.append(run_case(case, seed, tuple(MADE)))
            print(json.dumps(rows[-1]), flush=True)
            write(arguments.result, json.dumps({"rows": rows, "summary": summary(rows)}, indent=1) + "\n")
    if arguments.page is not None:
        write(arguments.page, page(rows))


def write(path: Path, text: str) -> None:
    """Write a text whole or not at all."""
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
