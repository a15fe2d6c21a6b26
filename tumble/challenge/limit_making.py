"""Makes the table of detection limits from controls of its own, one per item."""

import json
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from datasets.recipes.effects import sizes
from datasets.vocabulary.effects import EFFECTS
from estimator.configuration import Configuration
from estimator.diagnosis.explain import start_with
from estimator.diagnosis.refitting import Rules
from estimator.diagnosis.score_tests import Candidates, score_tests
from estimator.effects.choosing import catalogue
from estimator.effects.link import Setting
from estimator.effects.registry import MODELS
from estimator.fitting.campaign import fit_campaign
from estimator.registration import register
from tumble.challenge.cases import Case, case_from_dict, case_to_dict
from tumble.challenge.drawing import Counts, Plan, Shape, Sizes, draw_cases
from tumble.challenge.information import POWERS, all_information
from tumble.challenge.limits import EffectInformation, LimitTable
from tumble.challenge.making import build_in
from tumble.engine import Item, Outcome, run
from tumble.progress import progress


def development_controls(shape: Shape, controls: int, seed: int) -> tuple[Case, ...]:
    """Campaigns with nothing hidden, from a seed of their own."""
    nothing = LimitTable(Rules().alpha, len(catalogue()), {}, {})
    return draw_cases(Plan(shape, Counts(0, controls, 0, 0), Sizes(), nothing), seed)


def measure_controls(cases: Sequence[Case], out: Path, *, jobs: int, quiet: bool) -> tuple[Outcome, ...]:
    """Write what every control knows of every effect into ``out``, where it is not there yet."""
    items = [Item(c.name, {"case": case_to_dict(c), "product": str(out / f"{c.name}.json")}, out / f"{c.name}.json") for c in cases]
    with progress("controls", len(items), quiet=quiet) as advance:
        return run(measure_item, items, jobs=jobs, advance=advance)


def measure_item(payload: dict[str, Any]) -> dict[str, Any]:
    """One control: make, register, fit the base model, and look at every effect of the catalogue."""
    case, product = case_from_dict(payload["case"]), Path(payload["product"])
    with TemporaryDirectory(dir=product.parent) as folder:
        registered = register([observation for observation, _ in build_in(case, Path(folder))], Configuration())
    campaign, model = registered.campaign, registered.campaign.kind.base
    fit = fit_campaign(campaign, start_with(registered.start, model.size), model)
    tests, _ = score_tests(campaign, fit, Candidates.of(campaign, catalogue().values()))
    information = {key: matrix.tolist() for key, matrix in all_information(campaign, fit, tests).items()}
    with written_whole(product) as temporary:
        temporary.write_text(json.dumps({"control": case.name, "information": information}) + "\n", encoding="utf-8")
    return {"control": case.name}


def table_of(products: Sequence[Path], shape: Shape, seed: int) -> LimitTable:
    """The table from what the controls wrote."""
    found = [json.loads(path.read_text(encoding="utf-8"))["information"] for path in products]
    times = np.arange(shape.frames) / 4000.0
    setting = Setting(times, 0.0, np.zeros(3), np.ones(3))
    effects = {}
    for key, entry in EFFECTS.items():
        matrices = tuple(np.array(each[key]) for each in found if key in each)
        if matrices:
            effects[key] = EffectInformation(key, sizes(entry), matrices, len(MODELS[key].starts(setting)), POWERS.get(key, 1))
    described = {"controls": len(found), "seed": seed, "sequences": shape.sequences, "frames": shape.frames, "views": shape.views}
    bodies = "scanned" if shape.particles else "procedural"
    tier = "rendered" if shape.rendered else "silhouette"
    return LimitTable(Rules().alpha, len(catalogue()), {**described, "bodies": bodies, "tier": tier}, effects)
