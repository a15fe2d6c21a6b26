"""The engine's ways to run beside one another: whether results are the same, what an item costs, memory, and what a second worker brings.

``python -m scripts.benchmarks.bench_engine --out out/bench_engine [--sequences 6] [--items 5000] [--result FILE.json]``. Sequences are made
once and estimated in this process, in two local processes, and on Dask schedulers with one, two and four workers: every estimate and done
mark is compared byte by byte. The overhead is wall time per item of a task that writes one line. Memory is that of this process, in which
the scheduler of a local cluster runs, too, and of the workers, after a tenth of the items and after all.
"""

import argparse
import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import psutil

from datasets.atomic_files import written_whole
from datasets.recipes.recipe import MotionRecipe, Recipe, RigRecipe
from tumble.engine import Executor, Item, Processes, Scheduler, Serial, failures, run
from tumble.engine.cluster import ClusterPlan, started
from tumble.estimating import estimate_all
from tumble.one_thread import keep_to_one_thread
from tumble.rendering import render_dataset

WAYS = ("serial", "2 processes", "dask 1", "dask 2", "dask 4")
SEED = 35


@contextmanager
def executor_for(way: str, folder: Path) -> Iterator[Executor]:
    """The executor of a way to run; a scheduler lives as long as it."""
    if not way.startswith("dask"):
        yield Serial() if way == "serial" else Processes(2)
        return
    place = folder / "scheduler.json"
    with started(ClusterPlan("local", int(way.split()[1])), place):
        yield Scheduler(str(place))


def estimated(dataset: Path, out: Path, way: str) -> dict[str, Any]:
    """Estimate all sequences of a dataset; wall time (s), in which every worker imports its libraries once."""
    out.mkdir(parents=True, exist_ok=True)
    with executor_for(way, out.parent) as executor:
        began = time.perf_counter()
        outcomes = estimate_all(dataset, {}, out, executor=executor, quiet=True)
    return {"way": way, "wall_s": time.perf_counter() - began, "failed": len(failures(outcomes))}


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def trivial(payload: dict[str, Any]) -> dict[str, Any]:
    """Write one line."""
    with written_whole(Path(payload["product"])) as path:
        path.write_text("done\n", encoding="utf-8")
    return {}


def rest(payload: dict[str, Any]) -> dict[str, Any]:
    """Take a fifth of a second and no processor, so that the load of the machine does not matter."""
    time.sleep(0.2)
    return trivial(payload)


def rested(out: Path, way: str) -> float:
    """Wall time (s) of 40 items that take no processor."""
    out.mkdir(parents=True, exist_ok=True)
    folder = out / way.replace(" ", "_")
    items = [Item(f"{k:02d}", {"product": folder / f"{k:02d}"}, folder / f"{k:02d}") for k in range(40)]
    with executor_for(way, out) as executor:
        run(trivial, [Item("first", {"product": folder / "first"}, folder / "first")], executor=executor, advance=lambda _: None)
        began = time.perf_counter()
        run(rest, items, executor=executor, advance=lambda _: None)
        return time.perf_counter() - began


def overhead(out: Path, way: str, count: int) -> dict[str, Any]:
    """Wall time per item (ms) and memory (MB) of ``count`` trivial items."""
    out.mkdir(parents=True, exist_ok=True)
    folder, memory, done = out / way.replace(" ", "_"), [], [0]
    items = [Item(f"{k:05d}", {"product": folder / f"{k:05d}"}, folder / f"{k:05d}") for k in range(count)]

    def advance(_name: str) -> None:
        done[0] += 1
        if done[0] in {count // 10, count}:
            memory.append(_memory_mb())

    with executor_for(way, out) as executor:
        began = time.perf_counter()
        lost = failures(run(trivial, items, executor=executor, advance=advance))
        took = time.perf_counter() - began
    return {"way": way, "items": count, "failed": len(lost), "ms_each": 1e3 * took / count, "memory_mb": memory}


def _memory_mb() -> dict[str, float]:
    here = psutil.Process()
    workers = [child.memory_info().rss for child in here.children(recursive=True)]
    return {"here": round(here.memory_info().rss / 2**20, 1), "workers": round(sum(workers) / 2**20, 1)}


def main() -> int:
    """Run all parts and print a line each; 1 where results differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/bench_engine"), help="an empty folder")
    parser.add_argument("--sequences", type=int, default=6)
    parser.add_argument("--items", type=int, default=5000)
    parser.add_argument("--result", type=Path, help="where to write the figures as JSON")
    arguments = parser.parse_args()
    keep_to_one_thread(os.environ)
    arguments.out.mkdir(parents=True, exist_ok=True)
    recipe = Recipe(seed=SEED, sequences=arguments.sequences, motion=MotionRecipe(frames=30), rig=RigRecipe(drops=3))
    render_dataset(recipe, arguments.out / "dataset", executor=Serial(), quiet=True)
    runs = [told(estimated(arguments.out / "dataset", arguments.out / way.replace(" ", "_") / "estimates", way)) for way in WAYS]
    found = [contents(arguments.out / way.replace(" ", "_") / "estimates") for way in WAYS]
    same = {way: each == found[0] for way, each in zip(WAYS, found, strict=True)}
    told({"files": len(found[0]), "identical": same})
    costs = [told(overhead(arguments.out / "trivial", way, arguments.items)) for way in ("2 processes", "dask 2")]
    walls = {run["way"]: run["wall_s"] for run in runs}
    idle = rested(arguments.out / "rest", "dask 1") / rested(arguments.out / "rest", "dask 2")
    speed = told(
        {
            "two_over_one": walls["dask 1"] / walls["dask 2"],
            "two_over_one_without_processor": idle,
            "load": os.getloadavg()[0],
            "cores": os.cpu_count(),
        }
    )
    if arguments.result:
        with written_whole(arguments.result) as path:
            path.write_text(json.dumps({"estimates": runs, "identical": same, "overhead": costs, "speed": speed}, indent=1) + "\n")
    return 0 if all(same.values()) else 1


def told(figures: dict[str, Any]) -> dict[str, Any]:
    """Print figures as one line and hand them on."""
    print(json.dumps(figures), flush=True)
    return figures


if __name__ == "__main__":
    raise SystemExit(main())
