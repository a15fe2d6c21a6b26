"""``tumble doctor``: what works on this machine, and what to type for the rest."""

import argparse
import dataclasses
import json

from rich.table import Table

from tumble.cli.console import console
from tumble.cli.options import verb_parser
from tumble.environment import Finding, examine


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    return verb_parser(
        "doctor",
        description="Say which renderer variants work here and why not, cores, memory, disk, browser; what to type for what is missing.\n"
        "Exit code 0: everything needed is there; 1: something needed is missing.",
        example="tumble doctor",
    )


def run(arguments: argparse.Namespace) -> int:
    """Examine and print; 1 when something needed is missing."""
    findings = examine()
    if arguments.json:
        print(json.dumps([dataclasses.asdict(finding) for finding in findings], indent=1))
    elif not arguments.quiet:
        _say(findings)
    return int(any(finding.needed and not finding.good for finding in findings))


def _say(findings: list[Finding]) -> None:
    table = Table(box=None, pad_edge=False, show_header=False)
    for finding in findings:
        mark = "ok" if finding.good else ("MISSING" if finding.needed else "not here")
        table.add_row(mark, finding.name, finding.found)
    out = console()
    out.print(table)
    for finding in findings:
        if not finding.good and finding.what_to_type:
            out.print(f"for {finding.name}, type: {finding.what_to_type}", soft_wrap=True)
