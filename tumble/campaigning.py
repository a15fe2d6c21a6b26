"""A campaign from its folder: observations or trajectories read, put together, what is broken named and left out."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from datasets.errors import InputError
from datasets.names import file_name
from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.particle_files import read_particle, with_particle
from datasets.toml_text import read_toml
from datasets.trajectory import Trajectory
from datasets.trajectory_files import read_trajectory, trajectories_in
from datasets.trajectory_surroundings import FOLDER_FILE
from datasets.vocabulary.effects import EFFECTS
from estimator.data.configuration import Configuration
from estimator.effects.choosing import catalogue, refuse_without_gravity
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.silhouettes.registration import register
from estimator.measurements.trajectories.impacts import untouched
from estimator.measurements.trajectories.registering import register_trajectories
from tumble.misstated import Misstated, misstated
from tumble.notes import tell_notes
from tumble.progress import progress
from tumble.reasons import grouped, listed
from tumble.result_files import observations_in
from tumble.stating import Stated, facts_of
from tumble.tracked_bodies import body_from_mesh

Read = TypeVar("Read", Observation, Trajectory)
MOST_CUT = 3
"""Sequences that are named where more are cut before a contact."""
MOST_REPEATED = 0.1
"""Share of rows that may repeat the one before them to the last digit before that is said: of coarsely rounded ones, some do."""


@dataclass(frozen=True)
class Known:
    """What a user says on the command line.

    Of trajectories ``surroundings`` as in their side-car, and a ``mesh`` of the body; of effects what is ``stated``; of observations the
    folder of the ``particle`` file whose views count; names of sequences that the campaign is ``without``.
    """

    surroundings: Mapping[str, Any] = field(default_factory=dict)
    mesh: Path | None = None
    stated: tuple[Stated, ...] = ()
    particle: Path | None = None
    without: tuple[str, ...] = ()

    @property
    def options(self) -> tuple[str, ...]:
        """The options that say so."""
        particle = () if self.particle is None else ("--particle", str(self.particle))
        without = ("--without", ",".join(self.without)) if self.without else ()
        return (*particle, *self.of_trajectories, *(word for each in self.stated for word in (each.option, each.words)), *without)

    @property
    def of_trajectories(self) -> tuple[str, ...]:
        """Those of them that are about trajectories."""
        gravity = self.surroundings.get("gravity_world")
        said = () if gravity is None else ("--gravity=" + ",".join(f"{g:g}" for g in gravity),)
        return (*said, *(() if self.mesh is None else ("--mesh", str(self.mesh))))

    @property
    def words(self) -> str:
        """The same for a shell."""
        return shlex.join(self.options)


@dataclass(frozen=True)
class Prepared:
    """A campaign with what its sequences were made from, by name, and why others were left out.

    ``touching``: from which to before which row a trajectory touches nothing, which alone are in the campaign, and how many it has.
    ``misstated``: what is stated wrongly of trajectories, if anything; ``shape_stated``: whether the moments of inertia of all are stated.
    """

    registered: Registered
    observations: Mapping[str, Observation | Trajectory]
    left_out: dict[str, str]
    touching: Mapping[str, tuple[int, int, int]] = field(default_factory=dict)
    misstated: Misstated | None = None
    shape_stated: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The sequences of the campaign."""
        return tuple(s.name for s in self.registered.campaign.sequences)

    def at(self, campaign: Campaign) -> "Prepared":
        """The same with the campaign as it is at a fit."""
        return replace(self, registered=replace(self.registered, campaign=campaign))


def prepare(
    source: Path, configuration: Configuration, effects: Sequence[EffectModel], *, quiet: bool, known: Known | None = None
) -> Prepared:
    """Read every observation or trajectory of ``source`` and find the motion in each.

    Raises
    ------
    InputError
        Where no sequence is left, with the reason of each; where an effect cannot be found in such measurements.
    """
    known = known or Known()
    if known.particle is not None and trajectories_in(source):
        raise InputError(f"{known.particle}: expected no --particle with trajectories, which have no views, got one.")
    found = _of_trajectories(source, effects, known, quiet=quiet) if trajectories_in(source) else None
    if found is None and known.of_trajectories:
        words = shlex.join(known.of_trajectories)
        raise InputError(f"{source}: expected trajectories (*.csv, *.tum, *.txt) for {words}, got none: pictures state it themselves.")
    found = found or _of_pictures(source, configuration, effects, known, quiet=quiet)
    if not found.registered.campaign.sequences:
        reasons = "\n".join(f"  {who}: {reason}" for who, reason in grouped(found.left_out))
        raise InputError(f"{source}: no sequence of this campaign can be measured:\n{reasons}")
    campaign = found.registered.campaign
    _refuse_what_does_not_apply(campaign, effects)
    candidates = {**catalogue(campaign.cameras), **{effect.entry.key: effect for effect in effects}}
    return found.at(replace(campaign, facts=(*campaign.facts, *facts_of(known.stated, campaign, candidates, known.mesh))))


def _unstated(effects: Sequence[EffectModel], known: Known) -> list[EffectModel]:
    """The effects of which nothing is stated: those have to show in the data."""
    stated = [each.effect for each in known.stated]
    return [effect for effect in effects if effect.entry.key not in stated]


def _wanted(source: Path, paths: Sequence[Path], without: Sequence[str], *, quiet: bool) -> list[Path]:
    """What is read of a campaign: all but what it is ``without``, which is told.

    Raises
    ------
    InputError
        Where there is no sequence of such a name, or none is left.
    """
    names = [file_name(path.stem) if path.is_file() else path.name for path in paths]
    if strange := [name for name in without if name not in names]:
        raise InputError(f"{source}: expected --without with names of sequences, got {', '.join(strange)}; there are {listed(names)}.")
    wanted = [path for name, path in zip(names, paths, strict=True) if name not in without]
    if not wanted:
        raise InputError(f"{source}: expected --without to leave a sequence, got all {len(names)}: {listed(names)}.")
    told = f"{len(without)} of {len(names)} sequences are not used, as --without asks: {listed(without)}."
    tell_notes([told] if without else [], quiet=quiet)
    return wanted


def _read_alone(folder: Path) -> Observation:
    """An observation of one particle."""
    observation = read_observation(folder)
    if observation.companion is not None:
        raise InputError(f"{folder}: expected one particle, since campaigns are of one, got two.")
    return observation


def _of_pictures(source: Path, configuration: Configuration, effects: Sequence[EffectModel], known: Known, *, quiet: bool) -> Prepared:
    try:
        folders = observations_in(source)
    except InputError as error:
        raise InputError(f"{error} Trajectories are files that end in .csv, .tum or .txt.") from error
    observations, left_out = _read(_wanted(source, folders, known.without, quiet=quiet), _read_alone)
    if known.particle is not None:
        particle = read_particle(known.particle)
        observations = {name: with_particle(observation, particle) for name, observation in observations.items()}
    tell_notes((note for observation in observations.values() for note in observation.notes), quiet=quiet)
    refuse_without_gravity([e.entry.key for e in _unstated(effects, known)], [o.gravity_world for o in observations.values()])
    with progress("register", len(observations), quiet=quiet) as advance:
        registered = register(list(observations.values()), configuration, told=advance)
    left_out.update({each.name: each.reason for each in registered.left_out})
    return Prepared(registered, observations, left_out)


def _of_trajectories(source: Path, effects: Sequence[EffectModel], known: Known, *, quiet: bool) -> Prepared:
    files = _wanted(source, trajectories_in(source), known.without, quiet=quiet)
    trajectories, left_out = _read(files, lambda path: read_trajectory(path, known.surroundings))
    copies = _copies(trajectories)
    left_out |= {name: f"{name}: the same rows as {first}; a recording that is there twice counts once." for name, first in copies.items()}
    trajectories = {name: each for name, each in trajectories.items() if name not in copies}
    if known.mesh is not None:
        body = body_from_mesh(known.mesh)
        trajectories = {name: replace(t, surroundings=replace(t.surroundings, body=body)) for name, t in trajectories.items()}
    refuse_without_gravity([e.entry.key for e in _unstated(effects, known)], [t.surroundings.gravity_world for t in trajectories.values()])
    free = untouched(list(trajectories.values()))
    touching = {name: (*rows, len(trajectories[name].times_s)) for name, rows in free.items()}
    trajectories |= {name: trajectories[name].between(*rows) for name, rows in free.items()}
    tell_notes((note for each in trajectories.values() for note in each.notes), quiet=quiet)
    tell_notes((*contact_words(touching, len(trajectories)), *repeated_words(trajectories)), quiet=quiet)
    with progress("register", len(trajectories), quiet=quiet) as advance:
        registered = register_trajectories(list(trajectories.values()), told=advance)
    plug_ins = [effect for effect in effects if effect.entry.key not in EFFECTS]
    wrong = None if plug_ins else misstated(trajectories, source, known.surroundings)
    return Prepared(registered, trajectories, left_out, touching, wrong, _shape_stated(source, known))


def _shape_stated(source: Path, known: Known) -> bool:
    """Whether the moments of inertia of every trajectory are stated, by a mesh or in a side-car."""
    return known.mesh is not None or all(
        any(file.is_file() and "inertia_ratios" in read_toml(file) for file in (path.parent / FOLDER_FILE, path.with_suffix(".toml")))
        for path in trajectories_in(source)
    )


def contact_words(touching: Mapping[str, tuple[int, int, int]], of: int) -> tuple[str, ...]:
    """That sequences touch something, of which the rows before or after are in the campaign; nothing where none does."""
    if not touching:
        return ()
    told = [f"{name} (rows {first + 1} to {last} of {recorded})" for name, (first, last, recorded) in touching.items()]
    more = [f"{len(told) - MOST_CUT} more"] if len(told) > MOST_CUT else []
    held = ", or they lie still at first" if any(first for first, _, _ in touching.values()) else ""
    return (
        f"{len(touching)} of {of} sequences touch something: their velocity jumps as no force makes it{held}. The free flight is used: "
        f"{', '.join([*told[:MOST_CUT], *more])}. Impacts themselves are measured by tumble estimate, from poses.",
    )


def repeated_words(observations: Mapping[str, Observation | Trajectory]) -> tuple[str, ...]:
    """That many rows of trajectories repeat the one before to the last digit, which no tracker with noise does."""
    told = [t for t in observations.values() if isinstance(t, Trajectory)]
    repeated = {t.name: count for t in told if (count := _repeated(t))}
    rows, of = sum(repeated.values()), sum(len(t.times_s) for t in told)
    if rows <= MOST_REPEATED * of:
        return ()
    return (
        f"{rows} of {of} rows repeat the one before them to the last digit, in {len(repeated)} of {len(told)} sequences, first in "
        f"{next(iter(repeated))}: pictures that are stored twice (a film of another rate), a tracker that has lost what it follows, or "
        "very coarse rounding? They count as measured; leave copies out.",
    )


def _repeated(t: Trajectory) -> int:
    """How many rows have everything that was measured as the row before has it."""
    measured = [part for part in (t.x_world, t.q_world_tracked, t.omega_world, t.gyro) if part is not None]
    table = np.column_stack(measured)
    seen = np.isfinite(table)
    same = (table[1:] == table[:-1]) | (~seen[1:] & ~seen[:-1])
    return int(np.count_nonzero(same.all(axis=1) & (seen[1:] & seen[:-1]).any(axis=1)))


def _copies(trajectories: Mapping[str, Trajectory]) -> dict[str, str]:
    """Names of trajectories that have the rows of one before them, and its name."""
    first: dict[tuple[bytes, ...], str] = {}
    measured = {name: (t.times_s, t.x_world, t.q_world_tracked, t.omega_world, t.gyro) for name, t in trajectories.items()}
    rows = {name: tuple(b"" if part is None else part.tobytes() for part in parts) for name, parts in measured.items()}
    return {name: first[each] for name, each in rows.items() if first.setdefault(each, name) != name}


def _refuse_what_does_not_apply(campaign: Campaign, effects: Sequence[EffectModel]) -> None:
    for effect in effects:
        reason = campaign.kind.why_not(campaign, effect)
        if reason is not None:
            raise InputError(f"--effects: {effect.entry.key} does not apply to these measurements: {reason}.")


def _read(paths: Sequence[Path], reader: Callable[[Path], Read]) -> tuple[dict[str, Read], dict[str, str]]:
    found: dict[str, Read] = {}
    left_out: dict[str, str] = {}
    for path in paths:
        try:
            measurement = reader(path)
        except InputError as error:
            left_out[path.name] = str(error)
            continue
        if measurement.name in found:
            left_out[path.name] = f"{path}: expected a name of its own, got {measurement.name}, which another sequence of this folder has."
        else:
            found[measurement.name] = measurement
    return found, left_out
