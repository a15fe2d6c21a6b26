"""Tumble beside other ways to measure the same sequences: makes docs/rivals/leaderboard.md anew.

``python -m scripts.trials.study_rivals --out FOLDER --count 4 --seed N [--particles FOLDER]``. Every cell is a dataset of ``count``
sequences, made and measured once in the folder and kept there; a killed run goes on where it was. With scanned particles there is a cell of
them. ``--page FILE.md``: where the page goes, too; figures are in OUT/leaderboard.
"""

import argparse
import os
import secrets
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from datasets.atomic_files import written_whole
from datasets.errors import InputError, TumbleError
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RenderingRecipe, RigRecipe
from datasets.recipes.toml_files import recipe_to_toml
from datasets.scoring.leaderboard import leaderboard
from rivals import centroids, epipolar_tangency, pose_by_pose, silhouette_iou
from rivals.joining import joined
from studies.flights.bodies import IRREGULAR, REGULAR
from tumble.cli.exit_codes import INCOMPLETE
from tumble.cli.leaderboard import BOOTSTRAP_SEED
from tumble.cli.main import main as tumble
from tumble.leaderboard import cells_of, instruments_of, page, rows_of, write_leaderboard
from tumble.one_thread import keep_to_one_thread

RIVALS = {
    "centroids": centroids.measure,
    "pose_by_pose": pose_by_pose.measure,
    "silhouette_iou": silhouette_iou.measure,
    "epipolar_tangency": epipolar_tangency.measure,
}
OURS = "tumble"
COARSE = RenderingRecipe(subframes=8, samples_per_subframe=1, rig_samples=4)


def recipes(count: int, seed: int, particles: Path | None) -> dict[str, Recipe]:
    """The cells: silhouettes of 100 frames and 60 views unless their name says otherwise."""
    base = Recipe(seed=seed, sequences=count, motion=MotionRecipe(frames=100), particle=ParticleRecipe(family="cut_stone"))
    cells = {
        "cut_stones": base,
        "jagged_stones": replace(base, particle=ParticleRecipe(family="jagged")),
        "twelve_views": replace(base, rig=RigRecipe(drops=2)),
        "thirty_frames": replace(base, motion=MotionRecipe(frames=30)),
        "pictures": replace(base, tier="rendered", motion=MotionRecipe(frames=60), rig=RigRecipe(drops=5), rendering=COARSE),
    }
    if particles is not None:
        files = tuple(str(particles / f"{name}.ply") for pair in zip(REGULAR, IRREGULAR, strict=True) for name in pair)
        cells["scanned"] = replace(base, particle=ParticleRecipe(files=files))
    return {name: replace(recipe, name=name) for name, recipe in cells.items()}


def main(arguments: list[str] | None = None) -> int:
    """Make, measure, rank, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, default=4, help="sequences of a cell (default: 4)")
    parser.add_argument("--seed", type=int, help="default: drawn anew, and printed")
    parser.add_argument("--particles", type=Path, help="folder of scanned particles")
    parser.add_argument("--cells", default="", help="comma-separated names of cells (default: all)")
    parser.add_argument("--page", type=Path, help="where the page goes, beside OUT/leaderboard")
    given = parser.parse_args(arguments)
    kept = given.out / "seed"
    before = int(kept.read_text(encoding="utf-8")) if kept.is_file() else None
    seed = given.seed if given.seed is not None else before if before is not None else secrets.randbelow(2**31)
    if before not in (None, seed):
        raise InputError(f"{kept}: expected the seed {seed}, got {before}. Choose another --out.")
    given.out.mkdir(parents=True, exist_ok=True)
    kept.write_text(f"{seed}\n", encoding="utf-8")
    print(f"seed {seed}", flush=True)
    cells = recipes(given.count, seed, given.particles)
    chosen = [name for name in cells if not given.cells or name in given.cells.split(",")]
    for name in chosen:
        _measure(cells[name], given.out)
    datasets = [given.out / "datasets" / name for name in chosen]
    instruments = instruments_of([f"{name}={given.out / 'estimates' / name}" for name in (OURS, *RIVALS)])
    told = leaderboard(rows_of(cells_of(datasets), instruments), np.random.default_rng(BOOTSTRAP_SEED))
    title = f"Leaderboard: {given.count} sequences a cell"
    (given.out / "leaderboard").mkdir(exist_ok=True)
    write_leaderboard(told, title, given.out / "leaderboard")
    print(page(told, title))
    if given.page is not None:
        again = f"python -m scripts.trials.study_rivals --out FOLDER --count {given.count} --seed {seed}"
        again += (" --particles FOLDER" if given.particles else "") + (f" --cells {given.cells}" if given.cells else "")
        with written_whole(given.page) as temporary:
            temporary.write_text(page(told, title, f"Printed by `{again}`."), encoding="utf-8")
    return 0


def _measure(recipe: Recipe, out: Path) -> None:
    """The dataset of a cell and every instrument's estimates of it; what is there stays."""
    dataset, config = out / "datasets" / recipe.name, out / f"{recipe.name}.toml"
    out.mkdir(parents=True, exist_ok=True)
    config.write_text(recipe_to_toml(recipe), encoding="utf-8")
    ended = {"render": tumble(["render", "--config", str(config), "--out", str(dataset), "--jobs", "1", "--resume", "-q"])}
    ours = out / "estimates" / OURS / recipe.name
    code = tumble(["estimate", str(dataset), "--out", str(ours), "--jobs", "1", "--resume", "-q"])
    ended["estimate"] = 0 if code == INCOMPLETE else code
    for name, measure in RIVALS.items():
        ended[name] = joined(name, measure, [str(dataset), "--out", str(out / "estimates" / name / recipe.name)])
    if bad := [name for name, code in ended.items() if code > 0]:
        raise TumbleError(f"{dataset}: {', '.join(bad)} could not be run, as told above.")


if __name__ == "__main__":
    keep_to_one_thread(os.environ)
    sys.exit(main())
