"""What the best model could have done: the fit with the effects that are in truth there. Reads truth.

For effects that the estimator has no model of, the oracle is the same campaign made without them, fitted by the base model.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.atomic_files import written_whole
from datasets.json_documents import plain
from datasets.recipes.effects import values_in_sequence
from estimator.data.configuration import configuration_from_dict
from estimator.diagnosis.score_tests import Candidates, score_tests
from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.fitting.campaigns.base_model import start_with
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.following import following
from estimator.fitting.campaigns.held_out import held_out
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.silhouettes.registration import register
from tumble.challenge.answers import parameters, velocities
from tumble.challenge.cases import Case, campaign_folder, case_from_dict, case_to_dict, sequence_name
from tumble.challenge.making import build
from tumble.challenge.registering import registered_campaign
from tumble.engine import Executor, Item, Outcome, run
from tumble.progress import progress

Array = NDArray[np.float64]


def ask_oracle(
    cases: Sequence[tuple[Case, bool]],
    root: Path,
    configuration: Mapping[str, Any],
    out: Path,
    *,
    executor: Executor,
    quiet: bool,
    kept: Path | None = None,
) -> tuple[Outcome, ...]:
    """Fit the true model to every case, where ``out`` lacks that; ``cases`` says where the base model's held-out error is wanted, too.

    ``kept``: a folder of registrations (:mod:`tumble.challenge.registering`).
    """
    items = []
    for case, base in cases:
        product = oracle_path(out, case.name)
        payload = {
            "case": case_to_dict(case),
            "root": root,
            "configuration": dict(configuration),
            "base": base,
            "kept": kept,
            "product": product,
        }
        items.append(Item(case.name, payload, product, apart=("kept",)))
    with progress("oracle", len(items), quiet=quiet) as advance:
        return run(oracle_item, items, executor=executor, advance=advance)


def oracle_path(out: Path, name: str) -> Path:
    """Where the oracle's answer to a campaign lies."""
    return out / f"{name}.oracle.json"


def oracle_item(payload: dict[str, Any]) -> dict[str, Any]:
    """One campaign."""
    case, product = case_from_dict(payload["case"]), Path(payload["product"])
    try:
        said = _outside(case, payload) if case.kind == "outside" else _inside(case, payload)
    except np.linalg.LinAlgError as error:
        said = {"failed": str(error)}
    with written_whole(product) as temporary:
        temporary.write_text(json.dumps(plain({"campaign": case.name, **said}), indent=1) + "\n", encoding="utf-8")
    return {"campaign": case.name}


def _inside(case: Case, payload: Mapping[str, Any]) -> dict[str, Any]:
    kept = Path(payload["kept"]) if payload.get("kept") else None
    registered = registered_campaign(campaign_folder(Path(payload["root"]), case.name), payload["configuration"], kept)
    if not registered.campaign.sequences:
        return {"left_out": [each.name for each in registered.left_out]}
    campaign, start = registered.campaign, registered.start
    free = campaign.kind.base
    base_px = None
    if payload["base"]:
        begun, base = following(campaign, fit_campaign(campaign, start_with(start, free.size), free))
        base_px = held_out(begun, base.state, base.model).rms_px
    campaign, fit = true_fit(case, registered)
    covariance = campaign_covariance(campaign, fit)
    return {
        "base_px": base_px,
        "oracle_px": held_out(campaign, fit.state, fit.model).rms_px,
        "settled": fit.settled,
        "p_weakest": _p_weakest(case, registered),
        "velocities": velocities(campaign, fit, covariance),
        "parameters": parameters(campaign, fit, covariance),
    }


def _p_weakest(case: Case, registered: Registered) -> float:
    """The largest p-value of the effects that are hidden together, of each where the others are in the model."""
    found = []
    for effect in case.recipe.effects if len(case.keys) > 1 else ():
        others = replace(case, recipe=replace(case.recipe, effects=tuple(e for e in case.recipe.effects if e is not effect)))
        asked = Candidates.of(registered.campaign, [catalogue()[effect.key]])
        found += [test.p for test in score_tests(*true_fit(others, registered), asked)[0]]
    return max(found, default=0.0)


def _outside(case: Case, payload: Mapping[str, Any]) -> dict[str, Any]:
    """The campaign without the effect: how well the base model predicts where it is right."""
    twin = replace(case, recipe=replace(case.recipe, effects=(), tier="silhouette"))
    registered = register([observation for observation, _ in build(twin)], configuration_from_dict(payload["configuration"]))
    campaign, model = registered.campaign, registered.campaign.kind.base
    campaign, fit = following(campaign, fit_campaign(campaign, start_with(registered.start, model.size), model))
    return {"oracle_px": held_out(campaign, fit.state, fit.model).rms_px, "settled": fit.settled}


def true_fit(case: Case, registered: Registered) -> tuple[Campaign, CampaignFit]:
    """The fit of the model with the effects in force, started from their true values, and the campaign as it is there."""
    known = catalogue()
    hidden = [effect for effect in case.recipe.effects if effect.key in known]
    model = Model((*registered.campaign.kind.base.effects, *(known[effect.key] for effect in hidden)))
    numbers = {sequence_name(case.name, i): i for i in range(case.recipe.sequences)}
    thetas = []
    for recording in registered.campaign.recordings:
        true = [values_in_sequence(effect, numbers[recording]) for effect in hidden]
        values = [v[name] for v, effect in zip(true, hidden, strict=True) for name in known[effect.key].entry.names]
        thetas.append(np.concatenate([np.zeros(registered.campaign.kind.base.size), values]))
    start = CampaignState(registered.start.flights, tuple(thetas))
    return following(registered.campaign, fit_campaign(registered.campaign, start, model))
