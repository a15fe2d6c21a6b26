"""Drops merged into one set of views: against the truth, with what does not belong, of real outlines; what a particle file saves.

``python -m scripts.trials.study_shape --data FOLDER --result docs/results/study_shape.json``. FOLDER holds ``particles`` (scanned bodies)
and ``silhouettes`` (``oxford_dino``, ``uct_stone6``); what is absent is left out. ``--only merging,real`` runs parts.
Every drop is six outlines of the synthetic rig (0.2 px of noise) in the frame of its first camera, so its orientation is withheld.
"""

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.dataset_files import observation_folder
from datasets.errors import InputError
from datasets.observation import CalibratedView, Frames, Observation
from datasets.observation_files import read_observation
from datasets.particle_files import with_particle
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.scoring.score import score
from datasets.tiff_frames import FrameStackWriter, write_stack
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.measure import measure
from estimator.merging.fitted import MergeSettings
from estimator.merging.merge import Merged, merge
from estimator.merging.solid import solid_figures
from estimator.merging.view_set import ViewSet, view_set
from estimator.outlines.recording import view_outlines_of
from scripts.real.real_outlines import RIGHT_DEG, dinosaur, stone
from studies.flights.bodies import SIX
from synth.rendering.sequence import render_sequence
from synth.sequence import build_silhouette_campaign, build_silhouette_sequence, plan_sequence, view_outlines
from synth.streams import streams_of
from tumble.shaping.drops import Drop, drop_of
from tumble.shaping.drops import Pictures as PicturesRead
from tumble.shaping.shaping import shape

Array = NDArray[np.float64]
SIZE_MM, DROPS, CAMERAS = 6.0, 10, 6
OWN = (("cut_stone", 11), ("cut_stone", 12), ("jagged", 13))
"""Particles of the project's own family, with their seeds."""
VIEW_COUNTS = (6, 12, 24, 36, 60)
FOREIGN_TRIALS, FOREIGN_DROPS = 40, 5
FLIGHTS = 2
"""Sequences of each particle in which velocities are compared."""
TRUE_BY_DEG = 1.0
"""Turn up to which a real placement counts as right; of a single view as for single pictures, 5°."""


@dataclass(frozen=True)
class Rendered:
    """``drops`` as a rig sees them, with the truth: ``R``, ``t`` (drop,) of the particle in each, its ``vertices`` and ``faces`` (m)."""

    name: str
    drops: tuple[Drop, ...]
    R: Array
    t: Array
    vertices: Array
    faces: NDArray[np.int64]


def rendered(name: str, particle: ParticleRecipe, seed: int, drops: int = DROPS) -> Rendered:
    """Noisy outlines of ``drops`` placements of a particle, each in a frame of its own."""
    recipe = Recipe(seed=seed, particle=particle, rig=RigRecipe(drops=drops))
    plan = plan_sequence(recipe, 0)
    outlines = view_outlines(plan, recipe.noise, np.random.default_rng(streams_of(recipe, 0).rig_noise))
    made, R, t = [], [], []
    for number in range(drops):
        rows = [i for i, view in enumerate(plan.views) if view.drop == number]
        first = plan.views[rows[0]]
        made.append(Drop(f"drop{number}", Path(f"drop{number}"), *withheld([outlines[i] for i in rows], [plan.views[i] for i in rows]), {}))
        R.append(first.R_cam_particle)
        t.append(first.t_cam_particle)
    return Rendered(name, tuple(made), np.array(R), np.array(t), plan.view_vertices, plan.faces)


def withheld(outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> tuple[tuple[Outline, ...], tuple[CalibratedView, ...]]:
    """The views in the frame of their first camera: where the particle lies is known to nobody."""
    R, t = views[0].R_cam_particle, views[0].t_cam_particle
    turned = [v.R_cam_particle @ R.T for v in views]
    moved = [replace(v, R_cam_particle=Q, t_cam_particle=v.t_cam_particle - Q @ t) for v, Q in zip(views, turned, strict=True)]
    return tuple(outlines), tuple(moved)


def sets_of(drops: Sequence[Drop]) -> list[ViewSet]:
    """As the merging takes them."""
    return [view_set(drop.name, drop.outlines, drop.views) for drop in drops]


def against_truth(merged: Merged, R: Array, t: Array, centre_particle: Array) -> dict[str, Any]:
    """Relative rotations of all pairs of placed sets (degrees) and relative places of the body (m) against the truth."""
    at, R, t = merged.joint.placements, R[list(merged.placed)], t[list(merged.placed)]
    pairs = [(i, j) for i in range(len(R)) for j in range(i)]
    turned = [np.rad2deg(Rotation.from_matrix(at.R[i] @ at.R[j].T @ (R[i] @ R[j].T).T).magnitude()) for i, j in pairs]
    # the particle's true frame turned and moved so that the first placements agree
    Q = R[0].T @ at.R[0]
    q = R[0].T @ (at.t[0] - t[0])
    true_R, true_t = R @ Q, np.einsum("sij,j->si", R, q) + t
    turn = Rotation.from_matrix(at.R.transpose(0, 2, 1) @ true_R).as_rotvec()
    middle = Q.T @ (centre_particle - q)
    there = np.einsum("sij,j->si", true_R, middle) + true_t
    here = np.einsum("sij,j->si", at.R, middle) + at.t
    step = np.einsum("sji,sj->si", at.R, there - here)
    whole = np.concatenate([step, turn], axis=1)[1:].ravel()
    covariance = merged.joint.covariance[6:, 6:]
    inside = np.abs(whole) <= 1.96 * np.sqrt(np.diag(covariance))
    return {
        "relative_rotation_deg": {"median": float(np.median(turned)), "largest": float(np.max(turned))},
        "place_um_rms": float(1e6 * np.sqrt(np.mean(step[1:] ** 2) * 3)),
        "chi_square_per_number": float(whole @ np.linalg.solve(covariance, whole) / len(whole)),
        "inside_95": float(np.mean(inside)),
    }


def merging(data: Path) -> list[dict[str, Any]]:
    """Six scanned particles and three of the family, ten drops each."""
    rows = []
    for name, particle, seed in _particles(data):
        made = rendered(name, particle, seed)
        start = time.process_time()
        sets = sets_of(made.drops)
        merged = merge(sets, MergeSettings())
        seconds = time.process_time() - start
        start = time.process_time()
        shaped = shape(made.drops, name, mass_kg=None)
        whole = time.process_time() - start
        solid = trimesh.Trimesh(made.vertices, made.faces)
        figures = shaped.particle.shape
        rows.append(
            {
                "particle": name,
                "placed": len(merged.placed),
                "left_out": [vars(out) for out in merged.left_out],
                **against_truth(merged, made.R, made.t, solid.center_mass),
                "rms_ete_px": float(np.sqrt(np.mean(merged.set_rms_px**2))),
                "seconds_merging": seconds,
                "seconds_in_all": whole,
                "volume_error": figures["volume_m3"] / abs(float(solid.volume)) - 1.0,
                "volume_sigma": figures["volume_sigma_m3"] / abs(float(solid.volume)),
                "hollow": figures["hollow"],
            }
        )
        print(json.dumps(rows[-1]), flush=True)
    return rows


def _particles(data: Path) -> list[tuple[str, ParticleRecipe, int]]:
    size = (SIZE_MM, SIZE_MM)
    files = [data / "particles" / f"{name}.ply" for name in SIX]
    scanned = [(f.stem, ParticleRecipe(files=(str(f),), size_mm=size), 3 + k) for k, f in enumerate(files) if f.is_file()]
    return scanned + [(f"{family}_{seed}", ParticleRecipe(family=family, size_mm=size), seed) for family, seed in OWN]  # type: ignore[arg-type]


def foreign(_: Path) -> dict[str, Any]:
    """A drop, or one view, of another particle among five drops of cut stones; how often it is named, and what else is."""
    named = {"set": 0, "view": 0}
    wrongly, views = 0, 0
    for trial in range(FOREIGN_TRIALS):
        size = (SIZE_MM, SIZE_MM)
        own = rendered("own", ParticleRecipe(size_mm=size), 100 + trial, FOREIGN_DROPS)
        other = rendered("other", ParticleRecipe(size_mm=size), 500 + trial, 1)
        for kind in named:
            drops = _planted(own.drops, other.drops[0], kind, trial)
            wrong = trial % FOREIGN_DROPS
            merged = merge(sets_of(drops), MergeSettings())
            out = {(o.name, o.view) for o in merged.left_out}
            planted = (drops[wrong].name, None if kind == "set" else trial % CAMERAS)
            named[kind] += planted in out
            wrongly += len(out - {planted})
            views += sum(len(d.views) for d in drops) - (CAMERAS if kind == "set" else 1)
    return {"trials_of_each": FOREIGN_TRIALS, "named": named, "left_out_wrongly": wrongly, "of_views": views}


def _planted(drops: Sequence[Drop], other: Drop, kind: str, trial: int) -> list[Drop]:
    """The foreign outlines are seen by the cameras of the drop whose place they take."""
    made, wrong = list(drops), trial % FOREIGN_DROPS
    if kind == "set":
        made[wrong] = replace(other, name=made[wrong].name)
        return made
    outlines = list(made[wrong].outlines)
    outlines[trial % CAMERAS] = other.outlines[trial % CAMERAS]
    made[wrong] = replace(made[wrong], outlines=tuple(outlines))
    return made


def volumes(data: Path) -> list[dict[str, Any]]:
    """Volume and inertia ratios against the truth for numbers of views, with given poses, and what is stated."""
    rows = []
    for name, particle, seed in _particles(data):
        recipe = Recipe(seed=seed, particle=particle, rig=RigRecipe(drops=DROPS))
        plan = plan_sequence(recipe, 0)
        outlines = view_outlines(plan, recipe.noise, np.random.default_rng(streams_of(recipe, 0).rig_noise))
        solid = trimesh.Trimesh(plan.view_vertices, plan.faces)
        moments = np.linalg.eigvalsh(solid.moment_inertia)
        for count in VIEW_COUNTS:
            made = solid_figures(outlines[:count], plan.views[:count], np.random.default_rng(seed))
            volume, ratios = abs(float(solid.volume)), moments[:2] / moments[2]
            off = made.body.inertia_ratios[:2] - ratios
            rows.append(
                {
                    "particle": name,
                    "views": count,
                    "convexity": volume / float(solid.convex_hull.volume),
                    "hull_volume_error": made.volume_m3 / (1.0 - made.excess) / volume - 1.0,
                    "volume_error": made.volume_m3 / volume - 1.0,
                    "volume_sigma": made.volume_sigma_m3 / volume,
                    "inertia_ratio_error": float(np.abs(off).max()),
                    "inertia_ratio_sigma": made.inertia_sigma,
                    "com_error_um": float(1e6 * np.linalg.norm(made.body.com_particle - solid.center_mass)),
                    "com_sigma_um": 1e6 * made.com_sigma_m * float(np.sqrt(3.0)),
                }
            )
            print(json.dumps(rows[-1]), flush=True)
    return rows


def real(data: Path) -> dict[str, Any]:
    """The turntable's 36 views as six sets, split two ways, and the stone's six views as two sets of three, all ways."""
    folder = data / "silhouettes"
    said: dict[str, Any] = {}
    if (folder / "oxford_dino").is_dir():
        outlines, views = dinosaur(folder / "oxford_dino")
        for how, rows in (
            ("every_sixth", [range(k, 36, 6) for k in range(6)]),
            ("six_in_a_row", [range(6 * k, 6 * k + 6) for k in range(6)]),
        ):
            said[f"oxford_dino, {how}"] = split(outlines, views, [list(r) for r in rows])
            print(json.dumps(said[f"oxford_dino, {how}"]), flush=True)
    if (folder / "uct_stone6").is_dir():
        outlines, views = stone(folder / "uct_stone6")
        for other in [(0, i, j) for i in range(1, 6) for j in range(i + 1, 6)]:
            rest = [k for k in range(6) if k not in other]
            said[f"uct_stone6, {other} and {tuple(rest)}"] = split(outlines, views, [list(other), rest])
        for one in range(6):
            said[f"uct_stone6, all but {one}, and {one}"] = split(outlines, views, [[k for k in range(6) if k != one], [one]])
        print(json.dumps(said), flush=True)
    return said


def split(outlines: Sequence[Outline], views: Sequence[CalibratedView], rows: Sequence[Sequence[int]]) -> dict[str, Any]:
    """Calibrated views cut into sets whose relative pose is withheld, merged, and compared with what was given."""
    start = time.process_time()
    sets = [view_set(f"set{k}", *withheld([outlines[i] for i in part], [views[i] for i in part])) for k, part in enumerate(rows)]
    try:
        merged = merge(sets, MergeSettings())
    except InputError as error:
        return {"refused": str(error), "seconds": time.process_time() - start}
    if len(merged.placed) == 1:
        return {"refused": merged.left_out[0].reason, "seconds": time.process_time() - start}
    R = np.array([views[part[0]].R_cam_particle for part in rows])[list(merged.placed)]
    at = merged.joint.placements.R
    turned = [np.rad2deg(Rotation.from_matrix(at[i] @ at[j].T @ (R[i] @ R[j].T).T).magnitude()) for i in range(len(R)) for j in range(i)]
    return {
        "placed": len(merged.placed),
        "relative_rotation_deg": {"median": float(np.median(turned)), "largest": float(np.max(turned))},
        "right": bool(np.max(turned) <= (TRUE_BY_DEG if min(map(len, rows)) > 1 else RIGHT_DEG) and len(merged.placed) == len(rows)),
        "rms_ete_px": [round(float(r), 3) for r in merged.set_rms_px],
        "left_out": [vars(out) for out in merged.left_out],
        "seconds": time.process_time() - start,
    }


def known(data: Path) -> list[dict[str, Any]]:
    """Time of an estimate with a particle file over that without, and whether the numbers are the same."""
    rows = []
    for name, particle, seed in [*_particles(data)[:3], *_particles(data)[-3:-1]]:
        recipe = Recipe(seed=seed, particle=particle, sequences=2, same_particle=True)
        first, second = (build_silhouette_sequence(recipe, k)[0] for k in range(2))
        measure(first, Configuration())
        rows.append({"particle": name, "views": "outlines", **_second_time(first, second)})
        print(json.dumps(rows[-1]), flush=True)
    with TemporaryDirectory() as folder:
        name, particle, seed = _particles(data)[-3]
        recipe = Recipe(seed=seed, particle=particle, rig=RigRecipe(drops=DROPS, rendered=True))
        observation = read_observation(observation_folder(Path(folder), render_sequence(recipe, 0, Path(folder))))
        rows.append({"particle": name, "views": "pictures", **_second_time(observation, observation)})
        print(json.dumps(rows[-1]), flush=True)
    return rows


def _second_time(first: Observation, second: Observation) -> dict[str, Any]:
    """Seconds of the second sequence as it is and with what was kept of the first one's views."""
    outlines = view_outlines_of(first.view_recording, first.views).outlines
    shaped = shape([Drop("views", Path("views"), outlines, first.views, {}, posed=True)], "known", mass_kg=None)
    kept = replace(with_particle(second, shaped.particle), made=_InMemory(*shaped.made))
    seconds, found = {}, {}
    for how, observation in (("without", second), ("with", kept)):
        start = time.process_time()
        found[how] = measure(observation, Configuration())
        seconds[how] = time.process_time() - start
    middles = [found[how].middle for how in ("without", "with")]
    same = all(m is not None for m in middles) and all(
        np.array_equal(getattr(middles[0], part), getattr(middles[1], part)) for part in ("v_world", "omega_world", "covariance")
    )
    return {"seconds": seconds, "share": seconds["with"] / seconds["without"], "identical": bool(same)}


def pictures(data: Path) -> list[dict[str, Any]]:
    """The same particles in ten rendered drops each: from pictures and backgrounds in files, no outline given."""
    rows = []
    for name, particle, seed in _particles(data):
        recipe = Recipe(seed=seed, particle=particle, motion=MotionRecipe(frames=3), rig=RigRecipe(drops=DROPS, rendered=True))
        with TemporaryDirectory() as folder:
            out = Path(folder)
            sequence = render_sequence(recipe, 0, out / "dataset")
            observation = read_observation(observation_folder(out / "dataset", sequence))
            rig = _files_of_drops(observation, out)
            start = time.process_time()
            sets = sets_of([drop_of(path, rig[0], PicturesRead(backgrounds=rig[1])) for path in sorted(out.glob("drop*.tif"))])
            merged = merge(sets, MergeSettings())
            seconds = time.process_time() - start
        firsts = [next(v for v in observation.views if v.drop == k) for k in range(DROPS)]
        R, t = np.array([v.R_cam_particle for v in firsts]), np.array([v.t_cam_particle for v in firsts])
        found = against_truth(merged, R, t, np.zeros(3))
        out_of = [vars(o) for o in merged.left_out]
        rms = float(np.sqrt(np.mean(merged.set_rms_px**2)))
        rows.append({"particle": name, "placed": len(merged.placed), "left_out": out_of, **found, "rms_ete_px": rms, "seconds": seconds})
        print(json.dumps(rows[-1]), flush=True)
    return rows


def _files_of_drops(observation: Observation, out: Path) -> tuple[tuple[HsvCamera, ...], tuple[Path, ...]]:
    """A stack for each drop, a background for each camera; the rig in its first camera's frame, and the backgrounds' files."""
    frames = observation.view_recording
    assert isinstance(frames, Frames)
    for drop in range(DROPS):
        with FrameStackWriter(out / f"drop{drop:02d}.tif") as writer:
            for k in range(CAMERAS):
                writer.append(frames.read(CAMERAS * drop + k))
    backgrounds = [frames.background_of(k) for k in range(CAMERAS)]
    for k, background in enumerate(backgrounds):
        write_stack(out / f"background{k}.tif", [background])  # type: ignore[list-item]
    _, views = withheld((), observation.views[:CAMERAS])
    cameras = tuple(HsvCamera(f"c{k}", v.intrinsics, v.R_cam_particle, v.t_cam_particle) for k, v in enumerate(views))
    return cameras, tuple(out / f"background{k}.tif" for k in range(CAMERAS))


def velocities(data: Path) -> dict[str, Any]:
    """Errors of v and ω with merged views over those with the given ones, the same sequences."""
    rows = []
    for _, particle, seed in _particles(data):
        recipe = Recipe(seed=seed, particle=particle, sequences=FLIGHTS, same_particle=True)
        campaign = build_silhouette_campaign(recipe)
        views, outlines = campaign[0][0].views, list(campaign[0][0].view_recording)
        rows_of = [[i for i, v in enumerate(views) if v.drop == k] for k in range(DROPS)]
        sets = [
            view_set(f"drop{k}", *withheld([outlines[i] for i in part], [views[i] for i in part]))  # type: ignore[misc]
            for k, part in enumerate(rows_of)
        ]
        found = merge(sets, MergeSettings())
        for observation, truth in campaign:
            other = replace(observation, views=found.views, view_recording=found.outlines)
            given, merged = (score(measure(o, Configuration()), truth) for o in (observation, other))
            rows.append({"sequence": truth.name, "given": _errors(given), "merged": _errors(merged)})
            print(json.dumps(rows[-1]), flush=True)
    both = [r for r in rows if r["given"] and r["merged"]]
    ratio = {key: _rms([r["merged"][key] for r in both]) / _rms([r["given"][key] for r in both]) for key in KEYS}
    return {"sequences": rows, "rms_merged_over_given": ratio}


KEYS = ("middle_in_plane_ms", "middle_out_of_plane_ms", "middle_angular_rads")


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _errors(scored: Any) -> dict[str, float]:
    """Errors of v and ω; empty where there is no measurement."""
    return {key: float(scored[key]) for key in KEYS} if all(np.isfinite(scored.get(key, np.nan)) for key in KEYS) else {}


@dataclass(frozen=True)
class _InMemory:
    """What a particle file keeps, without the file."""

    of: str
    arrays: Any

    def load(self, of: str) -> Any:
        """See :class:`datasets.observation.Made`."""
        return self.arrays if of == self.of else None


PARTS: dict[str, Callable[[Path], Any]] = {
    **{"merging": merging, "pictures": pictures, "foreign": foreign, "volumes": volumes, "velocities": velocities},
    **{"real": real, "known": known},
}


def main() -> int:
    """The parts asked for, printed and written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"), help="folder with particles and silhouettes")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, with commas (default: %(default)s)")
    parser.add_argument("--result", type=Path, default=Path("out/study_shape.json"))
    arguments = parser.parse_args()
    arguments.result.parent.mkdir(parents=True, exist_ok=True)
    for name in arguments.only.split(","):
        found = PARTS[name](arguments.data)
        before = json.loads(arguments.result.read_text()) if arguments.result.exists() else {}
        arguments.result.write_text(json.dumps({**before, name: found}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
