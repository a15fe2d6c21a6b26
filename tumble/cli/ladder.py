"""``tumble ladder``: the error on data that were not fitted, with one effect more on every rung."""

import argparse

from datasets.errors import InputError
from tumble.cli.campaign_options import campaign_parser, run_on_campaign
from tumble.diagnosing import climbed


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    return campaign_parser(
        "ladder",
        description="Fit free flight, then with the first effect, then with the second..., and judge every model on frames and sequences\n"
        "that it was not fitted to. Writes diagnosis.json and report.html.",
        example="tumble ladder out/dataset --effects quadratic_drag,magnus_lift --out out/ladder",
        effects="the effects, in the order in which they are added, with commas",
    )


def run(arguments: argparse.Namespace) -> int:
    """Climb."""
    if not arguments.effects:
        raise InputError("tumble ladder: expected --effects, the effects to add one by one; `tumble diagnose` says which.")
    return run_on_campaign("ladder", arguments, lambda question, campaign, _out, told: climbed(question, campaign, told))
