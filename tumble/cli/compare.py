"""``tumble compare``: model against measurement, where it fails and by how much."""

import argparse

from tumble.cli.campaign_options import add_also, campaign_parser, run_on_campaign
from tumble.diagnosing import compared


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = campaign_parser(
        "compare",
        description="Fit all sequences of a folder jointly and look at what is left: first whether there is anything to explain, then\n"
        "maps of the residuals over time, place, direction, speed, spin and view. Writes diagnosis.json and report.html.",
        example="tumble compare out/dataset --effects quadratic_drag --out out/compare",
        effects="effects in the model, with commas",
    )
    add_also(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Compare."""
    return run_on_campaign("compare", arguments, lambda question, campaign, _out, told: compared(question, campaign, told), steps=2)
