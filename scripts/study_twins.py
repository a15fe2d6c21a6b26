"""Whether another rule of naming would lose less of velocities by twins: a wrong frame rate, and a wrong length scale.

``python -m scripts.study_twins CHALLENGE [--result docs/results/study_twins.json]``, of a challenge made with ``tumble challenge make
--singles 16 --controls 0 --pairs 0 --outside 0 --effects frame_rate,length_scale --smallest 1``. Every campaign is fitted without an effect
and with either of the two. Velocity errors that the effect had biased fall as acceptance counts them, by rule: always the one, always the
other, the mean of both fits, and with what is hidden known.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from estimator.diagnosis.adding import fit_with
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.side_by_side import processes
from tumble.challenge.acceptance import velocity_falls
from tumble.challenge.answers import velocities
from tumble.challenge.cases import Case, campaign_folder, read_cases
from tumble.challenge.registering import registered_campaign
from tumble.challenge.scoring import velocity_rows
from tumble.cli.options import cores
from tumble.versions import versions

TWINS = ("frame_rate", "length_scale")
MEAN, KNOWN = "mean of both", "known"
States = list[dict[str, Any]]


def rows_of(root: Path, case: Case) -> list[dict[str, Any]]:
    """Velocity errors of one campaign by every rule, a row per rule and sequence."""
    registered = registered_campaign(campaign_folder(root, case.name), {})
    found: dict[str, States] = {}
    for name, keys in {"": (), **{key: (key,) for key in TWINS}}.items():
        campaign, fit = fit_with(registered.campaign, registered.start, [MODELS[key] for key in keys])
        found[name] = velocities(campaign, fit, campaign_covariance(campaign, fit))
    (hidden,) = case.keys
    rules = {**{key: found[key] for key in TWINS}, MEAN: mean_of(*(found[key] for key in TWINS)), KNOWN: found[hidden]}
    oracle = {"velocities": found[hidden]}
    rows = []
    for rule, states in rules.items():
        named = {"found": [hidden if rule == KNOWN else rule], "velocities": {"base": found[""], "final": states}}
        rows += [{"rule": rule, "hidden": hidden, **row} for row in velocity_rows(case, root, named, oracle)]
    return rows


def mean_of(first: States, second: States) -> States:
    """Velocities half way between two fits."""
    return [
        {**a, **{key: (0.5 * (np.array(a[key]) + np.array(b[key]))).tolist() for key in ("v_world", "omega_world")}}
        for a, b in zip(first, second, strict=True)
    ]


def falls(table: pd.DataFrame) -> list[dict[str, Any]]:
    """The median fall by rule, of either effect and of both together."""
    rows = []
    for rule, part in table.groupby("rule", sort=False):
        by = {key: velocity_falls(part[part["hidden"] == key], "final") for key in TWINS}
        both = pd.concat(list(by.values()))
        rows.append({"rule": rule, "n": len(both), **{key: float(each.median()) for key, each in by.items()}, "both": float(both.median())})
    return rows


def main() -> None:
    """Fit, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("challenge", type=Path, metavar="CHALLENGE")
    parser.add_argument("--result", type=Path, metavar="FILE.json")
    arguments = parser.parse_args()
    rows: list[dict[str, Any]] = []
    with processes(cores()):
        for case in read_cases(arguments.challenge):
            rows += rows_of(arguments.challenge, case)
            print(f"{case.name}: {case.keys[0]}", flush=True)
    found = falls(pd.DataFrame(rows))
    print(pd.DataFrame(found).to_string(index=False, float_format="{:.3g}".format))
    if arguments.result:
        with written_whole(arguments.result) as temporary:
            temporary.write_text(json.dumps({"falls": found, "versions": versions()}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
