"""Options and output that the verbs on a campaign share: ``compare``, ``diagnose``, ``explain``, ``ladder``, ``estimate --effects``."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from datasets.json_documents import Document, plain, read_document, write_document
from estimator.diagnosis.explain import Rules
from estimator.effects.choosing import chosen_effects
from tumble.campaigning import Prepared
from tumble.cli.options import add_configuration, add_output, verb_parser
from tumble.configuring import load_configuration
from tumble.diagnosing import DIAGNOSIS_FILE, Question, prepared
from tumble.numbers import compact
from tumble.output_directory import Run, note_failures, output_directory
from tumble.reports.campaign_page import write_campaign_page

REPORT_FILE = "report.html"
SHOWN = 8
ALPHA = Rules().alpha
Work = Callable[[Question, Prepared, Path, Callable[[str], None]], Document]


def campaign_parser(name: str, *, description: str, example: str, effects: str) -> argparse.ArgumentParser:
    """A parser for a verb on a campaign; ``effects`` says what ``--effects`` means to it."""
    verb = verb_parser(name, description=description, example=example)
    verb.add_argument("observations", type=Path, metavar="OBSERVATIONS", help="a dataset or a folder of observations: one campaign")
    verb.add_argument("--effects", default="", metavar="LIST", help=effects)
    add_configuration(verb, what="the estimator's configuration")
    add_output(verb, default=f"out/{name}")
    return verb


def add_also(verb: argparse.ArgumentParser) -> None:
    """``--also``: candidates of the user's own."""
    verb.add_argument("--also", default="", metavar="LIST", help="plug-ins to try beside the catalogue: ./my_wind.py:Wind")


def question_of(arguments: argparse.Namespace) -> Question:
    """The question that a command line asks."""
    also = getattr(arguments, "also", "")
    return Question(
        source=arguments.observations,
        configuration=load_configuration(arguments.config, arguments.settings),
        effects=chosen_effects(arguments.effects) if arguments.effects else (),
        words=arguments.effects,
        also=chosen_effects(also) if also else (),
    )


def run_on_campaign(verb: str, arguments: argparse.Namespace, work: Work) -> int:
    """Read the campaign, work, write ``diagnosis.json``, say what was found.

    Exit code 1 when sequences were left out, 2 when the campaign is too short to say anything.
    """
    question = question_of(arguments)
    described = Run(verb, {"observations": str(arguments.observations.resolve()), **described_effects(question), **question.configuration})
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        if not (out / DIAGNOSIS_FILE).exists():
            with campaign_of(question, out, quiet=arguments.quiet) as campaign:
                content = work(question, campaign, out, _teller(quiet=arguments.quiet))
                write_document(out / DIAGNOSIS_FILE, "diagnosis", content)
        document = read_document(out / DIAGNOSIS_FILE, "diagnosis")
        write_campaign_page(document, out / REPORT_FILE)
    if arguments.json:
        print(json.dumps(plain(document)))
    elif not arguments.quiet:
        say_diagnosis(document)
        print(f"report: {arguments.out / REPORT_FILE}")
    return 2 if document["verdict"]["kind"] == "says nothing" else int(bool(document["left_out"]))


def described_effects(question: Question) -> dict[str, Any]:
    """The effects of a question as ``run.json`` has them."""
    return {"effects": question.words, "also": [e.entry.key for e in question.also]}


@contextmanager
def campaign_of(question: Question, out: Path, *, quiet: bool) -> Iterator[Prepared]:
    """The campaign of a question; what was left out of it is told and noted."""
    campaign = prepared(question, quiet=quiet)
    yield campaign
    for name, reason in campaign.left_out.items():
        print(f"tumble: {name} is left out: {reason}", file=sys.stderr)
    note_failures(out, campaign.left_out)


def _teller(*, quiet: bool) -> Callable[[str], None]:
    return (lambda _sentence: None) if quiet else lambda sentence: print(f"  {sentence}", file=sys.stderr, flush=True)


def say_diagnosis(document: Document) -> None:
    """What was found, for people."""
    console = Console()

    def say(sentence: str) -> None:
        console.print(sentence, soft_wrap=True, highlight=False, markup=False)

    if document["values"]:
        console.print(values_table(document["values"]))
    if document["diagnosis"] is not None and document["verdict"]["kind"] != "says nothing":
        console.print(candidates_table(document["diagnosis"]))
    if document["ladder"]:
        console.print(ladder_table(document["ladder"]))
    say(document["verdict"]["sentence"])
    for remark in document["verdict"]["remarks"]:
        say(remark)
    say(f"next: {document['verdict']['next']}")


def values_table(values: list[Mapping[str, Any]]) -> Table:
    """Values of the effects in the model."""
    table = Table("effect", "parameter", "sequence", "value", "95% interval", "", box=None, pad_edge=False)
    for v in values:
        low, high = (float(x) for x in v["interval"])
        name = f"{v['parameter']} ({v['unit']})"
        within = "" if v["plausible"] else "not plausible"
        table.add_row(v["effect"], name, v["sequence"] or "all", compact(v["value"], v["sigma"]), f"{low:.4g} to {high:.4g}", within)
    return table


def candidates_table(diagnosis: Mapping[str, Any]) -> Table:
    """The candidates that explain most."""
    table = Table("effect", "share of excess", "p, corrected", "expected value", "seen from", "", box=None, pad_edge=False)
    for candidate in diagnosis["candidates"][:SHOWN]:
        values = candidate["values"][:3]
        text = "\n".join(f"{v['parameter']} = {compact(v['value'], v['sigma'])} {v['unit']}" for v in values)
        limits = "\n".join(f"{v['seen_from']:.3g}" for v in values)
        missing = diagnosis["p"] < ALPHA
        alike = "cannot be told apart" if missing and candidate["effect"] in diagnosis["group"][1:] else ""
        odd = "" if all(v["plausible"] for v in values) or not missing else "not plausible"
        share = f"{candidate['share']:.0%}" if missing else "–"
        table.add_row(candidate["effect"], share, f"{candidate['p']:.1e}", text, limits, alike or odd)
    return table


def ladder_table(rungs: list[Mapping[str, Any]]) -> Table:
    """Held-out errors step by step."""
    table = Table("model", "fitted RMS ETE (px)", "held-out RMS ETE (px)", "change", box=None, pad_edge=False)
    before = None
    for rung in rungs:
        value = rung["held_out"]["rms_px"]
        change = "" if before is None else f"{value / before - 1.0:+.1%}"
        table.add_row(
            "free flight" if rung["added"] is None else f"+ {rung['added']}", f"{rung['fitted_rms_px']:.4f}", f"{value:.4f}", change
        )
        before = value
    return table
