"""Reads what instruments measured of the same datasets, and writes the page on which they stand beside one another."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2

from datasets.atomic_files import written_whole
from datasets.dataset_files import Dataset, read_dataset, truth_folder
from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate
from datasets.scoring.leaderboard import JUDGED, First, Leaderboard, Standing
from datasets.scoring.score import Row, score
from datasets.truth_files import read_truth
from tumble.reasons import listed
from tumble.result_files import estimate_path

PAGE = "leaderboard.md"
NUMBERS = "leaderboard.json"
NAMES = {"middle_in_plane_percent": "in-plane v", "middle_out_of_plane_percent": "depth v", "middle_angular_percent": "omega"}
MOST_LOST = 6


@dataclass(frozen=True)
class Cell:
    """A dataset, a cell of the table: its folder and what it says of itself."""

    folder: Path
    dataset: Dataset


def cells_of(folders: Sequence[Path]) -> tuple[Cell, ...]:
    """The datasets.

    Raises
    ------
    InputError
        Where one is none, or two have one name.
    """
    found: dict[str, Path] = {}
    for folder in folders:
        name = read_dataset(folder).name
        if name in found:
            raise InputError(f'{folder}: expected datasets of different names, got "{name}" of {found[name]} again.')
        found[name] = folder
    return tuple(Cell(folder, read_dataset(folder)) for folder in folders)


def instruments_of(words: Sequence[str]) -> dict[str, Path]:
    """Instruments as ``NAME=FOLDER``.

    Raises
    ------
    InputError
        Where a word is no such thing, a folder is missing, or a name comes twice.
    """
    found: dict[str, Path] = {}
    for word in words:
        name, equals, folder = word.partition("=")
        if not (name and equals and folder):
            raise InputError(f"--of: expected NAME=FOLDER, got {word!r}.")
        if name in found:
            raise InputError(f"--of: expected every name once, got {name!r} twice.")
        if not Path(folder).is_dir():
            raise InputError(f"{folder}: expected the folder of {name}'s estimates, got none.")
        found[name] = Path(folder)
    return found


def rows_of(cells: Sequence[Cell], instruments: Mapping[str, Path]) -> dict[str, dict[str, list[Row]]]:
    """For each cell and instrument a row of scores per sequence. What was not measured counts against the instrument.

    An estimate lies in ``FOLDER/<name of the dataset>/``; in ``FOLDER/`` where there is one dataset alone and no such folder, since
    sequences of different datasets have the same names.

    Raises
    ------
    InputError
        Where there are several datasets and no folder for one of them, though one for sequences of its names.
    """
    return {
        cell.dataset.name: {
            name: [_row(cell, sequence, _place(cell, folder, alone=len(cells) == 1)) for sequence in cell.dataset.sequences]
            for name, folder in instruments.items()
        }
        for cell in cells
    }


def write_leaderboard(told: Leaderboard, title: str, out: Path) -> None:
    """``leaderboard.json`` and the page."""
    with written_whole(out / NUMBERS) as temporary:
        temporary.write_text(json.dumps(_finite(told.entries()), indent=1) + "\n", encoding="utf-8")
    with written_whole(out / PAGE) as temporary:
        temporary.write_text(page(told, title), encoding="utf-8")


def page(told: Leaderboard, title: str, source: str = "") -> str:
    """The page, as Markdown; ``source``: a sentence that says where its figures are from."""
    loader = jinja2.PackageLoader("tumble.reports")
    environment = jinja2.Environment(loader=loader, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, autoescape=False)
    cells = list(dict.fromkeys(standing.cell for standing in told.standings))
    return environment.get_template("leaderboard.md.j2").render(
        title=title,
        source=source,
        names=[NAMES[entry.key] for entry in JUDGED],
        cells=[(cell, _lines(cell, told.standings)) for cell in cells],
        firsts=[first_in_words(first) for first in told.firsts],
    )


def first_in_words(first: First) -> str:
    """Who is first in a cell by one metric, by how much, and where not."""
    between = f" ({_factor(first.low)} to {_factor(first.high)})" if math.isfinite(first.high) else " (too few sequences for an interval)"
    factor = f"{first.first} by the median; errors of {first.second} are {_factor(first.ratio)} times as large{between}"
    said = f"{first.cell}, {NAMES[first.metric]}: {factor}" + ("" if first.decided else ", not decided")
    return f"{said}; {first.second} is nearer in {listed(first.lost, MOST_LOST)}" if first.lost else said


def _place(cell: Cell, folder: Path, *, alone: bool) -> Path:
    own = folder / cell.dataset.name
    if own.is_dir() or alone:
        return own if own.is_dir() else folder
    if any(estimate_path(folder, sequence).is_file() for sequence in cell.dataset.sequences):
        raise InputError(f"{folder}: expected a folder of estimates for each of several datasets, {own} for one, got estimates without.")
    return own


def _row(cell: Cell, sequence: str, folder: Path) -> Row:
    path = estimate_path(folder, sequence)
    truth = read_truth(truth_folder(cell.folder, sequence))
    estimate = Estimate(truth.name, Status.NO_CONVERGENCE, "no estimate") if not path.is_file() else read_estimate(path)
    return score(estimate, truth)


def _lines(cell: str, standings: Sequence[Standing]) -> list[list[str]]:
    """One line per instrument of a cell: name, measured, then each metric's median with interval and share inside."""
    here = [standing for standing in standings if standing.cell == cell]
    order = [standing.instrument for standing in here if standing.metric == here[0].metric]
    lines = []
    for name in order:
        mine = {standing.metric: standing for standing in here if standing.instrument == name}
        one = next(iter(mine.values()))
        figures = [_figure(mine[entry.key]) for entry in JUDGED]
        inside = [_share(mine[entry.key].inside_95) for entry in JUDGED]
        lines.append([name, f"{one.measured} of {one.n}", *figures, " / ".join(inside)])
    return lines


def _figure(standing: Standing) -> str:
    return f"{_percent(standing.median)} ({_percent(standing.low)} to {_percent(standing.high)})"


def _percent(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}" if math.isfinite(value) else "none"


def _factor(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}" if math.isfinite(value) else "infinitely many"


def _share(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.0%}"


def _finite(value: object) -> object:
    """The same with null for what is not finite."""
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
