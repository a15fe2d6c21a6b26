"""Collects what a report shows: estimates, and observations and truth where they are at hand; one sequence at a time, in parallel."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from datasets.estimate import Estimate
from datasets.estimate_files import read_estimate, surface_file
from datasets.file_digests import file_sha256
from datasets.json_documents import read_document
from datasets.observation import Observation
from datasets.observation_files import FILE as OBSERVATION_FILE
from datasets.observation_files import read_observation
from datasets.particle_files import is_particle, read_particle, with_particle
from datasets.trajectory_files import trajectories_in
from datasets.truth_files import FILE as TRUTH_FILE
from datasets.truth_files import read_truth
from estimator.outlines.sightings import tracks_of
from tumble.engine import Executor, Item, Outcome, run
from tumble.notes import tell_notes
from tumble.progress import progress
from tumble.reports.overlay import estimated_outlines, surface_of
from tumble.reports.page import pictures_each
from tumble.reports.payload import sequence_parts
from tumble.reports.record import Record
from tumble.result_files import SUFFIX, estimates_in, observations_in
from tumble.written_files import read_run


def source_of(estimates: Path) -> Path | None:
    """Where the observations of a folder of estimates were read from, as its ``run.json`` says, if they are still there.

    ``None`` for trajectories as well: there is no picture to show.
    """
    run = read_run(estimates)
    source = Path(run["configuration"]["observations"]) if run and "observations" in run["configuration"] else None
    return source if source is not None and source.exists() and not trajectories_in(source) else None


def particle_of(estimates: Path) -> Path | None:
    """The particle file whose views a folder of estimates was made with, as its ``run.json`` says; it may be gone."""
    run = read_run(estimates)
    return Path(run["configuration"]["particle"]) if run and "particle" in run["configuration"] else None


def frame_words(estimates: Path) -> str:
    """Whose frame orientations are in, where estimates were made with the views of a particle file; empty where nobody says so."""
    particle = particle_of(estimates) or _named_by(source_of(estimates))
    if particle is None:
        return ""
    return f"Orientations are in the frame of {os.path.relpath(particle)}: where that is not the truth's, their errors say nothing."


def _named_by(source: Path | None) -> Path | None:
    """The particle file that the first observation of ``source`` names, if it can still be read."""
    if source is None:
        return None
    try:
        folder = observations_in(source)[0]
        named = read_document(folder / OBSERVATION_FILE, "observation").get("particle")
    except InputError:
        return None
    return None if named is None else (folder / named).resolve()


def collect(
    estimates: Path, observations: Path | None, truth: Path | None, *, out: Path, executor: Executor, quiet: bool
) -> tuple[Outcome, ...]:
    """The parts of the page of every estimate, by name, as results of the engine."""
    folders = {folder.name: str(folder.absolute()) for folder in observations_in(observations)} if observations is not None else {}
    paths = estimates_in(estimates)
    particle = particle_of(estimates)
    if particle is not None and not is_particle(particle):
        gone = f"{particle}: expected the particle file that these estimates were made with, got none: their outlines are not drawn."
        tell_notes([gone], quiet=quiet)
    shared = {
        "observations": folders,
        "truth": truth,
        "particle": particle,
        "most_frames": pictures_each(len(paths)),
    }
    items = [_item(path, shared, out) for path in paths]
    with progress("report", len(items), quiet=quiet) as advance:
        return run(report_item, items, executor=executor, advance=advance)


def _item(path: Path, shared: dict[str, Any], out: Path) -> Item:
    """One sequence. Its product is never written, so that a run that goes on makes the whole page anew."""
    name = path.name.removesuffix(SUFFIX)
    return Item(name, {"estimate": path, **shared}, out / f"{name}.part")


def report_item(payload: dict[str, Any]) -> dict[str, Any]:
    """What the page shows of one sequence."""
    path = Path(payload["estimate"])
    estimate = read_estimate(path)
    folder = payload["observations"].get(estimate.name)
    truth = None if payload["truth"] is None else Path(payload["truth"]) / estimate.name
    known = truth is not None and (truth / TRUTH_FILE).is_file()
    read = [Path(folder)] if folder is not None else []
    record = Record(estimate, truth=read_truth(truth) if truth is not None and known else None)
    if folder is not None:
        observation = _observed(Path(folder), payload["particle"])
        _check_same(estimate, observation, folder)
        record = _with_pictures(record, observation)
        read += [Path(payload["particle"])] if payload["particle"] is not None and is_particle(Path(payload["particle"])) else []
    digests = _digests(path, [*read, *([truth] if truth is not None and known else [])])
    return sequence_parts(replace(record, read=digests), most_frames=payload["most_frames"])


def _check_same(estimate: Estimate, observation: Observation, folder: str) -> None:
    """Refuse an observation of fewer pictures or cameras than the estimate of its name was made from."""
    wanted = [1 + max((f.frame for f in estimate.frames), default=-1), 1 + max((f.camera for f in estimate.frames), default=-1)]
    got = [max(len(clock.times_s) for clock in observation.clocks), len(observation.cameras)]
    if any(w > g for w, g in zip(wanted, got, strict=True)):
        raise InputError(
            f"{folder}: expected the recording that {estimate.name} was estimated from, with frames up to {wanted[0] - 1} of "
            f"{wanted[1]} camera(s), got {got[0]} frames of {got[1]}."
        )


def _observed(folder: Path, particle: str | None) -> Observation:
    """The observation, with the views that the estimate was made with; with none where these are gone, not with others."""
    observation = read_observation(folder)
    if particle is None:
        return observation
    if not is_particle(Path(particle)):
        return replace(observation, views=(), view_recording=(), made=None)
    return with_particle(observation, read_particle(Path(particle)))


def _with_pictures(record: Record, observation: Observation) -> Record:
    """The record with what was observed: the outlines seen and estimated, and the body."""
    return replace(
        record,
        observation=observation,
        outlines_px=estimated_outlines(record.estimate, observation),
        tracks=tracks_of(observation),
        surface=surface_of(record.estimate, observation),
    )


def _digests(estimate: Path, folders: Sequence[Path]) -> tuple[tuple[str, str], ...]:
    """Name and SHA-256 of the estimate, its surfaces and of every file in ``folders``; names are from the folder above each."""
    surfaces = (surface_file(estimate), surface_file(estimate, companion=True))
    files = [(path.name, path) for path in (estimate, *surfaces) if path.exists()]
    for folder in folders:
        root = folder.parent.parent
        files += [(str(path.relative_to(root)), path) for path in sorted(folder.rglob("*")) if path.is_file()]
    return tuple((name, file_sha256(path)) for name, path in files)
