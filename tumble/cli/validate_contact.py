"""``tumble validate-contact``: contact models judged by measured impacts, and which contact physics is missing."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from rich.table import Table

from datasets.errors import InputError
from datasets.json_documents import Document, plain, read_document, write_document
from estimator.contact_validation.heights import heights_against
from estimator.contact_validation.laws.force_models import Materials
from estimator.contact_validation.validate import DEFAULT_MODELS, LEAST_RUNS, MODELS, Question, validate
from estimator.contact_validation.verdict import broken_verdict
from tumble.cli.console import console
from tumble.cli.options import add_output, positive, three_numbers, verb_parser
from tumble.cli.outcomes import tell_left_out
from tumble.contact_documents import FILE, KIND, broken_document, heights_entry, validation_document
from tumble.contact_validating import DIAMOND_KG_M3, Collected, Known, collected
from tumble.numbers import compact, with_sigma
from tumble.output_directory import Run, note_failures, output_directory
from tumble.read_paths import observations_read, paths_given
from tumble.reporting import source_of
from tumble.reports.contact_page import write_contact_page

REPORT_FILE = "report.html"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "validate-contact",
        description="Fit contact models to the impacts of a set of runs, judge them on runs that they were not fitted to, and say which\n"
        f"contact physics is missing. ESTIMATES are those of tumble estimate, with impacts in at least {LEAST_RUNS} runs. The particle's\n"
        f"shape and the plate come from the observations beside them. Writes {FILE} and {REPORT_FILE}.",
        example="tumble validate-contact out/estimates --out out/contact",
    )
    verb.add_argument("estimates", type=Path, metavar="ESTIMATES", help="a folder of estimates with impacts")
    verb.add_argument("--observations", type=Path, metavar="FOLDER", help="what the estimates were made from (default: as they say)")
    normal = "the plate's normal, world frame, towards the side that particles come from, in place of the stated one"
    verb.add_argument("--plate", type=three_numbers, metavar="X,Y,Z", help=normal)
    verb.add_argument("--mesh", type=Path, metavar="FILE", help="the particle as a closed mesh in metres, in place of the calibrated views")
    verb.add_argument("--models", default=",".join(DEFAULT_MODELS), metavar="LIST", help=f"of {', '.join(MODELS)} (default: %(default)s)")
    verb.add_argument("--spheres", type=positive, default=50, metavar="N", help="spheres of a clump, at most (default: %(default)s)")
    verb.add_argument("--seed", type=int, default=0, metavar="N", help="of the draws that carry uncertainty (default: %(default)s)")
    _add_materials(verb)
    add_output(verb, default="out/validate-contact")
    return verb


def _add_materials(verb: argparse.ArgumentParser) -> None:
    """Constants of the materials; diamond on steel where nothing is said."""
    known, steel = Materials(), "; only the length of a contact depends on it"
    group = verb.add_argument_group("materials (default: diamond on steel)")
    group.add_argument("--density", type=float, default=DIAMOND_KG_M3, metavar="KG_M3", help="of the particle, where it was not weighed")
    group.add_argument("--young", type=float, default=1e-9 * known.young_particle_pa, metavar="GPA", help=f"of the particle{steel}")
    group.add_argument("--poisson", type=float, default=known.poisson_particle, metavar="NU", help="of the particle")
    group.add_argument("--plate-young", type=float, default=1e-9 * known.young_plate_pa, metavar="GPA", help="of the plate")
    group.add_argument("--plate-poisson", type=float, default=known.poisson_plate, metavar="NU", help="of the plate")


def run(arguments: argparse.Namespace) -> int:
    """Validate; exit code 1 when runs were left out, 2 when there is nothing to judge by."""
    question, known = question_of(arguments), Known(arguments.plate, arguments.density, arguments.mesh)
    with output_directory(arguments.out, _described(arguments), resume=arguments.resume, force=arguments.force) as out:
        if not (out / FILE).exists():
            content = _validated(arguments, question, known)
            write_document(out / FILE, KIND, content)
        document = read_document(out / FILE, KIND)
        write_contact_page(document, out / REPORT_FILE)
        note_failures(out, document["left_out"])
    if arguments.json:
        print(json.dumps(plain(document)))
    elif not arguments.quiet:
        say_validation(document)
        print(f"report: {arguments.out / REPORT_FILE}")
    return int(bool(document["left_out"]))


def question_of(arguments: argparse.Namespace) -> Question:
    """The question that a command line asks."""
    materials = Materials(1e9 * arguments.young, arguments.poisson, 1e9 * arguments.plate_young, arguments.plate_poisson)
    models = tuple(key.strip() for key in arguments.models.split(",") if key.strip())
    return Question(models, materials, arguments.spheres, arguments.seed)


def _described(arguments: argparse.Namespace) -> Run:
    names = ("plate", "models", "spheres", "seed", "density", "young", "poisson", "plate_young", "plate_poisson")
    said = {name: getattr(arguments, name) for name in names}
    paths = {name: None if path is None else str(path.resolve()) for name, path in _paths(arguments).items()}
    source = arguments.observations or source_of(arguments.estimates)
    reads = paths_given(arguments.estimates, arguments.mesh, *(observations_read(source) if source else ()))
    return Run("validate-contact", {**paths, **said}, seed=arguments.seed, reads=reads)


def _paths(arguments: argparse.Namespace) -> dict[str, Path | None]:
    return {"estimates": arguments.estimates, "observations": arguments.observations, "mesh": arguments.mesh}


def _validated(arguments: argparse.Namespace, question: Question, known: Known) -> Document:
    found = collected(arguments.estimates, arguments.observations, known)
    tell_left_out(found.left_out)
    source, runs = str(arguments.estimates), _runs(found)
    broke = broken_verdict(found.broken, runs + len(found.broken))
    if broke is not None:
        return broken_document(source, found.left_out, found.broken, broke)
    if runs < LEAST_RUNS:
        raise InputError(
            f"{arguments.estimates}: expected impacts of at least {LEAST_RUNS} runs, got {runs} that can be used"
            f" ({len(found.left_out)} left out)."
        )

    def told(sentence: str) -> None:
        if not arguments.quiet:
            print(f"  {sentence}", file=sys.stderr, flush=True)

    heights = heights_against(found.impacts) if known.mesh is not None else None
    document = validation_document(source, validate(found.impacts, question, told), found.left_out, found.broken)
    return {**document, "heights": None if heights is None else heights_entry(heights)}


def _runs(found: Collected) -> int:
    return len({impact.run for impact in found.impacts})


def say_validation(document: Document) -> None:
    """What was found, for people."""
    out = console()

    def say(sentence: str) -> None:
        out.print(sentence, soft_wrap=True)

    if document["models"]:
        out.print(models_table(document["models"]))
        out.print(ladder_table(document["ladder"]["rungs"]))
    say(document["verdict"]["sentence"])
    if document["detectable"]:
        say(f"Found in 95% of sets like this one would be {'; '.join(detectable_words(each) for each in document['detectable'])}.")
    for remark in document["verdict"]["remarks"]:
        say(remark)
    if document.get("heights"):
        say(document["heights"]["sentence"])
    say(f"next: {document['verdict']['next']}")


def detectable_words(entry: dict[str, Any]) -> str:
    """How large physics that is not in the model would have to be to be found."""
    unit = "" if entry["unit"] == "1" else f" {entry['unit']}"
    size = "at no size that is tried" if entry["nearly_all"] is None else f"from {entry['nearly_all']:.2g}{unit} upwards"
    name = entry["parameter"].replace("_", " ")
    return f"{entry['title']}{'' if name in entry['title'] else f' ({name})'} {size}"


def models_table(models: list[dict[str, Any]]) -> Table:
    """Models by their score on held-out impacts."""
    table = Table("model", "constants", "log score, held out", "behind the best", "chance gives", box=None, pad_edge=False)
    for model in models:
        behind = model["behind"]
        gap = "best" if behind is None else f"{behind['log_score']:.1f} ({behind['interval'][0]:.1f} to {behind['interval'][1]:.1f})"
        chance = "" if behind is None else f"{behind['chance']:.1f}"
        table.add_row(model["title"], constants_words(model), f"{model['held_out_log_score']:.1f}", gap, chance)
    return table


def ladder_table(rungs: list[dict[str, Any]]) -> Table:
    """The ladder, step by step."""
    table = Table("added", "log score, held out", "gain", "chance gives", "", box=None, pad_edge=False)
    for rung in rungs:
        gained = rung["gained"]
        cells = ("", "") if gained is None else (f"{gained['log_score']:+.1f}", f"{gained['chance']:.1f}")
        table.add_row(rung["added"], f"{rung['held_out_log_score']:.1f}", *cells, "accepted" if rung["accepted"] else "refused")
    return table


def constants_words(model: dict[str, Any]) -> str:
    """Fitted constants, a line each."""
    units = {v["name"]: "" if v["unit"] == "1" else f" {v['unit']}" for v in model["values"]}
    texts = {v["name"]: with_sigma(v["value"], v["sigma"]) if v["sigma"] > 0 else compact(v["value"], 0) for v in model["values"]}
    return "\n".join(f"{name.replace('_', ' ')} {text}{units[name]}" for name, text in texts.items())
