"""``tumble challenge``: campaigns with something hidden in them, made, solved without knowing, and scored."""

import argparse
import hashlib
import json
import secrets
import sys
from dataclasses import asdict, replace
from pathlib import Path

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.json_documents import plain
from datasets.recipes.checks import BOUNDS
from datasets.vocabulary.effects import EFFECTS
from tumble.challenge.acceptance import acceptance
from tumble.challenge.cases import CAMPAIGNS, TRUTH, read_cases
from tumble.challenge.drawing import DROPPED, DROPS, RENDERED, Counts, Plan, Shape, Sizes, can_reach_limit, draw_cases
from tumble.challenge.field_case import is_field
from tumble.challenge.figures import line_of
from tumble.challenge.limit_making import development_controls, development_large, development_outside, measure, table_of
from tumble.challenge.limits import TABLE, read_table, write_table
from tumble.challenge.making import make_campaigns
from tumble.challenge.oracle import ask_oracle
from tumble.challenge.scoring import read_answer, score_cases
from tumble.challenge.solving import answer_path, campaigns_in, solve_campaigns
from tumble.challenge.summary import TABLES, of_challenge, pooled, read_tables, summary, table_path, write_tables
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.field_challenge import field_options, make_field, score_field
from tumble.cli.hidden import show_hidden
from tumble.cli.options import Part, add_configuration, add_engine, add_output, add_parts, executor_of, positive, run_part, verb_parser
from tumble.cli.outcomes import exit_code, report_failures, what_next
from tumble.commands import command
from tumble.configuring import load_configuration
from tumble.engine import failures
from tumble.output_directory import Run, output_directory
from tumble.read_paths import paths_given
from tumble.written_files import read_run, refuse_other_file

(VIEWS_OFF,) = (bounds for bounds in BOUNDS if bounds.key == "rig.calibration_px")


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "challenge",
        description="Hide effects in campaigns, find them without knowing, and count how often that works.",
        example="tumble challenge make --out out/challenge",
    )
    add_parts(verb, PARTS)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Run one part."""
    return run_part(arguments, PARTS)


def _shape_options(part: argparse.ArgumentParser) -> None:
    part.add_argument("--sequences", type=positive, default=Shape.sequences, metavar="N", help="per campaign (default: %(default)s)")
    part.add_argument("--frames", type=positive, default=Shape.frames, metavar="N", help="per sequence (default: %(default)s)")
    part.add_argument("--views", type=positive, default=Shape.views, metavar="N", help="calibrated views (default: %(default)s)")
    part.add_argument("--particles", type=Path, metavar="FOLDER", help="scanned particles (PLY) instead of the procedural ones")


def _tier_option(part: argparse.ArgumentParser) -> None:
    part.add_argument(
        "--tier", choices=("silhouette", "rendered"), default="silhouette", help="outlines projected, or pictures rendered and looked at"
    )


def _shape(arguments: argparse.Namespace) -> Shape:
    folder = arguments.particles
    files = tuple(sorted(str(path) for path in folder.glob("*.ply"))) if folder else ()
    if folder and not files:
        raise InputError(f"{folder}: expected scanned particles (*.ply), found none.")
    rendered = getattr(arguments, "tier", "silhouette") == "rendered"
    off_px = getattr(arguments, "views_off", 0.0)
    if not VIEWS_OFF.low <= off_px <= VIEWS_OFF.high:
        raise InputError(f"--views-off {off_px:g}: expected pixels, {VIEWS_OFF.low:g} to {VIEWS_OFF.high:g}.")
    return Shape(arguments.sequences, arguments.frames, arguments.views, rendered, files, getattr(arguments, "drops", False), off_px)


def _make_options(part: argparse.ArgumentParser) -> None:
    field_options(part)
    _shape_options(part)
    for field, count in asdict(Counts()).items():
        default = f"{count}; rendered: {getattr(RENDERED[0], field)}"
        part.add_argument(f"--{field}", type=int, metavar="N", help=f"cases of kind {field} (default: {default})")
    _tier_option(part)
    part.add_argument("--drops", action="store_true", help="particles dropped onto a plate; effects of clock, flight and optics")
    part.add_argument(
        "--views-off", type=float, default=0.0, metavar="PX", help="by how much the stated pose of each view is off (default: %(default)g)"
    )
    part.add_argument("--seed", type=int, help="what everything is drawn from (default: drawn anew); kept under truth/ only")
    part.add_argument("--effects", help="comma-separated keys to draw from (default: all; rendered: all that can reach their limit)")
    part.add_argument("--limits", type=Path, default=TABLE, metavar="FILE", help="table of detection limits")
    for field, end in (("smallest", 0), ("largest", 1)):
        default = f"{Sizes().single[end]:g}; rendered: {RENDERED[1].single[end]:g}"
        part.add_argument(f"--{field}", type=float, help=f"size over the 95%% limit (default: {default})")
    part.add_argument("--plausible", action="store_true", help="keep sizes within the catalogue's plausible ranges")
    add_output(part, default="out/challenge")
    add_engine(part)


def _make(arguments: argparse.Namespace) -> int:
    if arguments.field:
        return make_field(arguments, _seed(arguments))
    table = read_table(arguments.limits)
    rendered = arguments.tier == "rendered"
    offered = tuple(key for key in table.effects if not (rendered or arguments.drops) or can_reach_limit(table, key))
    if arguments.drops:
        offered = tuple(key for key in offered if EFFECTS[key].stage in DROPPED)
    keys = tuple(arguments.effects.split(",")) if arguments.effects else offered
    for key in keys:
        if key not in table.effects:
            raise InputError(f"--effects {key}: expected effects with a detection limit in {arguments.limits}: {', '.join(table.effects)}.")
    counts, sizes = DROPS if arguments.drops else RENDERED if rendered else (Counts(), Sizes())
    counts = replace(counts, **{field: given for field in asdict(counts) if (given := getattr(arguments, field)) is not None})
    given = (arguments.smallest, arguments.largest)
    smallest, largest = (default if size is None else size for default, size in zip(sizes.single, given, strict=True))
    plan = Plan(
        _shape(arguments), counts, Sizes((smallest, largest), (max(smallest, 1.0), max(largest, 1.0))), table, keys, arguments.plausible
    )
    seed = _seed(arguments)
    configuration = {
        "shape": asdict(plan.shape),
        "counts": asdict(counts),
        "sizes": asdict(plan.sizes),
        "effects": list(keys),
        "plausible": plan.plausible,
        "limits": hashlib.sha256(arguments.limits.read_bytes()).hexdigest(),
    }
    reads = paths_given(arguments.limits, arguments.particles)
    described = Run("challenge make", {**configuration, "seed": seed}, seed, reads=reads, beside=(CAMPAIGNS,))
    with output_directory(arguments.out / TRUTH, described, resume=arguments.resume, force=arguments.force) as truth:
        outcomes = make_campaigns(draw_cases(plan, seed), arguments.out, executor=executor_of(arguments), quiet=arguments.quiet)
        report_failures(truth, outcomes, verbose=arguments.verbose)
    if not arguments.quiet:
        beyond = ", ".join(key for key in keys if not can_reach_limit(table, key))
        if beyond:
            print(f"not always as large as their 95% limit, since nature has none so large: {beyond}")
        made = len(outcomes) - len(failures(outcomes))
        then = command("challenge", "solve", arguments.out) if made else None
        print(f"{made} campaigns are in {arguments.out}\n{what_next(then)}")
    return exit_code(outcomes)


def _seed(arguments: argparse.Namespace) -> int:
    """The seed given, that of the run to resume, or a new one."""
    before = read_run(arguments.out / TRUTH) if arguments.resume else None
    if arguments.seed is not None:
        return int(arguments.seed)
    return int(before["seed"]) if before else secrets.randbits(48)


def _kept_option(part: argparse.ArgumentParser) -> None:
    part.add_argument(
        "--keep",
        type=Path,
        metavar="FOLDER",
        help="keep registered campaigns there (pickles: a folder of your own); `score --keep` goes on from them in half the time",
    )


def _solve_options(part: argparse.ArgumentParser) -> None:
    part.add_argument("challenge", type=Path, metavar="CHALLENGE", help="a challenge, its campaigns folder, or one campaign")
    add_configuration(part, what="the estimator's configuration")
    _kept_option(part)
    add_output(part, default="out/challenge_answers")
    add_engine(part)


def _solve(arguments: argparse.Namespace) -> int:
    configuration = load_configuration(arguments.config, arguments.settings)
    campaigns_in(arguments.challenge)
    reads = paths_given(arguments.challenge, arguments.config, arguments.keep)
    described = Run("challenge solve", {"challenge": str(arguments.challenge.resolve()), **configuration}, reads=reads)
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = solve_campaigns(
            arguments.challenge, configuration, out, executor=executor_of(arguments), quiet=arguments.quiet, kept=arguments.keep
        )
        report_failures(out, outcomes, verbose=arguments.verbose)
    if not arguments.quiet:
        made = len(outcomes) - len(failures(outcomes))
        then = command("challenge", "score", arguments.challenge, arguments.out) if made else None
        print(f"{made} answers are in {arguments.out}\n{what_next(then)}")
    return exit_code(outcomes)


def _score_options(part: argparse.ArgumentParser) -> None:
    part.add_argument("challenge", type=Path, metavar="CHALLENGE", help="the challenge, with its truth")
    part.add_argument("answers", type=Path, metavar="ANSWERS", help="what `tumble challenge solve` wrote")
    part.add_argument("--limits", type=Path, default=TABLE, metavar="FILE", help="table of detection limits")
    part.add_argument("--no-oracle", action="store_true", help="leave out the fits with the true effects")
    part.add_argument("--result", type=Path, metavar="FILE.json", help="write the summary here, too, and its tables to FILE_cases.csv etc.")
    part.add_argument(
        "--with", type=Path, metavar="FILE.json", dest="earlier", nargs="+", default=[], help="pool with such results of other challenges"
    )
    add_configuration(part, what="the estimator's configuration, for the oracle")
    _kept_option(part)
    add_output(part, default="out/challenge_score")
    add_engine(part)


def _score(arguments: argparse.Namespace) -> int:
    if is_field(arguments.challenge):
        return score_field(arguments)
    configuration, table = load_configuration(arguments.config, arguments.settings), read_table(arguments.limits)
    _refuse_result(arguments)
    cases = read_cases(arguments.challenge)
    seed = _seed_of(arguments.challenge) if arguments.earlier or arguments.result else 0
    earlier = [read_tables(path, without=seed) for path in arguments.earlier]
    answered = [case for case in cases if answer_path(arguments.answers, case.name).is_file()]
    asked = [] if arguments.no_oracle else [case for case in answered if case.kind != "control"]
    wanted = [(case, not read_answer(arguments.answers, case.name).get("held_out")) for case in asked]
    read = {"challenge": arguments.challenge, "answers": arguments.answers}
    reads = paths_given(*read.values(), arguments.limits, arguments.config, arguments.keep, *arguments.earlier)
    described = Run("challenge score", {name: str(path.resolve()) for name, path in read.items()}, reads=reads)
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = ask_oracle(
            wanted, arguments.challenge, configuration, out, executor=executor_of(arguments), quiet=arguments.quiet, kept=arguments.keep
        )
        report_failures(out, outcomes, verbose=arguments.verbose)
        scored = score_cases(cases, arguments.challenge, arguments.answers, out, table)
        if earlier or arguments.result:
            scored = pooled([*earlier, of_challenge(scored, seed)])
        tables = (*TABLES, *(("impacts",) if len(scored.impacts) else ()))
        write_tables(scored, {name: out / f"{name}.csv" for name in tables})
        text = json.dumps(plain(summary(scored, table)), indent=1) + "\n"
        _write_text(out / "summary.json", text)
        if arguments.result:
            _write_text(arguments.result, text)
            write_tables(scored, {name: table_path(arguments.result, name) for name in tables})
    if len(answered) < len(cases):
        without = ", ".join(case.name for case in cases if case not in answered)
        print(f"tumble: {len(cases) - len(answered)} of {len(cases)} campaigns have no answer: {without}", file=sys.stderr)
    if not arguments.quiet:
        print("\n".join(line_of(figure) for figure in acceptance(scored)))
    return max(exit_code(outcomes), INCOMPLETE if len(answered) < len(cases) else ALL_MEASURED)


def _refuse_result(arguments: argparse.Namespace) -> None:
    """Refuse a result that would replace what is read, or a file of others."""
    if arguments.result is None:
        return
    if arguments.result.resolve() in [path.resolve() for path in arguments.earlier]:
        raise InputError(f"--result {arguments.result}: expected another file than those that are read by --with, got one of them.")
    refuse_other_file(arguments.result, '"acceptance"', "--result")
    for name in TABLES:
        refuse_other_file(table_path(arguments.result, name), "case,", "--result")


def _seed_of(challenge: Path) -> int:
    made = read_run(challenge / TRUTH)
    if made is None or made.get("seed") is None:
        raise InputError(f"{challenge / TRUTH}: expected run.json of `tumble challenge make` with the seed in it, got none.")
    return int(made["seed"])


def _hidden_options(part: argparse.ArgumentParser) -> None:
    _shape_options(part)
    part.add_argument("--seed", type=int, help="what the effect is drawn from (default: drawn anew)")
    part.add_argument("--limits", type=Path, default=TABLE, metavar="FILE", help="table of detection limits")
    part.add_argument("--out", type=Path, default=Path("out/hidden"), metavar="FOLDER", help="output folder (default: %(default)s)")


def _hidden(arguments: argparse.Namespace) -> int:
    seed = secrets.randbits(48) if arguments.seed is None else int(arguments.seed)
    reads = paths_given(arguments.limits, arguments.particles)
    return show_hidden(_shape(arguments), seed, read_table(arguments.limits), arguments.out, reads)


def _write_text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _limits_options(part: argparse.ArgumentParser) -> None:
    _shape_options(part)
    _tier_option(part)
    part.add_argument("--controls", type=positive, default=48, metavar="N", help="campaigns with nothing hidden (default: %(default)s)")
    part.add_argument(
        "--outside", type=positive, default=12, metavar="N", help="campaigns of each kind outside of the catalogue (default: %(default)s)"
    )
    part.add_argument(
        "--large",
        type=positive,
        default=24,
        metavar="N",
        help="campaigns of each effect that only shows where it is large (default: %(default)s)",
    )
    part.add_argument("--seed", type=int, default=4, help="of these controls (default: %(default)s)")
    part.add_argument("--table", type=Path, default=TABLE, metavar="FILE", help="where to write the table")
    add_output(part, default="out/detection_limits")
    add_engine(part)


def _limits(arguments: argparse.Namespace) -> int:
    shape = _shape(arguments)
    refuse_other_file(arguments.table, '"effects"', "--table")
    counts = {name: getattr(arguments, name) for name in ("controls", "outside", "large", "seed")}
    content = {"shape": asdict(shape), **counts}
    described = Run("challenge limits", content, arguments.seed, reads=paths_given(arguments.particles))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        cases = development_controls(shape, arguments.controls, arguments.seed)
        cases += development_outside(shape, arguments.outside, arguments.seed)
        cases += development_large(shape, arguments.large, arguments.seed)
        outcomes = measure(cases, out, executor=executor_of(arguments), quiet=arguments.quiet)
        report_failures(out, outcomes, verbose=arguments.verbose)
        write_table(table_of(sorted(out.glob("[clo][0-9]*.json")), shape, arguments.seed), arguments.table)
    if not arguments.quiet:
        _say_limits(arguments.table)
    return exit_code(outcomes)


def _say_limits(path: Path) -> None:
    for key, entry in json.loads(path.read_text(encoding="utf-8"))["effects"].items():
        for row in entry["limits"]:
            found = f"{row['found_in_half']:.3g} in half, {row['found_in_95_percent']:.3g} in 95% of cases"
            print(f"{key:24} {row['parameter']:12} {found} ({row['lowest']:.3g} to {row['highest']:.3g}) {row['unit']}")


PARTS: tuple[Part, ...] = (
    ("make", "draw and make campaigns; what is hidden goes under truth/", _make_options, _make),
    ("solve", "find what is hidden from observations alone", _solve_options, _solve),
    ("score", "compare answers with what was hidden; print every line of acceptance", _score_options, _score),
    ("hidden", "hide one effect, look for it as a user would, and tell at last what it was", _hidden_options, _hidden),
    ("limits", "write the table of detection limits from campaigns of its own", _limits_options, _limits),
)
