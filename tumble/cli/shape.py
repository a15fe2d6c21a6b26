"""``tumble shape``: a particle's shape from drops of calibrated silhouettes, its orientation between them unknown."""

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from datasets.errors import InputError
from datasets.made_files import PARTICLE_FILE
from datasets.mesh_files import write_mesh
from datasets.names import file_name
from datasets.particle_files import ParticleFile, read_particle, write_particle
from datasets.plausibility import HEAVIEST_KG
from tumble.cli.console import console
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.options import add_output, verb_parser
from tumble.cli.outcomes import what_next
from tumble.commands import command
from tumble.numbers import with_sigma
from tumble.output_directory import Run, output_directory
from tumble.progress import progress
from tumble.shaping.drops import Drop, Pictures, calibrated_drop, drop_of, is_calibrated, named_apart, rig_of
from tumble.shaping.shaping import shape

SURFACE = "surface.ply"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "shape",
        description="Merge drops of a particle in a rig of cameras into one set of calibrated views. A DROP is what the cameras saw at\n"
        "one instant: a folder with a picture (or, with --masks, a mask) of each camera, in the rig's order or named as its cameras, a\n"
        "stack, outlines (.npz), or a particle, observation or dataset with views. How the particle lies in each drop is found.\n"
        "The folder written is a particle file: tumble import and tumble estimate take it as --particle.\n"
        "Exit code 1: a drop or view was left out (it is named, with the reason), or the views contradict one another.",
        example="tumble shape drops/1 drops/2 drops/3 --rig out/rig --masks --out out/stone",
    )
    verb.add_argument("drops", type=Path, nargs="+", metavar="DROP", help="views of one instant")
    verb.add_argument(
        "--rig",
        type=Path,
        action="append",
        default=[],
        metavar="RIG",
        help="the cameras, as tumble calibrate rig writes them; one for all drops, or one for each",
    )
    verb.add_argument("--masks", action="store_true", help="the pictures are masks: bright where the particle is")
    verb.add_argument(
        "--background",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="a picture without the particle, one for each camera of the rig (default: the light in each picture itself)",
    )
    verb.add_argument("--mass", type=float, metavar="KG", help="of the particle, where it was weighed")
    add_output(verb, default="out/stone")
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Merge; exit code 1 where something was left out, or the views contradict one another."""
    _check(arguments)
    content = {
        "drops": [str(path.resolve()) for path in arguments.drops],
        "rig": [str(path.resolve()) for path in arguments.rig],
        "masks": arguments.masks,
        "background": [str(path.resolve()) for path in arguments.background],
        "mass_kg": arguments.mass,
    }
    reads = (*arguments.drops, *arguments.rig, *arguments.background)
    with output_directory(arguments.out, Run("shape", content, reads=reads), resume=arguments.resume, force=arguments.force) as out:
        if not (out / PARTICLE_FILE).is_file():
            _make(_drops(arguments), out, arguments)
    return _say(read_particle(arguments.out), arguments)


def _check(arguments: argparse.Namespace) -> None:
    if arguments.mass is not None and not 0 < arguments.mass < HEAVIEST_KG:
        raise InputError(f"--mass {arguments.mass:g}: expected kilograms, above 0 and below {HEAVIEST_KG:g}, got another value.")
    if arguments.masks and arguments.background:
        raise InputError(f"{arguments.background[0]}: expected no --background with --masks, which need none, got one.")
    count = sum(not is_calibrated(path) for path in arguments.drops)
    if count and len(arguments.rig) not in (1, count):
        raise InputError(
            f"{arguments.drops[0]}: expected --rig RIG once, or once for each of the {count} drops that are not calibrated, "
            f"got it {len(arguments.rig)} times."
        )
    if not count and arguments.rig:
        raise InputError(f"{arguments.rig[0]}: expected no --rig where all drops are calibrated already, got one.")


def _drops(arguments: argparse.Namespace) -> list[Drop]:
    rigs = [rig_of(path) for path in arguments.rig]
    rest = iter(rigs if len(rigs) > 1 else rigs * len(arguments.drops))
    found = []
    for path in arguments.drops:
        if is_calibrated(path):
            found.append(calibrated_drop(path))
            continue
        rig = next(rest)
        if arguments.background and len(arguments.background) != len(rig):
            raise InputError(f"{path}: expected --background for each of the {len(rig)} cameras, got it {len(arguments.background)} times.")
        found.append(drop_of(path, rig, Pictures(arguments.masks, tuple(arguments.background))))
    return named_apart(found)


def _make(drops: Sequence[Drop], out: Path, arguments: argparse.Namespace) -> None:
    """The surface first: ``particle.json`` says that all is there."""
    pairs = len(drops) * (len(drops) - 1) // 2
    with progress("shape", pairs, quiet=arguments.quiet or arguments.json) as advance:
        name = file_name(arguments.out.resolve().name)
        shaped = shape(drops, name, mass_kg=arguments.mass, advance=lambda: advance("pair"))
    write_mesh(out / SURFACE, shaped.surface.vertices, shaped.surface.faces)
    write_particle(shaped.particle, out, shaped.made)


def _say(particle: ParticleFile, arguments: argparse.Namespace) -> int:
    contradict = particle.checks.get("views_contradict", False)
    if arguments.json:
        print((arguments.out / PARTICLE_FILE).read_text(encoding="utf-8"), end="")
    elif not arguments.quiet:
        _tables(particle)
        for note in particle.notes:
            console().print(note, soft_wrap=True)
        following = command("import", "VIDEO", "--particle", arguments.out)
        console().print(what_next(None if contradict else following), soft_wrap=True)
    return INCOMPLETE if contradict or any("left out" in note for note in particle.notes) else ALL_MEASURED


def _tables(particle: ParticleFile) -> None:
    if particle.merging is not None:
        again = {entry["name"]: entry for entry in particle.checks["sets_placed_by_the_others"]}
        table = Table(title="drops", title_justify="left", box=None, pad_edge=False)
        for heading in ("drop", "views", "RMS ETE (px)", "loops closed", "placed again by the others"):
            table.add_column(heading)
        for entry in particle.merging["sets"]:
            table.add_row(*_drop_cells(entry, again.get(entry["name"])))
        console().print(table)
    out = len(particle.checks.get("views_left_out", ()))
    views = f"{len(particle.views) - out} of {len(particle.views)} views" if out else f"{len(particle.views)} views"
    table = Table(title=f"particle {particle.name}: {views}", title_justify="left", box=None, pad_edge=False)
    for heading in ("figure", "value"):
        table.add_column(heading)
    for row in shape_rows(particle):
        table.add_row(*row)
    console().print(table)


def _drop_cells(entry: dict, again: dict | None) -> tuple[str, ...]:  # type: ignore[type-arg]
    apart = "–" if again is None else again["fault"] or f"{again['turned_deg']:.2f}°, {again['moved_m'] * 1e6:.1f} µm off"
    return entry["name"], str(entry["views"]), f"{entry['rms_ete_px']:.3f}", str(entry["loops"]), apart


def shape_rows(particle: ParticleFile) -> list[tuple[str, str]]:
    """Volume, centre, inertia and checks as text; of views that contradict one another only the checks."""
    shape_, checks = particle.shape, particle.checks
    centre = ", ".join(with_sigma(value * 1e3, shape_["com_sigma_m"] * 1e3) for value in shape_["com_particle"])
    ratios = " : ".join([*(with_sigma(value, shape_["inertia_ratios_sigma"]) for value in shape_["inertia_ratios"][:2]), "1"])
    figures = [
        ("volume", f"{with_sigma(shape_['volume_m3'] * 1e9, shape_['volume_sigma_m3'] * 1e9)} mm³"),
        ("hull larger than the body by", _excess_words(shape_)),
        ("centre of mass", f"({centre}) mm, particle frame"),
        ("principal moments", ratios),
        ("largest extent", f"{shape_['extent_m'] * 1e3:.3f} mm"),
    ]
    rows = [
        *([("volume", "not measured")] if checks.get("views_contradict", False) else figures),
        ("largest gap between viewing directions", f"{checks['largest_gap_deg']:.0f}°"),
    ]
    predicted = checks["views_predicted_from_the_others"]
    if predicted is not None:
        rows.append(("outlines predicted from the other views", f"reach out by {max(predicted['outside_px']):.2f} px at most"))
    return rows


def _excess_words(shape_: Mapping[str, Any]) -> str:
    """The hull's excess of volume, or that too few views leave it unknown (the volume is then the hull's own)."""
    if not math.isfinite(shape_["volume_sigma_m3"]):
        return "unknown: too few views to compare halves of them"
    too_much = shape_["hull_volume_excess"]
    return f"{too_much / (1.0 - too_much):.1%} (taken off)" if too_much < 1.0 else "more than its volume (taken off)"
