"""``tumble diagnose``: which effect the model misses."""

import argparse

from tumble.cli.campaign_options import add_also, campaign_parser, run_on_campaign
from tumble.diagnosing import diagnosed


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = campaign_parser(
        "diagnose",
        description="Fit all sequences of a folder jointly and put every known effect that is not in the model on trial: the share of the\n"
        "excess residual it would explain, the value to expect, and how sure that is. Writes diagnosis.json and report.html.\n"
        "Exit code 0: done, whatever the verdict; 1: sequences were left out; 2: nothing could be said.",
        example="tumble diagnose out/dataset --effects quadratic_drag --out out/diagnose",
        effects="effects that are in the model already, with commas",
    )
    add_also(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Diagnose."""
    return run_on_campaign("diagnose", arguments, diagnosed, steps=2)
