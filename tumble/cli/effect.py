"""``tumble effect``: the catalogue of effects, effects of one's own begun, and whether one keeps the contracts."""

import argparse
import dataclasses
import json
from pathlib import Path

from rich.table import Table

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.vocabulary.effects import EFFECTS
from estimator.appearance.effect_contracts import Kept
from tumble.cli.console import console
from tumble.cli.options import verb_parser
from tumble.commands import command
from tumble.effect_checking import LIMIT_S, check_effect
from tumble.effect_pages import COMMAND, catalogue_page
from tumble.effect_writing import KINDS, effect_key, plug_in_text, write_plug_in
from tumble.written_files import refuse_other_file


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "effect",
        description="list: the catalogue of effects with their parameters (--write FILE.md: as a page of the documentation).\n"
        "check: whether an effect, of the catalogue or your own (FILE.py:CLASS), keeps the contracts: zero is no effect,\n"
        "derivatives agree with finite differences over the whole chain, numbers are finite, it comes to an end. Exit code 2: no effect.\n"
        "new: a plug-in file with a class of that name, ready to run: with the law that a diagnosis proposes (--from diagnosis.json),\n"
        "or a minimal one to edit (--kind).",
        example="tumble effect check ./my_wind.py:Wind",
    )
    verb.add_argument("action", choices=("list", "check", "new"), help="what to do")
    verb.add_argument(
        "effect", nargs="?", default="", metavar="EFFECT", help="for check: a key of the catalogue, or FILE.py:CLASS; for new: CLASS"
    )
    verb.add_argument("--on", type=Path, metavar="OBSERVATIONS", help="for check: a dataset or observation (default: a short made-up one)")
    verb.add_argument(
        "--limit", type=float, default=LIMIT_S, metavar="S", help="for check: seconds that a plug-in may take (default: %(default)g)"
    )
    verb.add_argument("--from", dest="source", type=Path, metavar="DIAGNOSIS", help="for new: the diagnosis.json with a law")
    verb.add_argument("--kind", choices=tuple(KINDS), help="for new: what a minimal plug-in is for")
    verb.add_argument("--out", type=Path, metavar="FILE.py", help="for new: the file to write (default: the name of the effect)")
    verb.add_argument("--write", type=Path, metavar="FILE.md", help="for list: write the page instead of printing a table")
    return verb


def run(arguments: argparse.Namespace) -> int:
    """List, check or begin."""
    if arguments.action == "check":
        return _check(arguments)
    if arguments.action == "new":
        return _new(arguments)
    if arguments.write is not None:
        refuse_other_file(arguments.write, COMMAND, "--write")
        with written_whole(arguments.write) as temporary:
            temporary.write_text(catalogue_page(), encoding="utf-8")
    elif arguments.json:
        print(json.dumps({key: dataclasses.asdict(entry) for key, entry in EFFECTS.items()}))
    else:
        console().print(_table())
        if not arguments.quiet:
            print("an effect of your own:\nnext: tumble effect new MyWind --kind force")
    return 0


def _new(arguments: argparse.Namespace) -> int:
    if not arguments.effect:
        raise InputError("tumble effect new: expected a name for the effect's class, like MyWind, got none.")
    if (arguments.source is None) == (arguments.kind is None):
        came = "neither" if arguments.kind is None else "both"
        raise InputError(f"tumble effect new: expected --from DIAGNOSIS or --kind {{{','.join(KINDS)}}}, got {came}.")
    out = arguments.out or Path(f"{effect_key(arguments.effect)}.py")
    write_plug_in(plug_in_text(arguments.effect, out, source=arguments.source, kind=arguments.kind), out)
    word = f"{out if out.is_absolute() else f'./{out}'}:{arguments.effect}"
    if arguments.json:
        print(json.dumps({"file": str(out), "effect": word}))
    elif not arguments.quiet:
        print(f"{out} is written\nnext: {command('effect', 'check', word)}")
    return 0


def _check(arguments: argparse.Namespace) -> int:
    if not arguments.effect:
        raise InputError("tumble effect check: expected an effect, a key of the catalogue or FILE.py:CLASS, got none.")
    kept = check_effect(arguments.effect, arguments.on, arguments.limit)
    if arguments.json:
        print(json.dumps([dataclasses.asdict(each) for each in kept]))
    elif not arguments.quiet:
        _say(kept)
        on = () if arguments.on is None else ("--on", arguments.on)
        used = command("ladder", arguments.on or "OBSERVATIONS", "--effects", arguments.effect)
        print(f"next: {used if all(each.kept for each in kept) else command('effect', 'check', arguments.effect, *on)}")
    return int(not all(each.kept for each in kept))


def _say(kept: tuple[Kept, ...]) -> None:
    out = console()
    for each in kept:
        mark = "kept  " if each.kept else "BROKEN"
        out.print(f"{mark}  {each.name}: {each.found}", soft_wrap=True)


def _table() -> Table:
    table = Table(box=None, pad_edge=False)
    table.add_column("effect", no_wrap=True)
    for heading in ("stage", "one value per", "parameters", "meaning"):
        table.add_column(heading)
    for entry in EFFECTS.values():
        parameters = "\n".join(f"{p.name} ({p.unit}): {p.plausible[0]:g} to {p.plausible[1]:g}" for p in entry.parameters)
        table.add_row(entry.key, entry.stage.value, entry.scope.value, parameters, entry.meaning)
    return table
