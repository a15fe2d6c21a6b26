"""Runs a plan on the engine: cases that are there stay, all others are measured, rows become the result.

A case's rows are kept in ``OUT/CODE/NAME.json``, ``CODE`` being the digest of the plan's files, of what these use of the libraries and
of versions: changed code never shows old numbers. ``OUT/study.json`` holds the settings; other ones are refused, since rows of two kinds
read like those of one.
"""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from studies.frame.digests import of_bytes, of_libraries, of_modules
from studies.frame.results import Result
from studies.frame.study import Plan, Row, Settings, Study
from tumble.differences import first_difference
from tumble.engine import Executor, Item, failures, run
from tumble.progress import progress
from tumble.versions import versions

SOFTWARE = ("python", "numpy", "scipy", "numba", "scikit-image", "shapely", "mitsuba", "tumble")
"""Whose versions a result states: not the machine, whose figures are the same."""


@dataclass(frozen=True)
class Conduct:
    """How a study is run: by whom, where cases are kept, at which size, and the folder of scanned particles (``None``: own bodies)."""

    executor: Executor
    out: Path
    size: str = "full"
    particles: Path | None = None
    quiet: bool = False


@dataclass(frozen=True)
class Kept:
    """A task whose rows are written to the payload's ``product``."""

    task: Callable[[dict[str, Any]], list[Row]]

    def __call__(self, payload: dict[str, Any]) -> dict[str, Any]:
        """Work on one case."""
        began = time.process_time()
        rows = [{key: _plain(value) for key, value in row.items()} for row in self.task(payload["case"])]
        document = {"rows": rows, "cpu_s": time.process_time() - began}
        with written_whole(Path(payload["product"])) as path:
            path.write_text(json.dumps(document), encoding="utf-8")
        return {}


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def conduct(study: Study, settings: Settings, how: Conduct) -> Result:
    """Measure what is missing; the result of all cases.

    Raises
    ------
    InputError
        Where ``how.out`` holds cases of other settings; the message says which.
    """
    plan: Plan[Any] = study.plan
    asked = {"size": how.size, **asdict(settings), "bodies": bodies_word(how.particles)}
    cases, found = plan.cases(settings, how.particles), versions()
    software = {key: found[key] for key in SOFTWARE}
    _hold_to_settings(how.out, study.name, asked, of_bodies(how.particles))
    sources, code = of_modules(plan.modules), of_libraries(plan.modules)
    folder = how.out / of_bytes(json.dumps([sources, code, software]).encode())
    products = [folder / f"{case.name}.json" for case in cases]
    pairs = list(zip(cases, products, strict=True))
    items = [Item(case.name, {"case": dict(case.payload), "product": product}, product) for case, product in pairs]
    with progress(study.name, len(items), quiet=how.quiet) as advance:
        outcomes = run(Kept(plan.task), items, executor=how.executor, advance=advance)
    rows = [{**case.labels, **row} for case, product in pairs if product.is_file() for row in _rows(product)]
    failed = tuple(f"{outcome.name}: {outcome.message}" for outcome in failures(outcomes))
    return Result(study.name, asked, sources, code, software, failed, pd.DataFrame(rows))


def _rows(product: Path) -> Sequence[Row]:
    document = json.loads(product.read_text(encoding="utf-8"))
    return [{**row, "cpu_s": document["cpu_s"] / len(document["rows"])} for row in document["rows"]]


def bodies_word(particles: Path | None) -> str:
    """Of which kind bodies are, from the folder of scanned ones."""
    return "scanned" if particles else "procedural"


def of_bodies(particles: Path | None) -> dict[str, str]:
    """Digests of the scanned bodies in a folder, by file name."""
    return {} if particles is None else {path.name: of_bytes(path.read_bytes()) for path in sorted(particles.glob("*.ply"))}


def _hold_to_settings(out: Path, study: str, asked: dict[str, Any], bodies: dict[str, str]) -> None:
    """Refuse a folder with another study, other settings or other bodies; more repetitions are none."""
    wanted = {"study": study, "settings": {key: value for key, value in asked.items() if key != "count"}, "bodies": bodies}
    wanted = json.loads(json.dumps(wanted))
    path = out / "study.json"
    if path.is_file():
        try:
            there = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise InputError(f"{path}: expected the settings of a study, got no JSON ({error}). Choose another --out.") from error
        different = first_difference(there, wanted)
        if different:
            raise InputError(f"{path}: expected the same settings to go on with, but {different}. Choose another --out.")
    with written_whole(path) as temporary:
        temporary.write_text(json.dumps(wanted) + "\n", encoding="utf-8")
