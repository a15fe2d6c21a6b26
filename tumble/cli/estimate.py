"""``tumble estimate``: observations become estimates. Reads no truth."""

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

from rich.table import Table

from datasets.errors import InputError
from datasets.estimate import Estimate, ImpactEstimate, Status
from datasets.estimate_files import read_estimate
from datasets.particle_files import read_particle
from datasets.trajectory_files import trajectories_in
from tumble.cli.console import console
from tumble.cli.estimate_campaign import estimate_campaign
from tumble.cli.estimate_impacts import estimate_with_impacts
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.options import add_configuration, add_engine, add_known, add_output, executor_of, verb_parser
from tumble.cli.outcomes import exit_code, report_failures, what_next
from tumble.commands import command
from tumble.configuring import load_configuration
from tumble.estimating import estimate_all
from tumble.numbers import with_sigma
from tumble.output_directory import Run, output_directory
from tumble.read_paths import observations_read, paths_given
from tumble.reasons import grouped
from tumble.reports.velocities import rows
from tumble.reports.words import adequate, besides_status, misses_something, particles_of, rms_ete_px, unmeasured
from tumble.result_files import estimate_path, observations_in


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "estimate",
        description="Measure poses, trajectory and velocities. OBSERVATIONS is a dataset, a folder of observations, or one observation;\n"
        "only pictures or outlines, cameras, clock, gravity and calibrated views are read. With --effects all observations of the folder\n"
        "are one campaign, fitted jointly with these effects in the model; campaign.json has their values; so they are with\n"
        "--known, --possible or --without. Trajectories\n"
        "(*.csv, *.tum, *.txt) are one campaign of free flights; poses that strike something are free flights with impacts between, each\n"
        "by itself.",
        example="tumble estimate out/dataset --out out/estimates",
    )
    verb.add_argument("observations", type=Path, metavar="OBSERVATIONS", help="a dataset or an observation folder")
    verb.add_argument(
        "--effects", default="", metavar="LIST", help="effects in the model, with commas: gravity,quadratic_drag,./my_wind.py:Wind"
    )
    add_known(verb)
    add_configuration(verb, what="the estimator's configuration")
    add_output(verb, default="out/estimates")
    add_engine(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Estimate; exit code 1 when an observation failed or its estimate is no measurement."""
    stated = bool(arguments.effects or arguments.known or arguments.possible or arguments.without)
    if stated or trajectories_in(arguments.observations):
        return _estimate_jointly(arguments, stated)
    configuration = load_configuration(arguments.config, arguments.settings)
    observations_in(arguments.observations)
    if arguments.particle is not None:
        read_particle(arguments.particle)  # a wrong one ends the run before it begins
    reads = paths_given(*observations_read(arguments.observations), arguments.config, arguments.particle)
    content = {"observations": str(arguments.observations.resolve()), **configuration}
    content |= {} if arguments.particle is None else {"particle": str(arguments.particle.resolve())}
    described = Run("estimate", content, reads=reads)
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = estimate_all(
            arguments.observations, configuration, out, executor=executor_of(arguments), quiet=arguments.quiet, particle=arguments.particle
        )
        report_failures(out, outcomes, verbose=arguments.verbose)
    products = [estimate_path(arguments.out, outcome.name) for outcome in outcomes]
    return max(exit_code(outcomes), tell(arguments, [read_estimate(path) for path in products if path.exists()]))


def _estimate_jointly(arguments: argparse.Namespace, stated: bool) -> int:
    """One campaign; trajectories of which nothing is stated may strike something, and are then measured each by itself."""
    if arguments.scheduler or arguments.time_limit is not None:
        raise InputError(
            "--scheduler, --time-limit: expected recordings that are estimated each by itself, got one joint fit (use --jobs)."
        )
    code = None if stated else estimate_with_impacts(arguments, tell)
    return estimate_campaign(arguments, tell_statuses) if code is None else code


def tell(arguments: argparse.Namespace, estimates: list[Estimate]) -> int:
    """Estimates as JSON or for people, and what to do next; the exit code that their statuses make."""
    code = tell_statuses(arguments, estimates)
    if arguments.json:
        print(json.dumps([_brief(part) for estimate in estimates for part in particles_of(estimate)]))
    elif not arguments.quiet:
        console().print(what_next(_next(arguments, estimates)), soft_wrap=True)
    return code


def _next(arguments: argparse.Namespace, estimates: list[Estimate]) -> str | None:
    if not any(part.status is Status.CONVERGED for estimate in estimates for part in particles_of(estimate)):
        return None
    if any(misses_something(estimate) for estimate in estimates):
        return command("compare", arguments.observations)
    truth = arguments.observations / "truth"
    return command("score", arguments.out, "--truth", truth) if truth.is_dir() else command("report", arguments.out)


def tell_statuses(arguments: argparse.Namespace, estimates: list[Estimate]) -> int:
    """A table, or with ``--quiet`` and ``--json`` what is no measurement on standard error; the exit code that the statuses make."""
    if not (arguments.json or arguments.quiet):
        say_estimates(estimates)
    else:
        for who, reason in grouped(unmeasured(estimates)):
            print(f"tumble: {who}: {reason}", file=sys.stderr)
    return INCOMPLETE if unmeasured(estimates) else ALL_MEASURED


def say_estimates(estimates: list[Estimate]) -> None:
    """A table for people."""
    table = Table(box=None, pad_edge=False)
    for heading in ("sequence", "status", "v x, y, z (m/s)", "ω x, y, z (rad/s)", "RMS ETE (px)"):
        table.add_column(heading, overflow="fold")
    for part in (part for estimate in estimates for part in particles_of(estimate)):
        table.add_row(part.name, _status_cell(part), *_velocity_cells(part), _rms_cell(part))
    console().print(table)
    lost = [f"{who}: {reason}" for who, reason in grouped(unmeasured(estimates))]
    for sentence in (*lost, *(sentence for estimate in estimates for sentence in remarks(estimate))):
        console().print(sentence, soft_wrap=True)


def remarks(estimate: Estimate) -> list[str]:
    """What a person should know besides the numbers: views and frames left out, impacts, a model that misses something."""
    views = any(estimate.statistics.get(key) for key in ("views_left_out", "views_without_outline"))
    views = views or estimate.statistics.get("view_disagreement", {}).get("calibration_px", 0.0) > 0.0
    said = []
    if estimate.status is Status.CONVERGED and (views or estimate.impacts or misses_something(estimate)):
        said.append(f"{estimate.name}: {besides_status(estimate)}")
    said += [f"{estimate.name}: {impact_sentence(number, impact)}" for number, impact in enumerate(estimate.impacts, start=1)]
    for used, done in ((False, "left out"), (True, "used in part")):
        reasons = Counter(frame.reason for frame in estimate.frames if frame.reason and frame.used is used)
        if reasons:
            named = ", ".join(f"{count} {reason}" for reason, count in reasons.items())
            said.append(f"{estimate.name}: {reasons.total()} of {len(estimate.frames)} frames {done}: {named}.")
    return said


def impact_sentence(number: int, impact: ImpactEstimate) -> str:
    """When an impact was, and speed and spin on both sides of it."""
    (speed, spin), (speed_after, spin_after) = ([row["text"] for row in rows(side, None)[6:]] for side in (impact.before, impact.after))
    when = with_sigma(impact.time_s * 1e3, impact.time_sigma_s * 1e3)
    return f"impact {number} at {when} ms: speed {speed}, then {speed_after} m/s; spin {spin}, then {spin_after} rad/s."


def _status_cell(estimate: Estimate) -> str:
    return f"{estimate.status.value}, misfit" if misses_something(estimate) else estimate.status.value


def _velocity_cells(estimate: Estimate) -> tuple[str, str]:
    if estimate.middle is None:
        return "–", "–"
    texts = [row["text"] for row in rows(estimate.middle, None)]
    return "\n".join(texts[:3]), "\n".join(texts[3:6])


def _rms_cell(estimate: Estimate) -> str:
    value = rms_ete_px(estimate)
    return "–" if value is None else f"{value:.3f}"


def _brief(estimate: Estimate) -> dict[str, object]:
    middle = estimate.middle
    return {
        "sequence": estimate.name,
        "status": estimate.status.value,
        "message": estimate.message,
        "adequate": adequate(estimate),
        "rms_ete_px": rms_ete_px(estimate),
        "v_world": None if middle is None else middle.v_world.tolist(),
        "omega_world": None if middle is None else middle.omega_world.tolist(),
    }
