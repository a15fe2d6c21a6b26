"""``tumble ladder``: the error on data that were not fitted, with one effect more on every rung."""

import argparse
from functools import partial
from pathlib import Path

from datasets.errors import InputError
from tumble.cli.campaign_options import campaign_parser, run_on_campaign
from tumble.diagnosing import climbed
from tumble.velocity_errors import velocity_errors


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = campaign_parser(
        "ladder",
        description="Fit free flight, then with the first effect, then with the second..., and judge every model on frames and sequences\n"
        "that it was not fitted to. Writes diagnosis.json and report.html.",
        example="tumble ladder out/dataset --effects quadratic_drag,magnus_lift --out out/ladder",
        effects="the effects, in the order in which they are added, with commas",
    )
    verb.add_argument(
        "--truth", type=Path, metavar="FOLDER", help="the dataset's truth folder: errors of the velocities on every rung, too"
    )
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Climb."""
    if not arguments.effects:
        raise InputError("tumble ladder: expected --effects, the effects to add one by one; `tumble diagnose` says which.")
    truth = arguments.truth
    if truth is not None and not truth.is_dir():
        raise InputError(f"{truth}: expected the truth folder of a dataset, got nothing.")
    errors = None if truth is None else partial(velocity_errors, truth=truth)
    rungs = 2 + arguments.effects.count(",")
    return run_on_campaign(
        "ladder", arguments, lambda question, campaign, _out, told: climbed(question, campaign, told, errors), steps=rungs
    )
