"""Velocities, segments and impacts of an estimate as plain entries of its document."""

from typing import Any

import numpy as np

from datasets import state_entries
from datasets.estimate import CollisionEstimate, Estimate, ImpactEstimate, Measured, PlateGap, SegmentEstimate, VelocityEstimate

Entry = dict[str, Any]


def velocity_entry(velocity: VelocityEstimate | None) -> Entry | None:
    """Velocities as an entry of a document."""
    return None if velocity is None else dict(vars(velocity))


def velocity(entry: Entry | None) -> VelocityEstimate | None:
    """The inverse of :func:`velocity_entry`."""
    return None if entry is None else _velocity(entry)


def _velocity(entry: Entry) -> VelocityEstimate:
    v, omega = state_entries.array(entry["v_world"]), state_entries.array(entry["omega_world"])
    return VelocityEstimate(
        float(entry["time_s"]), v, omega, state_entries.square(entry["covariance"]), state_entries.square(entry["bound"])
    )


def entries(estimate: Estimate) -> Entry:
    """Segments, impacts and the collision as entries of a document; nothing where there is no impact."""
    if not estimate.impacts:
        return {}
    struck = {} if estimate.collision is None else {"collision": _collision_entry(estimate.collision)}
    return {
        **struck,
        "segments": [{**vars(s), "velocity": velocity_entry(s.velocity)} for s in estimate.segments],
        "impacts": [_impact_entry(impact) for impact in estimate.impacts],
    }


def _impact_entry(impact: ImpactEstimate) -> Entry:
    plate = None if impact.plate is None else dict(vars(impact.plate))
    return {**vars(impact), "before": velocity_entry(impact.before), "after": velocity_entry(impact.after), "plate": plate}


def _collision_entry(collision: CollisionEstimate) -> Entry:
    return {key: dict(vars(value)) if isinstance(value, Measured) else value for key, value in vars(collision).items()}


def collision(document: Entry) -> CollisionEstimate | None:
    """The collision of a document; ``None`` where it names none."""
    entry = document.get("collision")
    if entry is None:
        return None
    return CollisionEstimate(**{key: _collision_value(value) for key, value in entry.items()})


def _collision_value(value: Any) -> Any:
    if isinstance(value, dict):
        return Measured(float(value["value"]), float(value["sigma"]))
    return np.array(value, dtype=np.float64) if isinstance(value, list) else value


def segments(document: Entry) -> tuple[SegmentEstimate, ...]:
    """Segments of a document; none where it names none."""
    return tuple(SegmentEstimate(float(e["start_s"]), float(e["end_s"]), _velocity(e["velocity"])) for e in document.get("segments", ()))


def impacts(document: Entry) -> tuple[ImpactEstimate, ...]:
    """Impacts of a document; none where it names none."""
    return tuple(_impact(e) for e in document.get("impacts", ()))


def _impact(entry: Entry) -> ImpactEstimate:
    plate = entry["plate"]
    return ImpactEstimate(
        time_s=float(entry["time_s"]),
        time_sigma_s=float(entry["time_sigma_s"]),
        x_world=np.array(entry["x_world"], dtype=np.float64),
        q_world_body=np.array(entry["q_world_body"], dtype=np.float64),
        before=_velocity(entry["before"]),
        after=_velocity(entry["after"]),
        covariance=state_entries.square(entry["covariance"]),
        plate=None if plate is None else PlateGap(**plate),
    )
