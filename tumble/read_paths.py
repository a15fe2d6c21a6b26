"""What a run reads must survive it: an output folder that holds any of it is refused, whatever the options say."""

from collections.abc import Iterable
from pathlib import Path

from datasets.errors import InputError
from datasets.trajectory_files import trajectories_in
from estimator.effects.plug_ins import is_plug_in


def refuse_to_replace_what_is_read(out: Path, reads: Iterable[Path], *, force: bool) -> None:
    """Refuse an output folder that equals or holds what is read; with ``force`` also one inside of it that would be emptied.

    Links are resolved first.

    Raises
    ------
    InputError
        Naming both.
    """
    there = out.resolve()
    for read in reads:
        source = read.resolve()
        if there == source or there in source.parents:
            holds = "is" if there == source else "holds"
            raise InputError(
                f"{out}: expected an output folder apart from what is read, got one that {holds} {read}. Choose another --out."
            )
        if force and source in there.parents and there.is_dir() and any(there.iterdir()):
            raise InputError(
                f"{out}: expected --force to replace a folder outside of what is read, got one inside {read}. Choose another --out."
            )


def observations_read(source: Path) -> tuple[Path, ...]:
    """What a verb reads of the OBSERVATIONS that it is given: of a dataset its observations, truth never."""
    trajectories = tuple(trajectories_in(source))
    inside = source / "observations"
    return trajectories or ((inside,) if inside.is_dir() else (source,))


def effects_read(words: str) -> tuple[Path, ...]:
    """The files of the plug-ins among effects, ``gravity,./my_wind.py:Wind``."""
    return tuple(Path(word.strip().rpartition(":")[0]) for word in words.split(",") if is_plug_in(word.strip()))


def paths_given(*paths: Path | None) -> tuple[Path, ...]:
    """Those paths that were given."""
    return tuple(path for path in paths if path is not None)
