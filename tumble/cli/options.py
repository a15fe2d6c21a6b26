"""Options that several verbs share, so that a word means the same everywhere."""

import argparse
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from tumble.cli.exit_codes import IN_SHORT
from tumble.engine import Executor, Processes, Scheduler


def verb_parser(name: str, *, description: str, example: str) -> argparse.ArgumentParser:
    """A parser whose help ends in ``example``; it has ``--json``, ``-v`` and ``-q``."""
    parser = argparse.ArgumentParser(
        prog=f"tumble {name}",
        description=description,
        epilog=f"{IN_SHORT}\n\nexample:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON on standard output")
    loudness = parser.add_mutually_exclusive_group()
    loudness.add_argument("-v", "--verbose", action="store_true", help="say more; show the traceback of an error")
    loudness.add_argument("-q", "--quiet", action="store_true", help="no progress and no tables; errors only")
    return parser


Part = tuple[str, str, Callable[[argparse.ArgumentParser], None], Callable[[argparse.Namespace], int]]
"""Of a verb: its name, what it does in words, what adds its options, and what runs it."""


def add_parts(verb: argparse.ArgumentParser, parts: Sequence[Part]) -> list[argparse.ArgumentParser]:
    """The parsers of a verb's ``parts``, each with its options, ``-v`` and ``-q``; which one is wanted is ``part``."""
    chosen = verb.add_subparsers(dest="part", required=True, metavar="PART")
    made = []
    for name, text, options, _ in parts:
        part = chosen.add_parser(name, help=text, description=text)
        options(part)
        part.add_argument("-v", "--verbose", action="store_true", help="say more; show the traceback of an error")
        part.add_argument("-q", "--quiet", action="store_true", help="no progress and no tables; errors only")
        made.append(part)
    return made


def run_part(arguments: argparse.Namespace, parts: Sequence[Part]) -> int:
    """Run the part that is wanted."""
    return {name: action for name, _, _, action in parts}[arguments.part](arguments)


def add_configuration(parser: argparse.ArgumentParser, *, what: str) -> None:
    """``--config`` and ``--set``: a TOML file and single values that override it."""
    parser.add_argument("--config", type=Path, metavar="FILE.toml", help=f"{what}, as TOML")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="settings", help="override one value, e.g. motion.frames=50"
    )


def add_output(parser: argparse.ArgumentParser, *, default: str) -> None:
    """``--out``, ``--resume`` and ``--force``: where results go and what to do with those already there."""
    parser.add_argument("--out", type=Path, default=Path(default), metavar="FOLDER", help="output folder (default: %(default)s)")
    again = parser.add_mutually_exclusive_group()
    again.add_argument("--resume", action="store_true", help="go on with an interrupted run: finished items stay")
    again.add_argument("--force", action="store_true", help="replace the run that the folder holds")


def add_known(parser: argparse.ArgumentParser) -> None:
    """What a user knows: ``--gravity``, ``--mesh`` of trajectories, ``--particle``, ``--known``, ``--possible`` and ``--without``."""
    parser.add_argument(
        "--gravity", type=three_numbers, metavar="X,Y,Z", help="trajectories: gravity in their frame, m/s2, e.g. --gravity=0,0,-9.81"
    )
    parser.add_argument("--particle", type=Path, metavar="STONE", help="what tumble shape wrote: its views instead of those stated")
    parser.add_argument("--mesh", type=Path, metavar="FILE", help="trajectories: the body as a closed mesh in metres, in the tracked frame")
    parser.add_argument(
        "--known",
        action="append",
        default=[],
        metavar="FACT",
        help="a number that was measured beside the recordings, with its standard deviation; can be given several times: "
        "'length=100mm±0.2mm measured 98.0mm', 'rest_height=52.4mm±0.1mm measured 51.3mm±0.1mm', 'frame_rate=0±1e-5', "
        "'gravity=9.807±0.003m/s2', 'centre_of_mass.c3=6±1mm'; +- is read as ±, %% as a hundredth",
    )
    parser.add_argument(
        "--possible",
        action="append",
        default=[],
        metavar="EFFECT=±SIGMA",
        help="an effect that may be there though no data show it, with its standard deviation: length_scale=±0.2%%; widens v and ω",
    )
    parser.add_argument(
        "--without", type=names, default=(), metavar="NAMES", help="sequences of a campaign that are not used: toss_07,toss_12"
    )


def names(text: str) -> tuple[str, ...]:
    """Names with commas, for argparse."""
    found = tuple(dict.fromkeys(filter(None, (part.strip() for part in text.split(",")))))
    if not found:
        raise argparse.ArgumentTypeError(f"expected names with commas, as in toss_07,toss_12, got {text!r}")
    return found


def three_numbers(text: str) -> tuple[float, ...]:
    """Three numbers with commas, for argparse."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"expected three numbers with commas, as in 0,0,-9.81, got {text}")
    return numbers


def add_jobs(parser: argparse._ActionsContainer) -> None:
    """``--jobs``: how many local processes."""
    parser.add_argument("--jobs", type=positive, default=cores(), metavar="N", help="local processes (default: %(default)s)")


def add_engine(parser: argparse.ArgumentParser) -> None:
    """``--jobs`` or ``--scheduler``, and ``--time-limit``: by what items are worked on."""
    where = parser.add_mutually_exclusive_group()
    add_jobs(where)
    where.add_argument(
        "--scheduler",
        default="",
        metavar="ADDRESS",
        help="a Dask scheduler, whose workers see the same files: tcp://host:8786, or its file",
    )
    parser.add_argument("--time-limit", type=seconds, metavar="SECONDS", help="give up an item that takes longer (default: never)")


def executor_of(arguments: argparse.Namespace) -> Executor:
    """What the options of :func:`add_engine` ask for."""
    if arguments.scheduler:
        return Scheduler(arguments.scheduler, arguments.time_limit)
    return Processes(arguments.jobs, arguments.time_limit)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def positive(text: str) -> int:
    """A whole number of at least one, for argparse."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least 1, got {text}")
    return value


def seconds(text: str) -> float:
    """A time of more than nothing (s), for argparse."""
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"expected seconds, more than 0, got {text}")
    return value
