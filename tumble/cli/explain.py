"""``tumble explain``: add what is missing, step by step, until nothing more is."""

import argparse

from datasets.errors import InputError
from tumble.cli.campaign_options import add_also, campaign_parser, run_on_campaign
from tumble.diagnosing import explained


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = campaign_parser(
        "explain",
        description="Find the effect that explains most, refit, drop what became superfluous, and go on until only noise is left.\n"
        "A step is accepted only if the error on frames and sequences that were not fitted falls. Writes diagnosis.json, report.html,\n"
        "campaign.json and an estimate per sequence under the last model.",
        example="tumble explain out/dataset --out out/explain",
        effects="not for this verb: it begins with free flight and chooses effects itself",
    )
    add_also(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Explain."""
    if arguments.effects:
        raise InputError("--effects: tumble explain chooses effects itself; expected none. For a model of your own: tumble ladder.")
    return run_on_campaign("explain", arguments, explained)
