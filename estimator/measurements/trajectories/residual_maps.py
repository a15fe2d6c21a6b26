"""Where a model of trajectories fails: maps of the residual over time, place, speed and spin.

A map takes one component of the residual (along the velocity, along a world axis, a turn about the spin) and its mean over the rows in each
bin, in standard deviations of the noise. Measured minus predicted: positive along v means that the thing is further than the model has it.
A mean of n rows whose noise repeats over r has the variance r / n; whether a map shows anything is chi-squared of all its bins, its p-value
corrected for the number of maps.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from estimator.diagnosis.residual_maps import Axis, ResidualMap, even, phase
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, SequenceEquations
from estimator.measurements.trajectories.task import TrajectoryTask

Array = NDArray[np.float64]
LEAST_IN_BIN = 4
"""Rows below which a bin is left out. By judgement."""
SLOW = 1e-9
"""Speed, against division by zero, of what does not move."""


@dataclass(frozen=True)
class _Rows:
    """What maps are made of, one entry per row of every sequence: ``axes`` values, ``components`` in σ, and over how many they repeat."""

    axes: dict[str, Array]
    components: dict[str, Array]
    repeats: dict[str, Array]


def trajectory_maps(campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
    """All maps of a fit, those that show most first."""
    parts = [_of_sequence(task, each) for task, each in zip(campaign.sequences, fit.equations, strict=True)]
    names = set.intersection(*(set(p.components) for p in parts))
    rows = _Rows(
        _joined([{k: v for k, v in p.axes.items() if all(k in other.axes for other in parts)} for p in parts]),
        _joined([{k: p.components[k] for k in sorted(names)} for p in parts]),
        _joined([{k: p.repeats[k] for k in sorted(names)} for p in parts]),
    )
    maps = [_map(axis, kind, rows) for axis in _axes(rows.axes) for kind in rows.components]
    found = [m for m in maps if m is not None]
    return tuple(sorted((replace(m, p=min(1.0, m.p * len(found))) for m in found), key=lambda m: (m.p, -m.statistic)))


def _joined(parts: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}


def _axes(values: dict[str, Array]) -> list[Axis]:
    axes = [even("time", "time", "frame", values["frame"])]
    if "speed" in values:
        axes.append(even("speed", "speed", "m/s", values["speed"]))
        axes += [even(f"position_{a}", f"position along {a}", "m", values[a]) for a in "xyz"]
    if "turned" in values:
        axes += [phase(values["turned"]), even("spin", "spin", "rad/s", values["spin"])]
    return axes


def _of_sequence(task: TrajectoryTask, each: SequenceEquations) -> _Rows:
    prediction, kept = each.errors.prediction, task.kept
    v, omega = prediction.velocity, prediction.omega
    axes = {"frame": np.arange(len(v), dtype=np.float64)}
    if "x" in task.measured:
        axes |= {"speed": np.linalg.norm(v, axis=1), **dict(zip("xyz", prediction.poses.centre[:, 0].T, strict=True))}
    if not task.still[9:12].all():
        spin = np.linalg.norm(omega, axis=1)
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (spin[1:] + spin[:-1]) * np.diff(task.times_s))])
        axes |= {"turned": np.degrees(turned), "spin": spin}
    components: dict[str, Array] = {}
    repeats: dict[str, Array] = {}
    for channel, along, name in (("x", v, "position"), ("theta", omega, "turn"), ("omega", omega, "spin"), ("gyro", task.gyro, "spin")):
        if channel in task.measured and along is not None:
            found, more = _taken_apart(task, each, channel, along, name)
            components, repeats = components | found, repeats | more
    return _Rows(*({k: a[kept] for k, a in part.items()} for part in (axes, components, repeats)))


def _taken_apart(
    task: TrajectoryTask, each: SequenceEquations, channel: str, along: Array, name: str
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Components of one channel's residual along its three axes and along a direction (n, 3), and over how many rows each repeats.

    NaN where a component was not measured.
    """
    columns, seen = task.columns(channel), task.seen(channel)
    measured = np.where(seen, -each.errors.e[:, columns], np.nan)
    alike = task.repeats[columns]
    found = {f"{name}_{a}": measured[:, i] for i, a in enumerate("xyz")}
    repeats = {f"{name}_{a}": np.full(len(measured), alike[i]) for i, a in enumerate("xyz")}
    u = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), SLOW)
    weight = u * np.where(seen, task.sigma[:, columns], 0.0)
    size = np.linalg.norm(weight, axis=1)
    found[f"{name}_along"] = np.where(seen.any(axis=1), np.sum(weight * np.nan_to_num(measured), axis=1) / np.maximum(size, 1e-300), np.nan)
    repeats[f"{name}_along"] = np.full(len(measured), alike.mean())
    return found, repeats


def _map(axis: Axis, kind: str, rows: _Rows) -> ResidualMap | None:
    told = np.isfinite(rows.components[kind])
    values, repeats, bins = rows.components[kind][told], rows.repeats[kind][told], axis.bin[told]
    count = np.bincount(bins, minlength=len(axis.centre))
    kept = np.flatnonzero(count >= LEAST_IN_BIN)
    if len(kept) < 2:
        return None
    mean = np.bincount(bins, values, len(axis.centre))[kept] / count[kept]
    sigma = np.sqrt(np.bincount(bins, repeats, len(axis.centre))[kept]) / count[kept]
    statistic = float(np.sum((mean / sigma) ** 2))
    return ResidualMap(axis, kind, kept, mean, sigma, count[kept], statistic, float(chdtrc(len(kept), statistic)), "σ")
