"""What an earlier gate left in its folder: read as it is, once it is known to be of the same set."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from datasets.scoring.gate import CAMPAIGNS
from datasets.scoring.gate_measures import Row
from tumble.challenge.cases import TRUTH
from tumble.challenge.solving import answer_path
from tumble.differences import first_difference
from tumble.gate.running import ANSWERS, DATASET, ESTIMATES, Ran, rows_in
from tumble.gate.sets import GateSet
from tumble.output_directory import FINISHED
from tumble.result_files import estimate_path
from tumble.written_files import RUN_FILE, read_run


def read_earlier(gate_set: GateSet, folder: Path) -> Ran:
    """Rows of a set that was run in ``folder``; what is not finished, failed or has no estimate is told as failed.

    Raises
    ------
    InputError
        Where sequences or estimates are not there, or were made from something else than the set.
    """
    rows: dict[str, list[Row]] = {}
    failed: dict[str, str] = {}
    for kind, content in gate_set.content_by_kind().items():
        place = folder / kind
        made, measured = (place / TRUTH, place / ANSWERS) if kind == CAMPAIGNS else (place / DATASET, place / ESTIMATES)
        _refuse_other(made, _configuration(made), content)
        _refuse_other(measured, _configuration(measured).get("dataset", {}), content)
        rows[kind] = rows_in(kind, place)
        failed |= _lacking(kind, measured, rows[kind]) | _unfinished(kind, made) | _unfinished(kind, measured)
    return Ran(rows, failed, {})


def _configuration(folder: Path) -> Mapping[str, Any]:
    run = read_run(folder)
    if run is None:
        raise InputError(f"{folder / RUN_FILE}: expected what an earlier gate wrote about its run, got none.")
    return dict(run["configuration"])


def _refuse_other(folder: Path, found: Mapping[str, Any], content: Mapping[str, Any]) -> None:
    came_from = {key: value for key, value in found.items() if key != "made_by"}
    if different := first_difference(
        came_from, json.loads(json.dumps(content)), words="{name} was {found!r} there and is {wanted!r} in the set"
    ):
        raise InputError(f"{folder / RUN_FILE}: expected a run of the set, but {different}. Other sequences cannot be compared.")


def _unfinished(kind: str, folder: Path) -> dict[str, str]:
    run = read_run(folder) or {}
    failed = {f"{kind}/{failure['item']}": str(failure["reason"]) for failure in run["failures"]}
    unfinished = not failed and run["state"] != FINISHED
    return failed | ({f"{kind}/{folder.name}": f"expected a finished run, got one that is {run['state']}"} if unfinished else {})


def _lacking(kind: str, folder: Path, rows: list[Row]) -> dict[str, str]:
    path = answer_path if kind == CAMPAIGNS else estimate_path
    names = [str(row["sequence"]) for row in rows]
    return {f"{kind}/{name}": f"expected {path(folder, name)}, got no such file" for name in names if not path(folder, name).is_file()}
