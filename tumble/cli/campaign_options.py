"""Options and output that the verbs on a campaign share: ``compare``, ``diagnose``, ``explain``, ``ladder``, ``estimate --effects``."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

from rich.table import Table

from datasets.estimate_files import read_estimate
from datasets.json_documents import Document, plain, read_document, write_document
from datasets.vocabulary.effects import begins, in_words
from estimator.effects.choosing import chosen_effects
from estimator.fitting.side_by_side import processes
from estimator.reports.misfit_words import p_value
from tumble.campaigning import Known, Prepared
from tumble.cli.console import console
from tumble.cli.exit_codes import ALL_MEASURED, BAD_INPUT, INCOMPLETE
from tumble.cli.options import add_configuration, add_jobs, add_known, add_output, verb_parser
from tumble.cli.outcomes import tell_left_out, what_next
from tumble.configuring import load_configuration
from tumble.diagnosing import DIAGNOSIS_FILE, Question, prepared
from tumble.limiting import facts_told
from tumble.misstated import to_mend
from tumble.numbers import compact
from tumble.output_directory import Run, note_failures, output_directory
from tumble.progress import progress
from tumble.read_paths import effects_read, observations_read, paths_given
from tumble.reasons import grouped
from tumble.reports.drop_words import drops_sentence
from tumble.reports.verdict import percent
from tumble.reports.words import rms_word, rung_name, unmeasured
from tumble.result_files import SUFFIX
from tumble.stating import known, possible

REPORT_FILE = "report.html"
SHOWN = 8
Work = Callable[[Question, Prepared, Path, Callable[[str], None]], Document]


def campaign_parser(name: str, *, description: str, example: str, effects: str) -> argparse.ArgumentParser:
    """A parser for a verb on a campaign; ``effects`` says what ``--effects`` means to it."""
    verb = verb_parser(name, description=description, example=example)
    verb.add_argument("observations", type=Path, metavar="OBSERVATIONS", help="a dataset or a folder of observations or trajectories")
    verb.add_argument("--effects", default="", metavar="LIST", help=effects)
    add_known(verb)
    add_configuration(verb, what="the estimator's configuration")
    add_jobs(verb)
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
        known=known_by(arguments),
    )


def known_by(arguments: argparse.Namespace) -> Known:
    """What the user says beside the recordings."""
    stated = (*map(known, arguments.known), *map(possible, arguments.possible))
    return Known(
        {} if arguments.gravity is None else {"gravity_world": arguments.gravity},
        arguments.mesh,
        stated,
        getattr(arguments, "particle", None),
        arguments.without,
    )


def run_on_campaign(verb: str, arguments: argparse.Namespace, work: Work, *, steps: int = 0) -> int:
    """Read the campaign, work, write ``diagnosis.json``, say what was found; ``steps`` of the work that are told, 0 where nobody knows.

    Exit code 1 when sequences were left out, an estimate is no measurement or the fit has not settled; 2 when the campaign is too short to
    say anything.
    """
    question = question_of(arguments)
    content = {"observations": str(arguments.observations.resolve()), **described_effects(question), **question.configuration}
    described = Run(verb, content, reads=read_by(arguments))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        if not (out / DIAGNOSIS_FILE).exists():
            with processes(arguments.jobs), campaign_of(question, out, quiet=arguments.quiet) as campaign:
                with _told(verb, steps, quiet=arguments.quiet) as told:
                    content = work(question, campaign, out, told)
                write_document(out / DIAGNOSIS_FILE, "diagnosis", content)
        document = read_document(out / DIAGNOSIS_FILE, "diagnosis")
        from tumble.reports.campaign_page import write_campaign_page  # noqa: PLC0415 - loads Matplotlib: 0.4 s, not needed to begin

        write_campaign_page(document, out / REPORT_FILE)
    if arguments.json:
        print(json.dumps(plain(document)))
    elif not arguments.quiet:
        say_diagnosis(document)
        print(f"report: {arguments.out / REPORT_FILE}")
    return BAD_INPUT if document["verdict"]["kind"] == "says nothing" else _incomplete(document, arguments.out)


def _incomplete(document: Document, out: Path) -> int:
    """Whether something was not measured; each estimate that is none, and a fit that has not settled, are told."""
    lost = unmeasured(read_estimate(path) for path in sorted(out.glob(f"*{SUFFIX}")))
    for who, reason in grouped(lost):
        print(f"tumble: {who}: {reason}", file=sys.stderr)
    if not document["settled"]:
        print("tumble: the fit of the campaign has not settled: its values are no measurement.", file=sys.stderr)
    return INCOMPLETE if lost or document["left_out"] or not document["settled"] else ALL_MEASURED


def read_by(arguments: argparse.Namespace) -> tuple[Path, ...]:
    """What a verb on a campaign reads."""
    plug_ins = effects_read(f"{arguments.effects},{getattr(arguments, 'also', '')}")
    options = paths_given(arguments.config, arguments.mesh, getattr(arguments, "truth", None), getattr(arguments, "particle", None))
    return (*observations_read(arguments.observations), *plug_ins, *options)


def described_effects(question: Question) -> dict[str, Any]:
    """The effects of a question as ``run.json`` has them."""
    content = {"effects": question.words, "also": [e.entry.key for e in question.also], "known": question.known.words}
    particle = question.known.particle
    return content if particle is None else {**content, "particle": str(particle.resolve())}


@contextmanager
def campaign_of(question: Question, out: Path, *, quiet: bool) -> Iterator[Prepared]:
    """The campaign of a question; what was left out of it is told and noted."""
    campaign = prepared(question, quiet=quiet)
    yield campaign
    tell_left_out(campaign.left_out)
    note_failures(out, campaign.left_out)


@contextmanager
def _told(verb: str, steps: int, *, quiet: bool) -> Iterator[Callable[[str], None]]:
    """What to call after each step: with their number known a bar with the time left, otherwise a line each."""
    if steps and not quiet:
        with progress(verb, steps, quiet=quiet) as advance:
            yield advance
    elif quiet:
        yield lambda _sentence: None
    else:
        yield lambda sentence: print(f"  {sentence}", file=sys.stderr, flush=True)


def _say(sentence: str) -> None:
    console().print(sentence, soft_wrap=True)


def say_diagnosis(document: Document) -> None:
    """What was found, for people; where something is stated wrongly, that alone."""
    verdict = document["verdict"]
    too_short, wrong = verdict["kind"] == "says nothing", to_mend(verdict)
    if not wrong:
        _say_model(document)
    for sentence in (verdict["sentence"], *verdict["remarks"]):
        _say(sentence)
    if document.get("limits") and document["limits"]["sentence"] and not (too_short or wrong):
        _say(document["limits"]["sentence"])
        if document["limits"].get("unseen") and document["limits"]["unseen"]["sentence"]:
            _say(document["limits"]["unseen"]["sentence"])
    _say(what_next(None if too_short else verdict["next"]))


def _say_model(document: Document) -> None:
    """Values, candidates and the ladder as tables, and what was on trial and stated."""
    out = console()
    if values := [*document["values"], *document.get("values_in_place", ())]:
        out.print(values_table(values))
    if document["diagnosis"] is not None and document["verdict"]["kind"] != "says nothing":
        out.print(candidates_table(document["diagnosis"]))
    if document["ladder"]:
        out.print(ladder_table(document["ladder"], document.get("unit", "px")))
        if document.get("noise_floor") and document["noise_floor"]["floor_px"] > 0.0:
            _say(_floor_sentence(document))
        for sentence in _raised(document):
            _say(sentence)
    if document["diagnosis"] is not None and document.get("not_applicable"):
        _say(f"not on trial, since such measurements cannot show them beside the model: {', '.join(document['not_applicable'])}.")
    for sentence in facts_told(document.get("facts", ())):
        _say(sentence)
    if document.get("drops"):
        _say(drops_sentence(document["drops"]))


def _table(first: str, *headings: str) -> Table:
    """A table whose first column, a name, is never cut."""
    table = Table(box=None, pad_edge=False)
    table.add_column(first, no_wrap=True)
    for heading in headings:
        table.add_column(heading, overflow="fold")
    return table


def _floor_sentence(document: Document) -> str:
    """How far the last rung is from what noise alone would leave."""
    unit, floor = document.get("unit", "px"), document["noise_floor"]["floor_px"]
    last = document["ladder"][-1]["held_out"]["rms_px"]
    if last < floor:
        return (
            f"Noise alone would leave {floor:.4f} {unit}, judged by how much neighbouring rows or frames differ; the last model leaves "
            f"{1.0 - last / floor:.1%} less on what was not fitted: no more than noise, by that measure."
        )
    return f"Noise alone would leave {floor:.4f} {unit}; the last model is {last / floor - 1.0:+.1%} from that on what was not fitted."


def _raised(document: Document) -> Iterator[str]:
    """What to think of rungs of a ladder that raise the error on what was not fitted, though the evidence asks for their effects."""
    established = {step["added"] for step in document.get("steps") or () if step["established"]}
    for before, rung in pairwise(document["ladder"]):
        change = rung["held_out"]["rms_px"] / before["held_out"]["rms_px"] - 1.0
        if change > 0.0 and rung["added"] in established:
            yield (
                f"{begins(in_words(rung['added']))} is in the model by the evidence of the rows that were fitted; on what was not fitted "
                f"the error is {change:.1%} larger with it."
            )


def values_table(values: list[Mapping[str, Any]]) -> Table:
    """Values of the effects in the model; those of many sequences in one line, from the least to the largest."""
    table = _table("effect", "parameter", "sequence", "value", "95% interval", "")
    alike: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for v in values:
        alike.setdefault((v["effect"], v["parameter"]), []).append(v)
    for (effect, _), each in alike.items():
        name = f"{each[0]['parameter']} ({each[0]['unit']})"
        if len(each) > SHOWN:
            found = [float(v["value"]) for v in each]
            table.add_row(effect, name, f"each of {len(each)}", f"{min(found):.2g} to {max(found):.2g}", "each in the report", _odd(each))
            continue
        for v in each:
            low, high = (float(x) for x in v["interval"])
            table.add_row(effect, name, v["sequence"] or "all", compact(v["value"], v["sigma"]), f"{low:.4g} to {high:.4g}", _odd([v]))
    return table


def _odd(values: list[Mapping[str, Any]]) -> str:
    """Whether any of some values is not plausible."""
    return "" if all(v["plausible"] for v in values) else "not plausible"


def candidates_table(diagnosis: Mapping[str, Any]) -> Table:
    """The candidates that explain most."""
    table = _table("effect", "probability", "share of excess", "p, corrected", "expected value (seen from)", "")
    for candidate in diagnosis["candidates"][:SHOWN]:
        values = candidate["values"][:3]
        text = "\n".join(map(_value_and_limit, values))
        missing = bool(diagnosis["missing"])
        alike = "cannot be told apart" if missing and candidate["effect"] in diagnosis["group"][1:] else ""
        odd = "" if all(v["plausible"] for v in values) or not missing else "not plausible"
        share = f"{candidate['share']:.0%}" if missing else "–"
        sure = p_value(candidate["p"])
        table.add_row(candidate["effect"], percent(candidate["probability"]), share, sure, text, alike or odd)
    return table


def _value_and_limit(value: Mapping[str, Any]) -> str:
    """An expected value, and the size that the data would show, where that is known; on one line, so that neither is another's."""
    limit = f" ({value['seen_from']:.3g})" if value["seen_from"] > 0.0 else ""
    if not value["sigma"] > 0.0:
        return f"{value['parameter']}: none seen{limit}" if value["value"] == 0.0 else f"{value['parameter']} = {value['value']:.3g}{limit}"
    unit = "" if value["unit"] == "1" else f" {value['unit']}"
    return f"{value['parameter']} = {compact(value['value'], value['sigma'])}{unit}{limit}"


def ladder_table(rungs: list[Mapping[str, Any]], unit: str) -> Table:
    """Held-out errors step by step."""
    word = rms_word(unit)
    headings = (f"fitted RMS {word} ({unit})", f"held-out RMS {word} ({unit})", "change")
    table = _table("model", *headings, *(("error of v", "error of ω") if rungs[0]["velocity"] else ()))
    before = None
    for rung in rungs:
        value = rung["held_out"]["rms_px"]
        change = "" if before is None else f"{value / before - 1.0:+.1%}"
        velocity = [f"{rung['velocity'][key]:.2f}%" for key in ("v_percent", "omega_percent")] if rung["velocity"] else []
        table.add_row(rung_name(rung), f"{rung['fitted_rms_px']:.4f}", f"{value:.4f}", change, *velocity)
        before = value
    return table
