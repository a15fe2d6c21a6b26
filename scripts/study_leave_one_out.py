"""Leave-one-out poses: each calibrated view in turn is the unknown picture, the others find its pose.

In the manner of the leave-one-out test of silhouette-based pose estimation, whose published shares within 5 degrees are 66% for
regular and 88% for irregular particles. Errors are geodesic angles to the given pose, smallest over the body's rotational symmetries.
The hull that ranks the starts is carved from all views; the fit uses the other views alone.

``python -m scripts.study_leave_one_out --particles FOLDER --out out/leave_one_out --runs 3 --result docs/results/leave_one_out.json
--page docs/studies/leave_one_out.md``; without ``--particles`` the bodies are six of the project's own, three cut stones (regular) and
three jagged lumps (irregular).
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.atomic_files import written_whole
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe
from estimator.data.configuration import Configuration
from estimator.data.views import Views
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.particle.particle import Particle, particle_of
from estimator.poses.pose_search import SearchEffort, search_pose
from scripts.study_runs import PROCEDURAL, sources_hash
from studies.flights.bodies import REGULAR, SIX, scanned_files
from studies.looks.figures import figure, write_figure
from studies.looks.words import write_page
from synth.sequence import build_silhouette_sequence
from tumble.cli.options import add_engine, executor_of
from tumble.engine import Item, failures, run
from tumble.progress import progress

WITHIN_DEG = 5.0
EFFORT = SearchEffort(starts=96, candidates=16)


def one_run(payload: dict[str, Any]) -> dict[str, Any]:
    """All views of one particle in one run; writes the errors (degrees) and the RMS ETE (px) of each."""
    recipe = Recipe(seed=payload["seed"], particle=ParticleRecipe(**payload["body"]), motion=MotionRecipe(frames=3))
    observation, truth = build_silhouette_sequence(recipe, payload["index"])
    particle = particle_of(tuple(observation.view_recording), observation.views, Configuration())  # type: ignore[arg-type]
    found = [left_out_error_deg(particle, view, truth.symmetries) for view in range(len(particle.calibrated))]
    row = {"particle": payload["particle"], "run": payload["run"], "error_deg": [e for e, _ in found], "rms_px": [r for _, r in found]}
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps(row))
    return {}


def left_out_error_deg(particle: Particle, view: int, symmetries: NDArray[np.float64]) -> tuple[float, float]:
    """Pose error (degrees) of one view found from the others, and the RMS ETE (px) of the pose; 180 and infinity where none was found."""
    others = [i for i in range(len(particle.calibrated)) if i != view]
    poses = PoseSet(particle.poses.R[others].copy(), particle.poses.t[others].copy())
    views = Views(particle.seen.take(others), poses, particle.body.com_particle)
    found = search_pose(particle.seen.take([view]), views, particle.catalogue, EFFORT)
    if len(found.rms_px) == 0:
        return 180.0, float("inf")
    difference = particle.poses.R[view] @ symmetries
    angles = Rotation.from_matrix(found.poses.R[0].T @ difference).magnitude()
    return float(np.degrees(np.min(angles))), float(found.rms_px[0])


@dataclass(frozen=True)
class StudiedBody:
    """A body of the study: name, recipe of the particle, and its class."""

    name: str
    recipe: dict[str, Any]
    regular: bool


def studied_bodies(folder: Path | None) -> tuple[StudiedBody, ...]:
    """The six scanned bodies of a folder, or six of the procedural family."""
    if folder:
        files = scanned_files(folder)
        return tuple(StudiedBody(name, {"files": (file,)}, name in REGULAR) for name, file in zip(SIX, files, strict=True))
    return tuple(StudiedBody(f"{family} {a:g}", {"family": family, "irregularity": a}, family == "cut_stone") for family, a in PROCEDURAL)


def summary(rows: list[dict[str, Any]], bodies: tuple[StudiedBody, ...]) -> dict[str, Any]:
    """Share of poses within 5 degrees per particle and per class."""
    particles = {}
    for name in (body.name for body in bodies):
        errors = np.concatenate([np.array(row["error_deg"]) for row in rows if row["particle"] == name] or [np.zeros(0)])
        if errors.size:
            particles[name] = {
                "n": int(errors.size),
                "share_within_5_deg": float(np.mean(errors <= WITHIN_DEG)),
                "median_deg": float(np.median(errors)),
                "p95_deg": float(np.percentile(errors, 95)),
            }
    found = [body for body in bodies if body.name in particles]
    classes = {"regular": [b.name for b in found if b.regular], "irregular": [b.name for b in found if not b.regular]}
    shares = {c: float(np.mean([particles[n]["share_within_5_deg"] for n in names])) for c, names in classes.items() if names}
    return {"particles": particles, "share_within_5_deg": shares, "published": {"regular": 0.66, "irregular": 0.88}}


def draw(rows: list[dict[str, Any]], bodies: tuple[StudiedBody, ...], path: Path) -> None:
    """Cumulative distributions of the pose error, one line per particle."""
    picture, all_axes = figure(1, 1, (7, 4.2))
    axes = all_axes[0, 0]
    for name, regular in ((body.name, body.regular) for body in bodies):
        errors = np.sort(np.concatenate([np.array(row["error_deg"]) for row in rows if row["particle"] == name] or [np.zeros(0)]))
        if errors.size:
            style = "--" if regular else "-"
            axes.step(np.maximum(errors, 1e-2), np.arange(1, errors.size + 1) / errors.size, style, where="post", label=name)
    axes.axvline(WITHIN_DEG, color="0.6", lw=1)
    axes.set(xscale="log", xlabel="pose error (degrees)", ylabel="share of left-out views", ylim=(0, 1.02))
    axes.legend(fontsize=8, title="dashed: regular", frameon=False)
    picture.tight_layout()
    write_figure(picture, path)


def page(result: dict[str, Any], picture: str) -> list[str]:
    """The study's page in Markdown, every number from the result."""
    lines = [
        "# Leave-one-out poses",
        "",
        "Each calibrated view in turn is the unknown picture; the others find its pose. The hull that ranks the starts is carved from",
        "all views; the fit that decides uses the others alone.",
        "",
    ]
    lines += ["| particle | left-out views | within 5° | median | 95th percentile |", "| --- | --- | --- | --- | --- |"]
    for name, p in result["particles"].items():
        lines.append(f"| {name} | {p['n']} | {100 * p['share_within_5_deg']:.1f}% | {p['median_deg']:.3f}° | {p['p95_deg']:.2f}° |")
    lines.append("")
    for key, share in result["share_within_5_deg"].items():
        lines.append(f"- {key}: {100 * share:.1f}% within 5° (published: {100 * result['published'][key]:.0f}%)")
    return [*lines, "", f"![Cumulative distribution of the pose error]({picture})"]


def main() -> int:
    """Run what is missing, then write result, figure and page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=Path, help="folder with the scanned particles (PLY); without it the project's own bodies")
    parser.add_argument("--out", type=Path, default=Path("out/leave_one_out"))
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=77)
    add_engine(parser)
    parser.add_argument("--result", type=Path, default=Path("out/leave_one_out/result.json"))
    parser.add_argument("--page", type=Path, default=Path("out/leave_one_out/leave_one_out.md"))
    arguments = parser.parse_args()
    bodies = studied_bodies(arguments.particles)
    folder = arguments.out / sources_hash()
    items = []
    for index in range(len(bodies) * arguments.runs):
        body, number = bodies[index % len(bodies)], index // len(bodies)
        product = folder / f"{arguments.seed}-{body.name.replace(' ', '_')}-{number}.json"
        which = {"body": body.recipe, "particle": body.name, "index": index, "run": number}
        items.append(Item(product.stem, {"seed": arguments.seed, **which, "product": product}, product))
    with progress("particles", len(items), quiet=False) as advance:
        failed = failures(run(one_run, items, executor=executor_of(arguments), advance=advance))
    rows = [json.loads(item.product.read_text()) for item in items if item.product.exists()]
    result = summary(rows, bodies)
    print(json.dumps(result, indent=1))
    write_page([json.dumps(result, indent=1)], arguments.result)
    picture = arguments.page.with_suffix(".png")
    write_page(page(result, picture.name), arguments.page)
    draw(rows, bodies, picture)
    for outcome in failed:
        print(f"{outcome.name} failed: {outcome.message}")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
