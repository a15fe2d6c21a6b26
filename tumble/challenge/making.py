"""Makes the campaigns of a challenge, one per item: observations under neutral names, and what is true apart from them."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.dataset_files import observation_folder, truth_folder
from datasets.errors import InputError
from datasets.observation import Observation, Recording
from datasets.observation_files import read_observation, write_observation
from datasets.truth import Truth
from datasets.truth_files import read_truth, write_truth
from synth.rendering.sequence import render_sequence
from synth.sequence import build_silhouette_campaign, plan_sequence
from tumble.challenge.cases import CASE_FILE, Case, campaign_folder, case_folder, case_from_dict, case_to_dict, sequence_name, write_case
from tumble.engine import Executor, Item, Outcome, run
from tumble.progress import progress

ATTEMPTS = 20
STAGING = ".rendered"


def make_campaigns(cases: Sequence[Case], out: Path, *, executor: Executor, quiet: bool) -> tuple[Outcome, ...]:
    """Make every campaign that ``out`` lacks."""
    items = [_item(case, out) for case in cases]
    with progress("make", len(items), quiet=quiet) as advance:
        return run(make_item, items, executor=executor, advance=advance)


def _item(case: Case, out: Path) -> Item:
    return Item(case.name, payload_of(case, out), case_folder(out, case.name) / CASE_FILE)


def payload_of(case: Case, out: Path) -> dict[str, Any]:
    """What :func:`make_item` takes to make ``case`` in ``out``."""
    return {"case": case_to_dict(case), "out": out}


def make_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Make one campaign; the file that says what is hidden is written last."""
    case, out = case_from_dict(payload["case"]), Path(payload["out"])
    case, made = _made(case, out)
    for observation, truth in made:
        write_truth(truth, case_folder(out, case.name) / truth.name)
        write_observation(observation, observation_folder(campaign_folder(out, case.name), observation.name))
    shutil.rmtree(_staging(case, out), ignore_errors=True)
    write_case(case, case_folder(out, case.name) / CASE_FILE)
    return {"name": case.name}


def neutral(observation: Observation, name: str, views: int) -> Observation:
    """An observation that says nothing but what was seen: another name, no mass (an effect may change it), the first ``views`` views.

    Pictures of views are shown whole.
    """
    recording: Recording = observation.view_recording
    if isinstance(recording, Sequence):
        return replace(observation, name=name, mass_kg=None, views=observation.views[:views], view_recording=tuple(recording)[:views])
    return replace(observation, name=name, mass_kg=None)


def build(case: Case) -> list[tuple[Observation, Truth]]:
    """The sequences of a case of the silhouette tier, in memory, as the solver gets them."""
    return _shown(case, build_silhouette_campaign(case.recipe))


def build_in(case: Case, folder: Path) -> list[tuple[Observation, Truth]]:
    """The sequences of a case of either tier; pictures lie in ``folder``."""
    return _shown(case, _rendered(case, folder)) if case.recipe.tier == "rendered" else build(case)


def _shown(case: Case, made: Sequence[tuple[Observation, Truth]]) -> list[tuple[Observation, Truth]]:
    """Sequences under neutral names; masks, which nothing here asks for, are left out."""
    names = [sequence_name(case.name, index) for index in range(len(made))]
    return [(neutral(o, name, case.views), replace(t, name=name, masks=None)) for name, (o, t) in zip(names, made, strict=True)]


def _made(case: Case, out: Path) -> tuple[Case, list[tuple[Observation, Truth]]]:
    """The sequences, and the case with the seed that gave flights that can be flown, stay in the picture and leave an outline."""
    seeds = np.random.SeedSequence(case.recipe.seed).generate_state(ATTEMPTS)
    failure: Exception
    for seed in (case.recipe.seed, *(int(s >> 1) for s in seeds)):
        tried = replace(case, recipe=replace(case.recipe, seed=seed))
        try:
            return tried, build_in(tried, _staging(case, out))
        except (InputError, ArithmeticError, ValueError) as error:
            failure = error
    raise failure


def _staging(case: Case, out: Path) -> Path:
    return case_folder(out, case.name) / STAGING


def _rendered(case: Case, staging: Path) -> list[tuple[Observation, Truth]]:
    """The sequences, from files; the calibrated views, which they share to the last bit, are rendered with the first one only."""
    recipe = case.recipe
    for index in range(recipe.sequences):
        plan_sequence(recipe, index)  # where no flight fits, that shows before anything is rendered
    frames_only = replace(recipe, rig=replace(recipe.rig, rendered=False))
    names = [render_sequence(frames_only if index else recipe, index, staging) for index in range(recipe.sequences)]
    observations = [read_observation(observation_folder(staging, name)) for name in names]
    shown = [replace(each, views=observations[0].views, view_recording=observations[0].view_recording) for each in observations]
    return list(zip(shown, [read_truth(truth_folder(staging, name)) for name in names], strict=True))
