"""``tumble VERB ...``: finds the verb, runs it, and turns errors into exit codes and plain sentences.

Exit codes are those of :mod:`tumble.cli.exit_codes`, whatever the verb. A verb's module is imported only when it
is asked for, so that ``--help`` answers at once.
"""

import errno
import gc
import importlib
import os
import sys
import traceback
from collections.abc import Sequence
from types import ModuleType

from datasets.errors import TumbleError
from tumble.cli.exit_codes import BAD_INPUT, IN_SHORT, INTERRUPTED, OWN_FAULT
from tumble.one_thread import keep_to_one_thread

VERBS: tuple[tuple[str, str], ...] = (
    ("doctor", "say what works on this machine and what to type to get the rest"),
    ("quickstart", "render, estimate, score and report two small sequences of a cut stone"),
    ("render", "make a dataset from a recipe"),
    ("calibrate", "calibrate cameras, rigs and the direction of gravity from pictures of targets"),
    ("shape", "merge drops of a particle seen by a rig into one set of views, a particle file"),
    ("import", "make observations of a camera's own recordings"),
    ("check", "look at observations before anything is fitted"),
    ("estimate", "measure poses, trajectory and velocities from observations alone"),
    ("compare", "show where the model of a campaign fails, and whether it does"),
    ("diagnose", "say which physical effect the model of a campaign misses"),
    ("explain", "add what is missing, step by step, until only noise is left"),
    ("ladder", "show the error on data not fitted fall, effect by effect"),
    ("effect", "list the catalogue of effects; check an effect of your own"),
    ("validate-contact", "judge contact models by measured impacts, and say which contact physics is missing"),
    ("score", "compare estimates with the truth"),
    ("report", "write one self-contained HTML page from saved results"),
    ("bench", "time the kernel, a whole estimate and the renderer"),
    ("challenge", "hide effects in campaigns, find them without knowing, count how often that works"),
    ("cluster", "start a Dask scheduler and its workers, through Slurm or another batch system, for --scheduler"),
    ("gate", "compare a run with a committed baseline; exit 1 when it got worse"),
    ("benchmark", "make, check and cite named sets of sequences"),
    ("leaderboard", "put instruments beside one another on the same datasets"),
)

FULL = (errno.ENOSPC, errno.EDQUOT)


def usage() -> str:
    """The help of ``tumble`` itself."""
    width = max(len(name) for name, _ in VERBS)
    verbs = "\n".join(f"  {name:<{width}}  {text}" for name, text in VERBS)
    return (
        "usage: tumble VERB [options]\n\n"
        "Measures the motion of irregular particles from high-speed video, and knows how good each measurement is.\n\n"
        f"verbs:\n{verbs}\n\n"
        f"{IN_SHORT}\n\n"
        "`tumble VERB --help` explains a verb and ends in an example.\n\n"
        "example:\n  tumble quickstart --out out/demo"
    )


def module_of(name: str) -> ModuleType:
    """The verb's module, imported without looking for garbage: hardly any is made then, and looking took a quarter of the time.

    What the import made stays until the end, so it is not looked through later either.
    """
    full = f"tumble.cli.{name.replace('-', '_')}"
    if full in sys.modules or not gc.isenabled():
        return importlib.import_module(full)
    gc.disable()
    try:
        return importlib.import_module(full)
    finally:
        gc.freeze()
        gc.enable()


def run_verb(name: str, arguments: Sequence[str]) -> int:
    """Run one verb with its arguments; its exit code."""
    module = module_of(name)
    parsed = module.parser().parse_args(arguments)
    return int(module.run(parsed))


def _plain(error: Exception, arguments: Sequence[str]) -> int:
    _trace(error, arguments)
    full = isinstance(error, OSError) and error.errno in FULL
    said = "the disk is full. Free some space or choose another --out, then go on with --resume." if full else error
    print(f"tumble: {said}", file=sys.stderr)
    return BAD_INPUT


def _fault(name: str, error: Exception, arguments: Sequence[str]) -> int:
    """An exception that nobody expected must not end with Python's own exit code 1, which is an answer."""
    _trace(error, arguments)
    shown = "Please report the lines above." if _verbose(arguments) else "-v shows where; please report that."
    print(f"tumble: {type(error).__name__}: {error}", file=sys.stderr)
    print(f"tumble: this is a fault of tumble {name} itself, not of the input. {shown}", file=sys.stderr)
    return OWN_FAULT


def _verbose(arguments: Sequence[str]) -> bool:
    return "-v" in arguments or "--verbose" in arguments


def _trace(error: Exception, arguments: Sequence[str]) -> None:
    if _verbose(arguments):
        traceback.print_exception(error)


def _interrupted(name: str) -> int:
    resumable = name in {"render", "shape", "import", "check", "estimate", "quickstart", "challenge", "benchmark"}
    again = " The same command with --resume goes on from here." if resumable else ""
    print(f"tumble: stopped. Finished items are whole.{again}", file=sys.stderr)
    return INTERRUPTED


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] in {"-h", "--help", "help"}:
        print(usage())
        return 0 if words else BAD_INPUT
    name, rest = words[0], words[1:]
    if name not in dict(VERBS):
        print(f"tumble: there is no verb {name!r}. Known: {', '.join(dict(VERBS))}.", file=sys.stderr)
        return BAD_INPUT
    keep_to_one_thread(os.environ)
    try:
        return run_verb(name, rest)
    except KeyboardInterrupt:
        return _interrupted(name)
    except (TumbleError, OSError) as error:
        return _plain(error, rest)
    except Exception as error:
        return _fault(name, error, rest)


if __name__ == "__main__":
    sys.exit(main())
