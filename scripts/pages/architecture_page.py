"""Writes docs/architecture.md: the way of a picture to a number, and the rooms that it goes through, read off the source.

``python -m scripts.pages.architecture_page``. The order of the steps is written here, by the names of functions that can be reached from
:func:`estimator.measure.measure`; where each lies, what it does and returns is read off the source.
"""

import ast
import tomllib
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

from datasets.atomic_files import written_whole
from scripts.pages.source_reading import ESTIMATOR, ROOT, first_sentence, function, modules, reached_from, room_of, rooms_imported, tree

PAGE = ROOT / "docs" / "architecture.md"
ENTRY = "estimator.measure.measure"
SEEN = ("tracks_of", "observed_particle", "nominations")
FREE = (
    "estimate_free_flight",
    "usable_sightings",
    "views_like",
    "fit_task",
    "aligned",
    "first_pose",
    "candidate_flights",
    "standing",
    "biased_task",
    "refined_flight",
    "judge",
    "converged_estimate",
)
IMPACTS = (
    "estimate_with_impacts",
    "fitted_chains",
    "refined_chain",
    "separated_contacts",
    "judge_chain",
    "impacts_estimate",
)
PAIR = "measure_pair"
INSIDE = (
    "extract_outlines",
    "particle_of",
    "search_pose",
    "track",
    "fit_growing",
    "poses_and_sensitivity",
    "frames_and_sensitivity",
    "tangency_errors",
    "with_predicted_bias",
    "solve",
    "measured_noise",
    "stepped",
    "sandwich",
    "calibration_share",
)
DOORS = (
    ("`estimate`", ENTRY),
    ("`compare`, `diagnose`, `explain`, `ladder` of pictures", "estimator.measurements.silhouettes.registration.register"),
    ("the same of trajectories", "estimator.measurements.trajectories.registering.register_trajectories"),
    ("`explain`, once registered", "estimator.diagnosis.explain.explain"),
    ("`validate-contact`", "estimator.contact_validation.validate.validate"),
    ("`shape`", "estimator.merging.merge.merge"),
    ("`calibrate camera`, `calibrate rig`", "estimator.calibration.fitting.fit_rig"),
    ("`check`", "estimator.readiness.inspection.inspect_recording"),
)
ROUNDED = 100
"""Lines are rounded to so many: the page is not out of date with every edit."""

TEXT = """\
# How a picture becomes a number

Written by `python -m scripts.pages.architecture_page` from the source; a test says when it is out of date. To read the code, begin with
[`estimator/measure.py`](../estimator/measure.py) and follow the names below. Why rooms lie in this order:
[decision 54](decisions/0054-rooms.md); what binds besides: [decisions](decisions/README.md).

```mermaid
flowchart TD
{way}
```

| step | hands on | what it does |
| --- | --- | --- |
{steps}

A free flight and flights with impacts are of the same steps: outlines become sightings, tangency errors of all pairs of sightings
and views are the residuals, Gauss-Newton steps end at a flight, and a sandwich covariance says how sure it is
([decision 60](decisions/0060-what-tangents-lose.md)). They are problems of one solver, with a pair of particles that collide and with a
focal length that is not known ([decision 65](decisions/0065-blocks-and-one-solver.md)). Every step that cannot go on ends with a status
and a sentence, never with a number.

Inside of these steps:

| function | returns | what it does |
| --- | --- | --- |
{inside}

## Other doors

| command | begins with | |
| --- | --- | --- |
{doors}

## The rooms of the estimator

Imports run downwards only; the highest room is first. Arrows that follow from others are left out of the drawing.

```mermaid
flowchart TD
{arrows}
```

| room | is | files | lines, about | imports |
| --- | --- | --- | --- | --- |
{rooms}
"""


def page() -> str:
    """The page as the source has it now."""
    return TEXT.format(
        way="\n".join(_way()),
        steps="\n".join(_step(key) for key in (*SEEN, *FREE, *IMPACTS, PAIR)),
        inside="\n".join(_step(key) for key in INSIDE),
        doors="\n".join(f"| {said} | {_link(name)} | {first_sentence(function(name))} |" for said, name in DOORS),
        arrows="\n".join(f"    {room} --> {other}" for room, other in arrows()),
        rooms="\n".join(_room(room) for room in order()),
    )


def structure(text: str) -> str:
    """A page without the columns that change with every edit, files and lines of the rooms."""
    head, _, table = text.rpartition("| --- | --- | --- | --- | --- |\n")
    return head + "\n".join("|".join(row.split("|")[:3] + row.split("|")[5:]) for row in table.splitlines())


@cache
def order() -> tuple[str, ...]:
    """The rooms, the highest first, as the import contract has them."""
    linter = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    (layers,) = (c["layers"] for c in linter["contracts"] if c.get("containers") == ["estimator"])
    return tuple(str(layer) for layer in layers)


def arrows() -> list[tuple[str, str]]:
    """Imports between rooms that do not follow from others (transitive reduction)."""
    imports, rooms = rooms_imported(), order()
    below: dict[str, set[str]] = {}
    for room in reversed(rooms):
        below[room] = set().union(imports[room], *(below[other] for other in imports[room]))
    return [
        (room, other)
        for room in rooms
        for other in sorted(imports[room], key=rooms.index)
        if not any(other in below[between] for between in imports[room])
    ]


def _way() -> list[str]:
    """The drawing of the way, from both kinds of pictures to the estimate."""
    lines = ['    pictures(["pictures of the flight"]) --> tracks_of', '    views(["calibrated views"]) --> observed_particle']
    lines += [f'    {key}["{key}<br/>{_returned(place_of(key)).strip("`")}"]' for key in (*SEEN, *FREE, *IMPACTS)]
    lines += ["    tracks_of --> nominations", "    observed_particle --> nominations"]
    for way, why in ((FREE, "no kink"), (IMPACTS, "kinks")):
        lines.append(f"    nominations -- {why} --> {way[0]}")
        lines += [f"    {a} --> {b}" for a, b in pairwise(way)]
        lines.append(f'    {way[-1]} --> estimate(["Estimate"])')
    lines.append(f"    {IMPACTS[0]} -. no jump of the velocities .-> {FREE[0]}")
    return lines


def _step(key: str) -> str:
    name = place_of(key)
    return f"| {_link(name)} | {_returned(name)} | {first_sentence(function(name))} |"


@cache
def place_of(key: str) -> str:
    """The dotted name of a step: the one function of its name that can be reached from the entry."""
    found = [name for name in reached_from(ENTRY) if name.rpartition(".")[2] == key]
    if len(found) != 1:
        raise ValueError(f"expected one function {key} on the way from {ENTRY}, got {found}")
    return found[0]


def _link(name: str) -> str:
    module, _, key = name.rpartition(".")
    return f"[`{key}`](../{module.replace('.', '/')}.py)"


def _returned(name: str) -> str:
    returns = function(name).returns
    return "" if returns is None else f"`{ast.unparse(returns)}`".replace("|", "or")


def _room(room: str) -> str:
    inside = [path for path in modules() if room_of(path) == room and path.parent != ESTIMATOR] or [ESTIMATOR / f"{room}.py"]
    counted = [path for path in inside if path.name != "__init__.py"]
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in inside)
    imports = ", ".join(sorted(rooms_imported()[room], key=order().index)) or "nothing"
    return f"| `{room}` | {first_sentence(tree(_door(room)))} | {len(counted)} | {round(lines / ROUNDED) * ROUNDED} | {imports} |"


def _door(room: str) -> Path:
    folder = ESTIMATOR / room
    return folder / "__init__.py" if folder.is_dir() else ESTIMATOR / f"{room}.py"


def steps() -> Sequence[str]:
    """The dotted names of all steps, and of what is inside of them."""
    return tuple(place_of(key) for key in (*SEEN, *FREE, *IMPACTS, PAIR, *INSIDE))


def main() -> None:
    """Write the page."""
    with written_whole(PAGE) as path:
        path.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
