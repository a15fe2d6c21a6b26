"""Makes the table of detection limits from campaigns of its own, one per item.

Controls say what is known of every effect where it is small. Of an effect that has to be large to be seen they do not: a focal length that
is half the stated one shrinks the picture, and flights fitted without it fly twice as far away. Such effects are measured in campaigns that
have them, by the statistic of their own test: information at a fit that misses by so much would be that of a wrong model. What is outside
of the catalogue is measured by what the catalogue leaves of it.
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.recipes.recipe import EffectRecipe
from datasets.vocabulary.effects import EFFECTS, PICTURED
from estimator.data.configuration import Configuration
from estimator.diagnosis.diagnose import ALPHA
from estimator.diagnosis.score_tests import Candidates, EfficientScores, ScoreTest, score_tests
from estimator.effects.choosing import catalogue
from estimator.effects.link import Setting
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.base_model import start_with
from estimator.fitting.campaigns.campaign import fit_campaign
from estimator.fitting.campaigns.following import following
from estimator.measurements.silhouettes.registration import register
from tumble.challenge.cases import Case, case_from_dict, case_to_dict
from tumble.challenge.drawing import Counts, Plan, Shape, Sizes, draw_cases, large_effect, outside_effect
from tumble.challenge.information import POWERS, all_information
from tumble.challenge.limits import EffectInformation, LimitTable, OutsideInformation
from tumble.challenge.making import build_in
from tumble.engine import Executor, Item, Outcome, run
from tumble.progress import progress


def development_controls(shape: Shape, controls: int, seed: int) -> tuple[Case, ...]:
    """Campaigns with nothing hidden, from a seed of their own."""
    nothing = LimitTable(ALPHA, len(PICTURED), {}, {})
    return draw_cases(Plan(shape, Counts(0, controls, 0, 0), Sizes(), nothing), seed)


SIZE = {"wall_attraction": (15.0, "m/s2"), "outgassing_thrust": (5.0, "m/s2"), "thermal_focus_drift": (0.03, "1")}
"""Of what is outside of the catalogue, where its strength is measured."""


def development_outside(shape: Shape, each: int, seed: int) -> tuple[Case, ...]:
    """Campaigns with every kind of effect outside of the catalogue, of the stated size."""
    keys = [key for key in SIZE for _ in range(each)]
    cases = development_controls(shape, len(keys), seed + 1)
    return tuple(
        replace(
            case, name=f"o{i + 1:03d}", kind="outside", recipe=replace(case.recipe, effects=(_outside_effect(key, seed, i),)), ratios={}
        )
        for i, (key, case) in enumerate(zip(keys, cases, strict=True))
    )


LARGE = ("focal_length", "principal_point")
"""Effects of which the limits of controls come out a good part of the largest size that nature is given; sizes of each are of one unit."""
SMALLEST_SHARE = 0.4
"""Sizes in campaigns that have them, log-uniform from this share of the largest one on."""


def development_large(shape: Shape, each: int, seed: int) -> tuple[Case, ...]:
    """Campaigns with every effect of :data:`LARGE`, of large sizes."""
    keys = [key for key in LARGE for _ in range(each)]
    cases = development_controls(shape, len(keys), seed + 2)
    effects = [large_effect(key, SMALLEST_SHARE, np.random.default_rng([seed, 3, i])) for i, key in enumerate(keys)]
    return tuple(
        replace(case, name=f"l{i + 1:03d}", kind="single", recipe=replace(case.recipe, effects=(effect,)), ratios={effect.key: np.nan})
        for i, (effect, case) in enumerate(zip(effects, cases, strict=True))
    )


def _outside_effect(key: str, seed: int, number: int) -> EffectRecipe:
    return outside_effect(key, SIZE[key][0], np.random.default_rng([seed, 2, number]))


def measure(cases: Sequence[Case], out: Path, *, executor: Executor, quiet: bool) -> tuple[Outcome, ...]:
    """Write what every campaign knows into ``out``, where it is not there yet."""
    items = [Item(c.name, {"case": case_to_dict(c), "product": out / f"{c.name}.json"}, out / f"{c.name}.json") for c in cases]
    with progress("campaigns", len(items), quiet=quiet) as advance:
        return run(measure_item, items, executor=executor, advance=advance)


def measure_item(payload: dict[str, Any]) -> dict[str, Any]:
    """One campaign: make, register, fit the base model; a control looks at every effect, others at theirs or at what the best leaves."""
    case, product = case_from_dict(payload["case"]), Path(payload["product"])
    with TemporaryDirectory(dir=product.parent) as folder:
        registered = register([observation for observation, _ in build_in(case, Path(folder))], Configuration())
    campaign, model = registered.campaign, registered.campaign.kind.base
    campaign, fit = following(campaign, fit_campaign(campaign, start_with(registered.start, model.size), model))
    tests, scores = score_tests(campaign, fit, Candidates.of(campaign, catalogue().values()))
    if case.kind == "single":
        (effect,) = case.recipe.effects
        sizes = np.array([effect.values[name] for name in EFFECTS[effect.key].sizes], dtype=np.float64)
        statistic = next(test.statistic for test in tests if test.effect.entry.key == effect.key)
        strength = _strength(statistic, sizes.size) / float(sizes @ sizes)
        found: dict[str, Any] = {"large": effect.key, "information": {effect.key: (strength * np.eye(sizes.size)).tolist()}}
    elif case.keys:
        left, columns = left_by_shared(scores, tests)
        found = {"outside": case.keys[0], "left": left, "columns": columns}
    else:
        found = {"information": {key: matrix.tolist() for key, matrix in all_information(campaign, fit, tests).items()}}
    with written_whole(product) as temporary:
        temporary.write_text(json.dumps({"campaign": case.name, **found}) + "\n", encoding="utf-8")
    return {"campaign": case.name}


def left_by_shared(scores: EfficientScores, tests: Sequence[ScoreTest]) -> tuple[float, int]:
    """The least that an effect which all sequences share leaves, and its degrees of freedom.

    An acceleration that each sequence has for itself follows any force in short flights; it loses by its many parameters, not by what it
    leaves.
    """
    white, left = scores.whitener, {}
    y = white @ scores.g
    for number in sorted({c.effect for c in scores.columns if not tests[c.effect].effect.entry.scope.own}):
        X = white @ scores.H[:, [i for i, c in enumerate(scores.columns) if c.effect == number]]
        theta, *_ = np.linalg.lstsq(X, y, rcond=1e-10)
        left[number] = float(np.sum((y - X @ theta) ** 2))
    if not left:
        return float(y @ y), len(y)
    best = min(left, key=lambda number: left[number])
    return left[best], len(y) - len(tests[best].columns)


def table_of(products: Sequence[Path], shape: Shape, seed: int) -> LimitTable:
    """The table from what the campaigns wrote."""
    written = [json.loads(path.read_text(encoding="utf-8")) for path in products]
    found = [each["information"] for each in written if "information" in each and "large" not in each]
    large = {key: [each["information"] for each in written if each.get("large") == key] for key in LARGE}
    if any(large.values()) and not all(large.values()):
        failed = ", ".join(key for key, each in large.items() if not each)
        raise InputError(f"campaigns with large effects: expected some that could be measured for each effect, got none for {failed}.")
    times = np.arange(shape.frames) / 4000.0
    setting = Setting(times, 0.0, np.zeros(3), np.ones(3))
    effects = {}
    for key, entry in PICTURED.items():
        matrices = tuple(np.array(each[key]) for each in large.get(key) or found if key in each)
        if matrices:
            effects[key] = EffectInformation(key, entry.sizes, matrices, len(MODELS[key].starts(setting)), POWERS.get(key, 1))
    described: dict[str, Any] = {"controls": len(found), "seed": seed}
    described |= {"sequences": shape.sequences, "frames": shape.frames, "views": shape.views}
    bodies = "scanned" if shape.particles else "procedural"
    tier = "rendered" if shape.rendered else "silhouette"
    described["large"] = {key: len(each) for key, each in large.items() if each}
    outside = {key: _outside([each for each in written if each.get("outside") == key]) for key in SIZE}
    described |= {"bodies": bodies, "tier": tier, "outside": max(len(each.strength) for each in outside.values())}
    return LimitTable(ALPHA, len(PICTURED), described, effects, {key: each for key, each in outside.items() if each.strength})


def _strength(statistic: float, degrees: int) -> float:
    """Noncentrality that a chi-squared statistic shows: what it is above chance, at least chance's standard deviation."""
    return float(max(statistic - degrees, np.sqrt(2.0 * degrees)))


def _outside(found: Sequence[dict[str, Any]]) -> OutsideInformation:
    """Strength of one kind: noncentrality of what was left of it over its size squared."""
    key = str(found[0]["outside"]) if found else ""
    size, unit = SIZE.get(key, (1.0, ""))
    strength = tuple(_strength(float(each["left"]), int(each["columns"])) / size**2 for each in found)
    return OutsideInformation(key, unit, strength, tuple(int(each["columns"]) for each in found))
