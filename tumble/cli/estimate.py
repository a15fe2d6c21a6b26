"""``tumble estimate``: observations become estimates. Reads no truth."""

import argparse
import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from datasets.estimate import Estimate, ImpactEstimate, Status
from datasets.estimate_files import read_estimate
from datasets.observation import COMPANION
from datasets.trajectory_files import trajectories_in
from tumble.cli.estimate_campaign import estimate_campaign
from tumble.cli.estimate_impacts import estimate_with_impacts
from tumble.cli.options import add_configuration, add_jobs, add_known, add_output, verb_parser
from tumble.cli.outcomes import exit_code, report_failures
from tumble.configuring import load_configuration
from tumble.estimating import estimate_all
from tumble.numbers import with_sigma
from tumble.output_directory import Run, output_directory
from tumble.reports.velocities import rows
from tumble.reports.words import adequate, misses_something, next_steps, rms_ete_px
from tumble.result_files import SUFFIX, observations_in


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "estimate",
        description="Measure poses, trajectory and velocities. OBSERVATIONS is a dataset, a folder of observations, or one observation;\n"
        "only pictures or outlines, cameras, clock, gravity and calibrated views are read. With --effects all observations of the folder\n"
        "are one campaign, fitted jointly with these effects in the model; campaign.json has their values. Trajectories\n"
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
    add_jobs(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Estimate; exit code 1 when an observation failed, 2 when all did. A status other than converged is a result, not a failure."""
    if not arguments.effects and trajectories_in(arguments.observations):
        code = estimate_with_impacts(arguments, tell)
        if code is not None:
            return code
    if arguments.effects or trajectories_in(arguments.observations):
        return estimate_campaign(arguments, say_estimates)
    configuration = load_configuration(arguments.config, arguments.settings)
    observations_in(arguments.observations)
    described = Run("estimate", {"observations": str(arguments.observations.resolve()), **configuration})
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = estimate_all(arguments.observations, configuration, out, jobs=arguments.jobs, quiet=arguments.quiet)
        report_failures(out, outcomes)
    tell(arguments, [read_estimate(path) for path in sorted(arguments.out.glob(f"*{SUFFIX}"))])
    return exit_code(outcomes)


def tell(arguments: argparse.Namespace, estimates: list[Estimate]) -> None:
    """Estimates as JSON or for people, and what to do next."""
    if arguments.json:
        print(json.dumps([_brief(part) for estimate in estimates for part in particles_of(estimate)]))
    elif not arguments.quiet:
        say_estimates(estimates)
        truth = arguments.observations / "truth"
        after = f"tumble score {arguments.out} --truth {truth}" if truth.is_dir() else f"tumble report {arguments.out}"
        if any(misses_something(estimate) for estimate in estimates):
            after = f"tumble compare {arguments.observations}"
        Console().print(f"next: {after}", soft_wrap=True, highlight=False)


def say_estimates(estimates: list[Estimate]) -> None:
    """A table for people."""
    table = Table(box=None, pad_edge=False)
    for heading in ("sequence", "status", "v x, y, z (m/s)", "ω x, y, z (rad/s)", "RMS ETE (px)"):
        table.add_column(heading, overflow="fold")
    for part in (part for estimate in estimates for part in particles_of(estimate)):
        table.add_row(part.name, _status_cell(part), *_velocity_cells(part), _rms_cell(part))
    Console().print(table)
    for sentence in (sentence for estimate in estimates for sentence in remarks(estimate)):
        Console().print(sentence, soft_wrap=True, highlight=False)


def particles_of(estimate: Estimate) -> list[Estimate]:
    """The estimate and, where there are two particles, that of the second under a name of its own."""
    second = estimate.companion
    return [estimate] if second is None else [estimate, replace(second, name=estimate.name + COMPANION)]


def remarks(estimate: Estimate) -> list[str]:
    """What a person should know besides the numbers: why there are none, calibrated views and frames that were left out."""
    views = any(estimate.statistics.get(key) for key in ("views_left_out", "views_without_outline"))
    views = views or estimate.statistics.get("view_disagreement", {}).get("calibration_px", 0.0) > 0.0
    said = []
    if estimate.status is not Status.CONVERGED:
        said.append(f"{estimate.name}: {estimate.message} {next_steps(estimate)[0]}")
    elif views or estimate.impacts or misses_something(estimate):
        said.append(f"{estimate.name}: {estimate.message}")
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
