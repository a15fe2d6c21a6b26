"""Measured oblique impacts of an alumina sphere beside the impulse model and Hertz–Mindlin; nothing is fitted to the measurement.

The sphere has 5 mm diameter and strikes at 3.9 m/s; e 0.98 and μ 0.092 are the values published with the measurement [Kharaz, Gorham &
Salman 2001, Chung & Ooi 2011]. The plane is taken as rigid, as in the published test; only the ratio of tangential to normal stiffness
matters, and that hardly depends on the plane.
"""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from estimator.contact.hertz_mindlin import HertzMindlin
from estimator.contact.solid import BodyState
from estimator.contact.stronge_impulse import StrongeImpulse
from scripts.contact_reference_cases import ELASTIC_SPHERES, TEST_4_FRICTION, ball_clump
from scripts.contact_speeds import FLAT

Array = NDArray[np.float64]
RESTITUTION, SPEED_M_S = 0.98, 3.9
BALL = ELASTIC_SPHERES[4]
IMPULSE = StrongeImpulse(RESTITUTION, TEST_4_FRICTION)
COMPLIANT = HertzMindlin(BALL.young_pa, BALL.poisson, math.inf, 0.3, RESTITUTION, TEST_4_FRICTION)
COLUMNS = ("quantity", "incidence_angle_deg_from_normal", "value")
QUANTITIES = {
    "tangential_restitution": "tangential velocity after over before",
    "rebound_spin_rad_per_s": "spin after, rad/s",
    "rebound_angle_com_deg": "rebound angle of the centre from the normal, °",
}


@dataclass(frozen=True)
class Comparison:
    """A quantity's ``points``, RMS and largest difference of each model from the measurement, and the angle (°) of the largest."""

    quantity: str
    points: int
    impulse_rms: float
    impulse_largest: float
    impulse_largest_at_deg: float
    compliant_rms: float
    compliant_largest: float
    compliant_largest_at_deg: float


def compared(source: Path, figure: Path | None) -> list[Comparison]:
    """Both models beside every measured point of ``source``; a picture where ``figure`` is given.

    Raises
    ------
    InputError
        Where the file lacks the columns or names a quantity that is not known.
    """
    measured = read_measured(source)
    if figure is not None:
        _draw(measured, figure)
    return [_compare(quantity, points) for quantity, points in measured.items()]


def read_measured(source: Path) -> dict[str, Array]:
    """Rows (angle from the normal in °, value) per quantity."""
    with source.open(encoding="utf-8", newline="") as stream:
        rows = csv.DictReader(stream)
        if tuple(rows.fieldnames or ()) != COLUMNS:
            raise InputError(f"{source}: expected the columns {', '.join(COLUMNS)}, got {', '.join(rows.fieldnames or ())}")
        found: dict[str, list[tuple[float, float]]] = {}
        for row in rows:
            if row["quantity"] not in QUANTITIES:
                raise InputError(f"{source}: expected one of {', '.join(QUANTITIES)}, got {row['quantity']}")
            found.setdefault(row["quantity"], []).append((float(row[COLUMNS[1]]), float(row["value"])))
    return {quantity: np.array(points) for quantity, points in found.items()}


def predicted(quantity: str, angle_deg: float) -> tuple[float, float]:
    """What the impulse model and Hertz–Mindlin say of ``quantity`` at ``angle_deg`` from the normal."""
    angle = math.radians(angle_deg)
    along = SPEED_M_S * math.sin(angle)
    state = BodyState(np.zeros(3), np.eye(3), np.array([along, 0.0, -SPEED_M_S * math.cos(angle)]), np.zeros(3))
    ball = ball_clump(BALL)
    rigid = IMPULSE.strike(state, ball.solid, np.array([0.0, 0.0, -BALL.radius_m]), FLAT).after
    soft = COMPLIANT.through(state, ball, FLAT).after
    return _taken(quantity, rigid, along), _taken(quantity, soft, along)


def _taken(quantity: str, after: BodyState, along: float) -> float:
    if quantity == "tangential_restitution":
        return float(after.v_world[0]) / along
    if quantity == "rebound_spin_rad_per_s":
        return float(after.omega_world[1])
    return math.degrees(math.atan2(float(after.v_world[0]), float(after.v_world[2])))


def _compare(quantity: str, points: Array) -> Comparison:
    off = np.array([predicted(quantity, angle) for angle in points[:, 0]]) - points[:, 1:]
    worst = np.argmax(np.abs(off), axis=0)
    figures = [(float(np.sqrt(np.mean(off[:, k] ** 2))), float(off[worst[k], k]), float(points[worst[k], 0])) for k in range(2)]
    return Comparison(quantity, len(points), *figures[0], *figures[1])


def _draw(measured: dict[str, Array], figure: Path) -> None:
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 - after the backend is chosen

    canvas, axes = plt.subplots(1, len(measured), figsize=(12, 3.6))
    for axis, (quantity, points) in zip(axes, measured.items(), strict=True):
        angles = np.linspace(0.5, 62.0, 100)
        both = np.array([predicted(quantity, angle) for angle in angles.tolist()])
        axis.plot(angles, both[:, 0], label=IMPULSE.name)
        axis.plot(angles, both[:, 1], label=COMPLIANT.name)
        axis.plot(points[:, 0], points[:, 1], "k.", label="measured")
        axis.set_xlabel("angle from the normal, °")
        axis.set_title(QUANTITIES[quantity], fontsize=9)
    axes[0].legend(fontsize=8)
    canvas.tight_layout()
    canvas.savefig(figure, dpi=110, metadata={"Software": None})
    plt.close(canvas)
