"""Impacts of measured trajectories: free flights found, fitted, joined two by two at one pose, and what is refused, said in a sentence.

An impact is what lies between two free flights with at most ``MOST_CONTACT`` rows between them and a jump of the velocities there. What
follows the last flight, or lies between two others, touches something for longer: it rests, rolls or slides, and is told but not measured.
Two contacts within a frame are one impact here; they show by parts of the impulse that act apart in time (``spread_s``), which widens all
uncertainties of that impact.

A flight between two impacts is used by both, each time without what the other impact knows: impacts of one trajectory are correlated.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from datasets.errors import InputError
from datasets.estimate import Estimate, FrameReport, ImpactEstimate, SegmentEstimate, Status, VelocityEstimate
from datasets.trajectory import Trajectory
from datasets.vocabulary.state import Motion
from estimator.data.versions import versions
from estimator.fitting.campaigns.forced_velocities import motion_under
from estimator.measurements.trajectories.fitted_flights import MODEL, FittedFlight, fitted_flights
from estimator.measurements.trajectories.free_flights import (
    LEAST_ROWS,
    MOST_CONTACT,
    TAILS,
    Run,
    free_flights,
    free_rows,
    least_rows,
    path_noise,
)
from estimator.measurements.trajectories.meeting_flights import Meeting, meeting
from estimator.motion.rigid_body import rotation_matrices
from estimator.motion.rotation import quaternion

Array = NDArray[np.float64]
LEAST_JUMP = 60.0
"""Squared Mahalanobis length of the jump of v and omega, as for silhouettes."""
CLEAR_SPREAD = 0.1
"""Of a frame: parts of one impulse further apart in time than this are two contacts, or one that lasts."""
LEAST_OUTSIDE = 2
"""Rows outside of the first flight; a single one is a row that was measured badly."""


@dataclass(frozen=True)
class Struck:
    """An impact between flights number ``before`` and ``before`` + 1 of a trajectory, and how many rows it hides."""

    before: int
    rows_in_contact: int
    meeting: Meeting


def may_have_impacts(trajectories: Sequence[Trajectory]) -> bool:
    """Whether any trajectory is more than one free flight and noise; only poses can tell."""
    return all(t.whole for t in trajectories) and bool(rows_outside(trajectories))


def rows_outside(trajectories: Sequence[Trajectory]) -> dict[str, int]:
    """How many rows of a trajectory lie outside of its first free flight, by its name; none where too few do, or nothing falls freely.

    Trajectories with positions in every row can tell.
    """
    told = [t for t in trajectories if np.isfinite(t.x_world).all()]
    flights = zip(told, all_runs(told), strict=True) if told else ()
    outside = {t.name: len(t.times_s) - (runs[0].last - runs[0].first) for t, runs in flights if runs}
    return {name: rows for name, rows in outside.items() if rows >= LEAST_OUTSIDE}


def untouched(trajectories: Sequence[Trajectory]) -> dict[str, tuple[int, int]]:
    """Rows of those that touch something, by name, from where on they are free to before a contact: velocities jump as by no force."""
    axes = [np.isfinite(t.x_world).any(axis=0) for t in trajectories]
    paths = [centre_path(t)[:, axis] for t, axis in zip(trajectories, axes, strict=True)]
    seen = [np.flatnonzero(np.isfinite(path).all(axis=1) & bool(path.shape[1])) for path in paths]
    shared = path_noise([(t.times_s[rows], path[rows]) for t, path, rows in zip(trajectories, paths, seen, strict=True) if len(rows)])
    found = {}
    for t, axis, path, rows in zip(trajectories, axes, paths, seen, strict=True):
        sigma = shared if t.sigma_x is None or not len(rows) else min(float(np.median(t.sigma_x[rows][:, axis])), shared)
        first, last = free_rows(t.times_s[rows], path[rows], t.surroundings.gravity_world[axis], sigma)
        if last - first < len(rows):
            found[t.name] = (int(rows[first]) if first else 0, int(rows[last]) if last < len(rows) else len(t.times_s))
    return found


def all_runs(trajectories: Sequence[Trajectory]) -> list[tuple[Run, ...]]:
    """The free flights of every trajectory, their noise taken to be the same where it is not stated."""
    return [
        free_flights(t.times_s, centre_path(t), t.surroundings.gravity_world, sigma)
        for t, sigma in zip(trajectories, _noise(trajectories), strict=True)
    ]


def _noise(trajectories: Sequence[Trajectory]) -> list[float]:
    """Noise (m) of each path: as stated, or that of all."""
    shared = path_noise([(t.times_s, centre_path(t)) for t in trajectories])
    return [shared if t.sigma_x is None else float(np.median(t.sigma_x)) for t in trajectories]


def least_flights(trajectories: Sequence[Trajectory]) -> list[int]:
    """How many rows a flight of each trajectory needs for gravity to show over its noise."""
    return [
        least_rows(t.times_s, float(np.linalg.norm(t.surroundings.gravity_world)), TAILS * sigma)
        for t, sigma in zip(trajectories, _noise(trajectories), strict=True)
    ]


def centre_path(trajectory: Trajectory) -> Array:
    """Path (n, 3) m of the centre of mass; that of the tracked point where no orientation was measured."""
    if trajectory.q_world_tracked is None:
        return trajectory.x_world
    return np.asarray(trajectory.x_world + rotation_matrices(trajectory.q_world_tracked) @ trajectory.surroundings.body.com_particle)


def _refuse_without_poses(trajectory: Trajectory) -> None:
    if trajectory.q_world_tracked is None or not trajectory.whole:
        came = "got none" if trajectory.q_world_tracked is None else "got rows without"
        raise InputError(f"{trajectory.name}: expected orientations qx, qy, qz, qw beside positions: impacts need poses, {came}.")


def measure_impacts(trajectories: Sequence[Trajectory]) -> tuple[Estimate, ...]:
    """An estimate for each trajectory, in their order; noise that is not stated is estimated from all of them.

    Raises
    ------
    InputError
        Where a trajectory has no orientations.
    """
    for trajectory in trajectories:
        _refuse_without_poses(trajectory)
    runs = all_runs(trajectories)
    fitted = iter(fitted_flights([(t, run) for t, own in zip(trajectories, runs, strict=True) for run in own]))
    return tuple(
        _estimate(t, [next(fitted) for _ in own], least)
        for t, own, least in zip(trajectories, runs, least_flights(trajectories), strict=True)
    )


def _estimate(trajectory: Trajectory, flights: list[FittedFlight], least: int) -> Estimate:
    struck = impacts_between(flights)
    status, message = judged(trajectory, flights, struck, least)
    told: dict[str, Any] = {
        "name": trajectory.name,
        "status": status,
        "message": message,
        "frames": _rows(trajectory, flights),
        "statistics": _statistics(trajectory, flights, struck),
        "versions": versions(),
    }
    if status is not Status.CONVERGED:
        return Estimate(**told)
    times = trajectory.times_s
    return Estimate(
        body=trajectory.surroundings.body,
        motion=_motion(flights),
        start=_velocity_at(flights[0], float(flights[0].setting.times_s[0])),
        middle=_nearest_velocity(flights, float(times[(len(times) - 1) // 2])),
        segments=_segments(flights, struck),
        impacts=tuple(impact_record(each.meeting) for each in struck),
        **told,
    )


def impacts_between(flights: Sequence[FittedFlight]) -> list[Struck]:
    """The impacts between flights that follow one another closely, where velocities jump."""
    found = []
    for number, (a, b) in enumerate(pairwise(flights)):
        hidden = b.run.first - a.run.last
        if hidden > MOST_CONTACT:
            continue
        met = meeting(a, b, block_diag(a.covariance, b.covariance))
        if met.jump >= LEAST_JUMP:
            found.append(Struck(number, hidden, met))
    return found


def judged(trajectory: Trajectory, flights: Sequence[FittedFlight], struck: Sequence[Struck], least: int) -> tuple[Status, str]:
    """The status that a trajectory deserves, and why; a flight needs ``least`` rows."""
    rows = len(trajectory.times_s)
    if rows < least:
        return Status.NOT_ENOUGH_FRAMES, (
            f"{rows} rows, where gravity shows over the noise only in {least}: neither flights nor what is none can be told. Track "
            "longer, or state a smaller sigma_x_m where it is known."
        )
    if not flights:
        return Status.RESTING, f"in none of {rows} rows a free flight: it rests, rolls, slides or is held; {CUT}"
    held = _held(rows, flights)
    if not struck:
        return _without_impact(rows, flights, held)
    count = len(struck)
    said = [f"converged, piecewise: {count} impact{'s' if count > 1 else ''}, {len(flights)} free flights."]
    for number, each in enumerate(struck):
        if not _clear(trajectory, each):
            said.append(
                f"impact {number + 1}: parts of it are {1e3 * each.meeting.spread_s:.1f} ms apart in time: a second contact at once, or "
                "one that lasts; its uncertainties are widened by that."
            )
    return Status.CONVERGED, " ".join([*said, *held])


CUT = "cut the trajectory to the rows in which it flies."


def _without_impact(rows: int, flights: Sequence[FittedFlight], held: list[str]) -> tuple[Status, str]:
    first, last = flights[0].run.first, flights[-1].run.last
    edges = [(name, count) for name, count in (("first", first), ("last", rows - last)) if 0 < count < LEAST_ROWS]
    if rows - last >= LEAST_ROWS or (len(flights) > 1 and held):
        return Status.RESTING, f"no second free flight follows a contact, so no impact can be measured. {' '.join(held)} {CUT}"
    if edges:
        where, count = edges[0]
        return Status.IMPACT_AT_EDGE, (
            f"something happens in the {where} {count} rows, where a flight of {LEAST_ROWS} rows has no place: an impact there cannot be "
            f"measured; {CUT}"
        )
    return Status.CONVERGED, " ".join(["converged, a free flight without impact.", *held])


def _held(rows: int, flights: Sequence[FittedFlight]) -> list[str]:
    """Sentences on rows that are in no flight, other than the few of an impact."""
    ends = [(0, flights[0].run.first), *((a.run.last, b.run.first) for a, b in pairwise(flights)), (flights[-1].run.last, rows)]
    return [
        f"rows {first} to {last - 1} ({last - first}) are no free flight: it rests, rolls, slides or is held there, and no impact is told."
        for first, last in ends
        if last - first > MOST_CONTACT
    ]


def impact_record(met: Meeting) -> ImpactEstimate:
    """The record of a meeting; the bound of velocities is not known and NaN."""
    return ImpactEstimate(
        time_s=met.time_s,
        time_sigma_s=met.time_sigma_s,
        x_world=met.x,
        q_world_body=quaternion(met.R),
        before=_velocity(met.time_s, met.before, met.covariance[6:12, 6:12]),
        after=_velocity(met.time_s, met.after, met.covariance[12:, 12:]),
        covariance=met.covariance,
    )


def _velocity(time_s: float, value: Array, covariance: Array) -> VelocityEstimate:
    return VelocityEstimate(time_s, value[:3], value[3:], covariance, np.full((6, 6), np.nan))


def _velocity_at(flight: FittedFlight, time_s: float) -> VelocityEstimate:
    there = flight.at(time_s)
    covariance = there.velocity_J @ flight.covariance @ there.velocity_J.T
    return _velocity(time_s, there.velocity, 0.5 * (covariance + covariance.T))


def _nearest_velocity(flights: Sequence[FittedFlight], time_s: float) -> VelocityEstimate:
    """At a time, or where a flight comes nearest to it."""
    times = [np.clip(time_s, f.setting.times_s[0], f.setting.times_s[-1]) for f in flights]
    nearest = int(np.argmin(np.abs(np.array(times) - time_s)))
    return _velocity_at(flights[nearest], float(times[nearest]))


def _segments(flights: Sequence[FittedFlight], struck: Sequence[Struck]) -> tuple[SegmentEstimate, ...]:
    meets = {each.before: each.meeting.time_s for each in struck}
    made = []
    for number, flight in enumerate(flights):
        first, last = float(flight.setting.times_s[0]), float(flight.setting.times_s[-1])
        start, end = meets.get(number - 1, first), meets.get(number, last)
        made.append(SegmentEstimate(start, end, _velocity_at(flight, 0.5 * (start + end))))
    return tuple(made)


def _motion(flights: Sequence[FittedFlight]) -> Motion:
    """Rows in free flight; the others have no motion that is known."""
    parts = [motion_under(f.flight, MODEL, f.theta, f.setting) for f in flights]
    return Motion(*(np.concatenate([getattr(p, name) for p in parts]) for name in Motion.__dataclass_fields__))


def _rows(trajectory: Trajectory, flights: Sequence[FittedFlight]) -> tuple[FrameReport, ...]:
    misfit = np.full(len(trajectory.times_s), np.nan)
    for flight in flights:
        misfit[flight.run.first : flight.run.last] = np.sqrt(flight.row_misfit)
    return tuple(
        FrameReport(0, row, bool(np.isfinite(value)), "" if np.isfinite(value) else "in no free flight", 0.0, float(np.nan_to_num(value)))
        for row, value in enumerate(misfit)
    )


def _clear(trajectory: Trajectory, each: Struck) -> bool:
    """Whether an impact looks like one contact of no duration."""
    return each.meeting.spread_s <= CLEAR_SPREAD * float(np.median(np.diff(trajectory.times_s)))


def _statistics(trajectory: Trajectory, flights: Sequence[FittedFlight], struck: Sequence[Struck]) -> dict[str, Any]:
    return {
        "rows": len(trajectory.times_s),
        "noise": flights[0].sigma.tolist() if flights else [],
        "flights": [{"first": f.run.first, "last": f.run.last - 1, "mean_square": f.mean_square} for f in flights],
        "impacts": [
            {
                "between_flights": [each.before, each.before + 1],
                "rows_in_contact": each.rows_in_contact,
                "spread_s": each.meeting.spread_s,
                "clear": _clear(trajectory, each),
                "gap_m": float(np.linalg.norm(each.meeting.gap[:3])),
                "gap_rad": float(np.linalg.norm(each.meeting.gap[3:])),
                "jump": each.meeting.jump,
            }
            for each in struck
        ],
    }
