"""``tumble challenge make --field`` and ``tumble challenge score`` of what it made: campaigns as the field has them."""

import argparse
import sys
from dataclasses import asdict

from datasets.errors import InputError
from tumble.challenge.cases import CAMPAIGNS, TRUTH
from tumble.challenge.field_case import MEASURED, Measured, read_field_cases
from tumble.challenge.field_drawing import FieldPlan
from tumble.challenge.field_figures import field_figures
from tumble.challenge.field_making import make_field_campaigns
from tumble.challenge.field_page import write_field_result
from tumble.challenge.field_scoring import score_field_cases
from tumble.challenge.figures import line_of
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.options import executor_of, positive
from tumble.cli.outcomes import exit_code, report_failures, what_next
from tumble.commands import command
from tumble.engine import failures
from tumble.output_directory import Run, output_directory
from tumble.read_paths import paths_given

LEAST_ROWS = 8
NOT_IN_THE_FIELD = (
    *("singles", "controls", "pairs", "outside"),
    *("effects", "smallest", "largest", "particles", "plausible", "drops", "views_off"),
)
"""Options of ``make`` that say what the older challenge hides."""


def field_options(part: argparse.ArgumentParser) -> None:
    """Options of ``make`` that only field campaigns have."""
    part.add_argument("--field", action="store_true", help="campaigns as the field has them: several effects, and always a mess below")
    part.add_argument("--measured", metavar="LIST", help=f"what field campaigns measure (default: {','.join(MEASURED)})")
    part.add_argument("--campaigns", type=positive, default=300, metavar="N", help="field campaigns (default: %(default)s)")
    part.add_argument("--most-flights", type=positive, default=40, metavar="N", help="of a field campaign (default: %(default)s)")
    part.add_argument("--most-rows", type=positive, default=120, metavar="N", help="of a flight in the field (default: %(default)s)")


def make_field(arguments: argparse.Namespace, seed: int) -> int:
    """Draw, fly and write field campaigns.

    Raises
    ------
    InputError
        Where options of the older challenge are given, too.
    """
    given = [name for name in NOT_IN_THE_FIELD if getattr(arguments, name)]
    if given or arguments.tier != "silhouette":
        named = ", ".join(f"--{name.replace('_', '-')}" for name in given or ["tier"])
        raise InputError(f"--field: expected none of the older challenge's options beside it, got {named}.")
    if arguments.most_rows < LEAST_ROWS:
        raise InputError(f"--most-rows {arguments.most_rows}: expected at least {LEAST_ROWS}, got fewer.")
    kinds = _kinds(arguments.measured)
    plan = FieldPlan(arguments.campaigns, (1, arguments.most_flights), (LEAST_ROWS, arguments.most_rows), kinds)
    described = Run("challenge make", {"field": asdict(plan), "seed": seed}, seed, reads=(), beside=(CAMPAIGNS,))
    with output_directory(arguments.out / TRUTH, described, resume=arguments.resume, force=arguments.force) as truth:
        outcomes = make_field_campaigns(plan, seed, arguments.out, executor=executor_of(arguments), quiet=arguments.quiet)
        report_failures(truth, outcomes, verbose=arguments.verbose)
    if not arguments.quiet:
        made = len(outcomes) - len(failures(outcomes))
        then = command("challenge", "solve", arguments.out) if made else None
        print(f"{made} campaigns are in {arguments.out}\n{what_next(then)}")
    return exit_code(outcomes)


def _kinds(words: str | None) -> tuple[Measured, ...]:
    """Kinds of campaigns by name; all where none are named."""
    given = words.split(",") if words else MEASURED
    kinds = tuple(kind for kind in MEASURED if kind in given)
    if len(kinds) != len(given):
        raise InputError(f"--measured {words}: expected some of {', '.join(MEASURED)}, each once, got others.")
    return kinds


def score_field(arguments: argparse.Namespace) -> int:
    """Compare answers with what was hidden in field campaigns."""
    if arguments.result or arguments.earlier:
        raise InputError("--result and --with: expected a challenge made without --field, got a field challenge; see its summary.json.")
    cases = read_field_cases(arguments.challenge)
    read = {"challenge": arguments.challenge, "answers": arguments.answers}
    described = Run("challenge score", {name: str(path.resolve()) for name, path in read.items()}, reads=paths_given(*read.values()))
    scored = score_field_cases(cases, arguments.challenge, arguments.answers)
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        write_field_result(scored, out)
    lost = len(cases) - int(scored.cases["answered"].sum())
    if lost:
        print(f"tumble: {lost} of {len(cases)} campaigns have no answer", file=sys.stderr)
    if not arguments.quiet:
        print("\n".join(line_of(figure) for figure in field_figures(scored)))
        print(f"the page and every table are in {arguments.out}")
    return INCOMPLETE if lost else ALL_MEASURED
