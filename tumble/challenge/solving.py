"""Solves campaigns from their observations alone, one per item: finds the particle, fits, explains. Reads no truth."""

import json
import time
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.json_documents import plain
from estimator.diagnosis.explain import explain
from estimator.effects.choosing import catalogue
from tumble.challenge.answers import answer, no_answer
from tumble.challenge.cases import CAMPAIGNS
from tumble.challenge.registering import registered_campaign
from tumble.engine import Executor, Item, Outcome, run
from tumble.progress import progress

SUFFIX = ".answer.json"


def campaigns_in(source: Path) -> tuple[Path, ...]:
    """Campaign folders of a challenge, of a ``campaigns`` folder, or ``source`` itself.

    Raises
    ------
    InputError
        Where there is none.
    """
    if (source / "observations").is_dir():
        return (source,)
    root = source / CAMPAIGNS if (source / CAMPAIGNS).is_dir() else source
    found = tuple(sorted(path.parent for path in root.glob("*/observations"))) if root.is_dir() else ()
    if not found:
        raise InputError(
            f"{source}: expected campaigns (folders with observations/ in them), got {'none' if root.is_dir() else 'nothing'}."
        )
    return found


def answer_path(out: Path, campaign: str) -> Path:
    """Where the answer to a campaign lies."""
    return out / f"{campaign}{SUFFIX}"


def solve_campaigns(
    source: Path, configuration: dict[str, Any], out: Path, *, executor: Executor, quiet: bool, kept: Path | None = None
) -> tuple[Outcome, ...]:
    """Solve every campaign of ``source`` that ``out`` lacks; registrations are ``kept`` in a folder, if one is given."""
    items = []
    for folder in campaigns_in(source):
        product = answer_path(out, folder.name)
        payload = {"campaign": folder, "configuration": configuration, "product": product, "kept": kept}
        items.append(Item(folder.name, payload, product, apart=("kept",)))
    with progress("solve", len(items), quiet=quiet) as advance:
        return run(solve_item, items, executor=executor, advance=advance)


def solve_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Solve one campaign and write the answer."""
    folder, product = Path(payload["campaign"]), Path(payload["product"])
    kept = payload.get("kept")
    result = {"campaign": folder.name, **solved(folder, payload["configuration"], Path(kept) if kept else None)}
    with written_whole(product) as temporary:
        temporary.write_text(json.dumps(plain(result), indent=1) + "\n", encoding="utf-8")
    return {"found": result["found"]}


def solved(folder: Path, configuration: dict[str, Any], kept: Path | None = None) -> dict[str, Any]:
    """The answer to one campaign, with the CPU time it took.

    ``diagnose`` is the part of ``explain`` up to the first tests; the ``whole`` has registration and what is made of an unknown, too.
    """
    began = time.process_time()
    registered = registered_campaign(folder, configuration, kept)
    found = time.process_time()
    left_out = [f"{each.name}: {each.reason}" for each in registered.left_out]
    if not registered.campaign.sequences:
        return {**no_answer(left_out), "left_out": left_out, "cpu_s": {"register": found - began}}
    said: list[float] = []
    explained = explain(
        registered.campaign, registered.start, catalogue(registered.campaign.cameras), told=lambda _: said.append(time.process_time())
    )
    ended = time.process_time()
    cpu = {"register": found - began, "diagnose": (said[0] if said else ended) - found, "explain": ended - found}
    answered = answer(explained)
    return {**answered, "left_out": left_out, "cpu_s": {**cpu, "whole": time.process_time() - began}}
