"""What empirical terms remove of effects that the catalogue does not have, and which laws are proposed for them.

``python -m scripts.study_empirical_terms --campaigns 4 --result docs/results/empirical_terms.json``: campaigns as of the challenge (four
sequences of 80 frames, 40 views), the free flight's held-out RMS ETE against that with empirical terms, with the proposed law, and the
oracle's: the same campaign made without the effect. Prints a line per campaign and the shares of the excess that are removed.
"""

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.recipes.synth_only import SYNTH_ONLY
from estimator.data.configuration import Configuration
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.empirical_fit import fit_empirical
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.held_out import held_out
from estimator.measurements.silhouettes.registration import register
from tumble.challenge.cases import Case
from tumble.challenge.drawing import Counts, Plan, Shape, Sizes, draw_cases
from tumble.challenge.limits import TABLE, read_table
from tumble.challenge.making import build

FORCES = ("wall_attraction", "outgassing_thrust")


def cases_of(seed: int, campaigns: int, keys: tuple[str, ...]) -> Iterator[Case]:
    """``campaigns`` cases of every effect."""
    plan = Plan(Shape(), Counts(0, 0, 0, campaigns * len(SYNTH_ONLY)), Sizes(), read_table(TABLE))
    for case in draw_cases(plan, seed):
        if case.recipe.effects[0].key in keys:
            yield case


def row_of(case: Case) -> dict[str, Any]:
    """One campaign: errors and what was proposed."""
    begin = time.perf_counter()
    registered = register([o for o, _ in build(case)], Configuration())
    campaign = registered.campaign
    fit = base_fit(campaign, registered.start)
    left = diagnose(campaign, fit, catalogue()).unknown
    told: dict[str, Any] = {"case": case.name, "effect": case.recipe.effects[0].key, "values": dict(case.recipe.effects[0].values)}
    told |= {"unknown": left.present, "stage": left.stage.value, "family": left.test.effect.entry.key, "oracle_px": oracle_px(case)}
    if not left.present:
        return told
    found = fit_empirical(campaign, fit, left)
    removed = found.removed
    told |= {"base_px": removed.before.rms_px, "empirical_px": removed.after.rms_px, "floor_px": removed.floor_px}
    if found.law is not None:
        law = found.law
        part = law.fit.model.slices[-1]
        told |= {"law_px": law.removed.after.rms_px, "law": [t.key for t in law.terms]}
        told["law_values"] = dict(zip(law.fit.model.effects[-1].entry.names, law.fit.state.theta[0][part].tolist(), strict=True))
        told["exponents"] = [{"term": e.term, "best": e.best, "interval": list(e.interval)} for e in law.law.exponents]
        told["alternatives"] = [list(each.keys) for each in law.law.alternatives]
    return {**told, "seconds": time.perf_counter() - begin}


def oracle_px(case: Case) -> float:
    """Held-out RMS ETE (px) of free flight where it is right: the same campaign without the effect."""
    twin = replace(case, recipe=replace(case.recipe, effects=()))
    registered = register([o for o, _ in build(twin)], Configuration())
    fit = base_fit(registered.campaign, registered.start)
    return held_out(registered.campaign, fit.state, fit.model).rms_px


def removed(row: dict[str, Any], model: str) -> float:
    """Share of the excess of held-out squares over the oracle's that a model removes; NaN where there was no excess or no model."""
    excess = row.get("base_px", np.nan) ** 2 - row["oracle_px"] ** 2
    return float((row.get("base_px", np.nan) ** 2 - row.get(model, np.nan) ** 2) / excess) if excess > 0 else float("nan")


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--campaigns", type=int, default=4, help="of each effect (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=20261121)
    parser.add_argument("--effects", default=",".join(FORCES), help="comma-separated (default: %(default)s)")
    parser.add_argument("--result", type=Path, help="where to write the rows")
    arguments = parser.parse_args()
    rows = []
    for case in cases_of(arguments.seed, arguments.campaigns, tuple(arguments.effects.split(","))):
        row = row_of(case)
        row |= {"removed": removed(row, "empirical_px"), "law_removed": removed(row, "law_px")}
        rows.append(row)
        errors = "  ".join(f"{name} {row.get(f'{name}_px', np.nan):.4f}" for name in ("base", "empirical", "law", "oracle"))
        print(
            f"{row['case']}  {row['effect']:18}  {row['stage']:9}  {errors} px  removed {row['removed']:.0%}",
            row.get("law", ""),
            flush=True,
        )
        if arguments.result:
            arguments.result.write_text(json.dumps({"seed": arguments.seed, "rows": rows}, indent=1) + "\n", encoding="utf-8")
    for name, what in (("removed", "empirical terms"), ("law_removed", "the proposed law")):
        shares = np.array([row[name] for row in rows if np.isfinite(row[name])])
        print(f"{what}: median {np.median(shares):.0%} of the excess removed, least {shares.min():.0%}, of {len(shares)} campaigns")


if __name__ == "__main__":
    main()
