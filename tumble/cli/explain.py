"""``tumble explain``: add what is missing, step by step, until nothing more is."""

import argparse
from functools import partial
from typing import Any

from datasets.errors import InputError
from tumble.cli.campaign_options import add_also, campaign_parser, run_on_campaign
from tumble.diagnosing import ContactJudged, explained


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = campaign_parser(
        "explain",
        description="Find the most probable set of effects: evidence decides, and every effect stays on trial until the end. Writes\n"
        "diagnosis.json, report.html, campaign.json and an estimate per sequence under the most probable model.",
        example="tumble explain out/dataset --out out/explain",
        effects="not for this verb: it begins with free flight and chooses effects itself",
    )
    add_also(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Explain."""
    if arguments.effects:
        raise InputError("--effects: tumble explain chooses effects itself; expected none. For a model of your own: tumble ladder.")
    return run_on_campaign("explain", arguments, partial(explained, judged=_contact_judged))


def _contact_judged(*given: Any) -> ContactJudged:
    from tumble.explained_drops import contact_judged  # noqa: PLC0415 - loads trimesh: 0.3 s, which campaigns without drops do not need

    return contact_judged(*given)
