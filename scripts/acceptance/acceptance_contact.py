"""Do the right contact models win, is hidden contact physics named, are controls left alone? Sets of ten runs each, or of ``--runs``.

``python -m scripts.acceptance.acceptance_contact --out out/acceptance_contact [--mode fast|full] [--sets 20] [--hidden-sets 10] [--runs 10]
[--cases LIST]``.

Cases: ``compliant`` (truth with Mindlin's tangential compliance: Hertz–Mindlin should beat the rigid impulse, and the compliance be named),
``rigid`` (the other way; these sets are the controls, too), and one per hidden contact option. In ``fast`` mode impacts are nature's own
states with errors drawn as the silhouette tier leaves them (:mod:`tests.reference.contact_sets`); in ``full`` mode every run is rendered as
outlines and measured from nothing. A particle that broke only shows in pictures, so ``chip`` needs ``full``. Each set is one piece of work
whose row is written when it is done: a killed run goes on where it was. ``--result FILE.json`` and ``--page FILE.md`` write what ran.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.estimate import Estimate
from datasets.json_documents import plain
from datasets.observation import Observation
from datasets.recipes.recipe import EffectRecipe
from estimator.contact_validation.detection import power
from estimator.contact_validation.fitting import fit
from estimator.contact_validation.held_out import judge
from estimator.contact_validation.laws.models import RIGID as RIGID_MODEL
from estimator.contact_validation.laws.models import impulse_model
from estimator.contact_validation.spread import prepared
from estimator.contact_validation.validate import LEAST_RUNS, Question, Validation, validate
from estimator.contact_validation.verdict import broken_verdict
from estimator.data.configuration import Configuration
from estimator.measure import measure
from scripts.acceptance.acceptance_runs import acceptance_parser, run_missing, seed_of, write_figures
from synth.sequence import build_silhouette_sequence
from tests.reference.contact_sets import FRICTION, MOST_RUNS, RESTITUTION, drop_recipe, measured_set
from tumble.contact_validating import Collected, Known, collected_from
from tumble.engine import Item

RUNS, SETS, HIDDEN_SETS = 10, 20, 10
HIDDEN: dict[str, EffectRecipe] = {
    "tangential_compliance": EffectRecipe("tangential_compliance", {"ratio": 1.0}),
    "velocity_dependent_restitution": EffectRecipe("velocity_dependent_restitution", {"yield_speed": 0.3}),
    "adhesion": EffectRecipe("adhesion", {"pull_off": 0.6, "reach": 1e-5}),
    "plate_tilt": EffectRecipe("plate_tilt", {"angle": 0.04, "angle_across": -0.03}),
    "yielding_plate": EffectRecipe("yielding_plate", {"inverse_mass": 1500.0}),
    "chip": EffectRecipe("chip", {"depth": 0.15}),
}
"""Sizes of what is hidden, each within the range of the catalogue."""
COMPLIANT, RIGID = "compliant", "rigid"
CASES = (COMPLIANT, RIGID, *HIDDEN)
GOALS = {"ranked": 0.90, "named": 0.85, "accused": 0.05}


def hidden_in(case: str) -> tuple[EffectRecipe, ...]:
    """What is hidden in the contact in sets of ``case``."""
    if case == RIGID:
        return ()
    return (HIDDEN["tangential_compliance" if case == COMPLIANT else case],)


def one_set(payload: dict[str, Any]) -> dict[str, Any]:
    """Make, measure and judge one set; writes its row."""
    case, seed = payload["case"], payload["seed"]
    began = time.process_time()
    found = _collected(case, seed, payload["mode"], payload["runs"])
    models = ("stronge_impulse", "hertz_mindlin") if case in {COMPLIANT, RIGID} else ("stronge_impulse",)
    row: dict[str, Any] = {"case": case, "seed": seed, "impacts": len(found.impacts), "left_out": len(found.left_out)}
    runs = len({i.run for i in found.impacts})
    broke = broken_verdict(found.broken, runs + len(found.broken))
    if broke is not None:
        row |= {"verdict": broke.kind, "missing": list(broke.missing), "alike": [], "gained": 0.0}
    elif runs < LEAST_RUNS:
        row |= {"verdict": "too few runs", "missing": [], "alike": [], "gained": 0.0}
    else:
        judged = validate(found.impacts, Question(models=models, seed=seed), lambda _: None)
        row |= row_of(judged) | {"law": _law_of(judged, case)}
    row["cpu_s"] = time.process_time() - began
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps(plain(row)))
    return {"verdict": row["verdict"]}


def _law_of(found: Validation, case: str) -> dict[str, float]:
    """The numbers of the ladder's own law for what is hidden, fitted to this set."""
    values: dict[str, float] = {}
    for hidden in hidden_in(case):
        law = fit(found.impacts, impulse_model([hidden.key]))
        values |= {name: value for name, value in law.by_name.items() if name not in RIGID_MODEL.names}
    return values


def one_power(payload: dict[str, Any]) -> dict[str, Any]:
    """Share of sets like this one in which what is hidden would be accepted, were the ladder's own law for it nature's; writes it.

    The law has the median values of all sets of its case: those of a set in which nothing is seen would say that nothing can be.
    """
    impacts = prepared(_collected(payload["case"], payload["seed"], payload["mode"], payload["runs"]).impacts, payload["seed"])
    before = judge(impacts, fit(impacts, RIGID_MODEL))
    model = impulse_model([hidden.key for hidden in hidden_in(payload["case"])])
    own = fit(impacts, model)  # its scatter: that of the rigid impulse stands for what is missing there, too
    values = own.by_name | payload["law"]
    law = replace(own, values=np.array([values[name] for name in model.names]))
    found = power(impacts, before, law, np.random.default_rng(0))
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps({"power": found}))
    return {"power": found}


def powers_of(items: Sequence[Item]) -> list[Item]:
    """One piece of work per set that was judged, with the law of its case."""
    rows = {item.name: json.loads(item.product.read_text()) for item in items if item.product.exists()}
    found = []
    for item in items:
        laws = [row["law"] for row in rows.values() if row["case"] == item.payload["case"] and row.get("law")]
        if rows.get(item.name, {}).get("law"):
            law = {name: float(np.median([each[name] for each in laws])) for name in laws[0]}
            product = item.product.with_suffix(".power.json")
            found.append(Item(product.stem, {**item.payload, "law": law, "product": product}, product))
    return found


def row_of(found: Validation) -> dict[str, Any]:
    """What a validation says of its set."""
    scores = {ranked.model.key: -0.5 * ranked.judged.cost for ranked in found.ranking}
    tried = [rung for rung in found.ladder.rungs[2:] if rung.gained is not None]
    return {
        "verdict": found.verdict.kind,
        "missing": list(found.verdict.missing),
        "alike": sorted({key for keys in found.ladder.alike.values() for key in keys}),
        "tried": [rung.key for rung in tried],
        "gained": 0.5 * tried[0].gained.total if tried and tried[0].gained is not None else 0.0,
        "hertz_mindlin_ahead": scores["hertz_mindlin"] - scores["stronge_impulse"] if "hertz_mindlin" in scores else None,
        "constants": found.ladder.accepted[-1].judged.fitted.by_name,
    }


def _collected(case: str, seed: int, mode: str, runs: int) -> Collected:
    recipe = drop_recipe(seed, hidden_in(case))
    if mode == "fast":
        return Collected(tuple(measured_set(recipe, runs, np.random.default_rng(seed))))
    measured: list[tuple[Estimate, Callable[[str], Observation | None]]] = []
    usable = 0
    for index in range(MOST_RUNS):
        try:
            observation, _ = build_silhouette_sequence(recipe, index)
        except InputError:
            continue
        measured.append((measure(observation, Configuration()), lambda _, seen=observation: seen))
        found = collected_from(measured[-1:], Known())
        usable += bool(found.impacts or found.broken)
        if usable == runs:
            break
    return collected_from(measured, Known())


def summary(rows: Sequence[dict[str, Any]], asked: dict[str, Any]) -> dict[str, Any]:
    """The figures that are asked for, of the sets that ran."""
    cases = {case: [row for row in rows if row["case"] == case] for case in CASES}
    found: dict[str, Any] = {**asked, "hidden": {key: dict(e.values) for key, e in HIDDEN.items()}, "cases": {}}
    for case, mine in cases.items():
        if not mine:
            continue
        key = "tangential_compliance" if case == COMPLIANT else case
        told: dict[str, Any] = {"sets": len(mine), "impacts": sum(row["impacts"] for row in mine)}
        if case in {COMPLIANT, RIGID}:
            ahead = [row["hertz_mindlin_ahead"] for row in mine if row.get("hertz_mindlin_ahead") is not None]
            told["ranked_right"] = sum((a > 0) is (case == COMPLIANT) for a in ahead)
            told["median_ahead"] = float(np.median(ahead)) if ahead else 0.0
        told["accused"] = sum(bool(set(row["missing"]) - {key}) for row in mine)
        if case != RIGID:
            told["named_right"] = sum(row["missing"][:1] == [key] for row in mine)
            told["named_with_rivals"] = sum(row["missing"][:1] == [key] and bool(row["alike"]) for row in mine)
            powers = [row["power"] for row in mine if row.get("power") is not None]
            told["expected"] = float(np.mean(powers)) * len(mine) if powers else None
            told["median_gain"] = float(np.median([row["gained"] for row in mine]))
        told["median_cpu_s"] = float(np.median([row["cpu_s"] for row in mine]))
        found["cases"][case] = told
    found["sets"] = list(rows)
    return found


def page(result: dict[str, Any]) -> str:
    """The figures as a page."""
    body = "\n".join(_line(case, told) for case, told in result["cases"].items())
    how = (
        "nature's own states with errors as the silhouette tier leaves them"
        if result["mode"] == "fast"
        else "outlines, measured from nothing"
    )
    sizes = "; ".join(f"{key}: {', '.join(f'{n} {v:g}' for n, v in values.items())}" for key, values in result["hidden"].items())
    return f"""# Telling contact models apart

Sets of {result["runs_per_set"]} runs, every run a fall of the same stone from a height and in an orientation of its own; impacts are {how}.
Runs that touch the plate again within a few frames are repeated. Seed {result["seed"]}; written by
`{_command(result)}`.

| truth | sets | the better model first | named right | expected | wrongly accused | log score gained, median |
| --- | --- | --- | --- | --- | --- | --- |
{body}

"The better model" is Hertz–Mindlin where the truth is compliant and the rigid impulse where it is rigid, by log score on held-out runs.
Restitution and friction are drawn for every set, {" and ".join(f"{low:g} to {high:g}" for low, high in (RESTITUTION, FRICTION))}.
A set is named right when the first physics that the ladder adds is the hidden one, and wrongly accused when it adds any other, before or
after. Expected: in how many sets these impacts can show what is hidden at all, if the ladder's own law for it, at the median of the values
fitted to the sets, were nature's (see
`estimator.contact_validation.detection`). What is hidden: {sizes}.
"""


def _command(result: dict[str, Any]) -> str:
    """What to type for such a result."""
    asked = [] if result["mode"] == "fast" else [f"--mode {result['mode']}"]
    asked += [] if result["runs_per_set"] == RUNS else [f"--runs {result['runs_per_set']}"]
    for option, usual, judged in (("--sets", SETS, {COMPLIANT, RIGID}), ("--hidden-sets", HIDDEN_SETS, set(CASES) - {COMPLIANT, RIGID})):
        drawn = {told["sets"] for case, told in result["cases"].items() if case in judged} - {usual}
        asked += [f"{option} {max(drawn)}"] if drawn else []
    known = [case for case in CASES if case != "chip" or result["mode"] == "full"]
    asked += [] if list(result["cases"]) == known else [f"--cases {','.join(result['cases'])}"]
    return " ".join(["python -m scripts.acceptance.acceptance_contact", *asked])


def _line(case: str, told: dict[str, Any]) -> str:
    def share(key: str) -> str:
        return f"{told[key]} of {told['sets']}" if key in told else ""

    gained = f"{told['median_gain']:.1f}" if "median_gain" in told else ""
    expected = f"{told['expected']:.1f}" if told.get("expected") else ""
    cells = (case.replace("_", " "), told["sets"], share("ranked_right"), share("named_right"), expected, share("accused"), gained)
    return f"| {' | '.join(map(str, cells))} |"


def items_of(arguments: argparse.Namespace, seed: int) -> list[Item]:
    """One piece of work per set."""
    found = []
    for case in arguments.cases.split(","):
        if case not in CASES:
            raise InputError(f"--cases: expected some of {', '.join(CASES)}, got {case}")
        if case == "chip" and arguments.mode == "fast":
            continue
        count = arguments.sets if case in {COMPLIANT, RIGID} else arguments.hidden_sets
        for number in range(count):
            product = arguments.out / f"{arguments.mode}-{seed}-{arguments.runs}-{case}-{number:03d}.json"
            payload = {"case": case, "seed": seed + 1000 * CASES.index(case) + number, "mode": arguments.mode, "runs": arguments.runs}
            payload["product"] = product
            found.append(Item(product.stem, payload, product))
    return found


def rows_of(items: Iterable[Item]) -> list[dict[str, Any]]:
    """Rows of the sets that are done, with what could be expected of each where that is known."""
    rows = []
    for item in items:
        if item.product.exists():
            known = item.product.with_suffix(".power.json")
            rows.append(json.loads(item.product.read_text()) | (json.loads(known.read_text()) if known.exists() else {}))
    return rows


def main() -> int:
    """Run what is missing, print and write the result."""
    parser = acceptance_parser(__doc__, "out/acceptance_contact")
    parser.add_argument("--mode", choices=("fast", "full"), default="fast")
    parser.add_argument("--sets", type=int, default=SETS, help="of compliant and of rigid truth")
    parser.add_argument("--hidden-sets", type=int, default=HIDDEN_SETS, help="of each hidden option")
    parser.add_argument("--runs", type=int, default=RUNS, help="in a set")
    parser.add_argument("--cases", default=",".join(CASES))
    arguments = parser.parse_args()
    seed = seed_of(arguments)
    items = items_of(arguments, seed)
    run_missing(one_set, items, arguments, "sets")
    if arguments.mode == "fast":
        run_missing(one_power, powers_of(items), arguments, "powers")
    result = summary(rows_of(items), {"seed": seed, "mode": arguments.mode, "runs_per_set": arguments.runs, "goals": GOALS})
    print(json.dumps(result["cases"], indent=1))
    write_figures(result, page(result), arguments)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
