"""Measured oblique impacts of an alumina sphere beside the impulse model and Hertz–Mindlin, with published constants and with fitted ones.

The sphere has 5 mm diameter and strikes at 3.9 m/s; e 0.98 and μ 0.092 are the values published with the measurement [Kharaz, Gorham &
Salman 2001, Chung & Ooi 2011]. The plane is taken as rigid, as in the published test; only the ratio of tangential to normal stiffness
matters, and that hardly depends on the plane.

``python -m scripts.acceptance.contact_measured FILE`` writes this part of ``docs/results/contact_reference.json`` and the picture anew.
"""

import argparse
import csv
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from estimator.contact.hertz_mindlin import HertzMindlin
from estimator.contact.solid import BodyState
from estimator.contact.stronge_impulse import StrongeImpulse
from scripts.benchmarks.contact_speeds import FLAT
from tests.reference.contact_reference_cases import ELASTIC_SPHERES, TEST_4_FRICTION, ball_clump

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
READING = {"tangential_restitution": 0.02, "rebound_spin_rad_per_s": 20.0, "rebound_angle_com_deg": 0.5}
RESTITUTION_SIGMA = 0.02
"""What measured and digitised points may be wrong by, assumed: it only sets how quantities count against one another."""
ROOT = Path(__file__).resolve().parents[2]
RESULT, FIGURE = ROOT / "docs" / "results" / "contact_reference.json", ROOT / "docs" / "studies" / "contact_reference.png"


@dataclass(frozen=True)
class FittedConstants:
    """A ``model``'s restitution and friction (value, standard deviation) from all measured points; ``rms`` that they leave by quantity."""

    model: str
    restitution: tuple[float, float]
    friction: tuple[float, float]
    rms: dict[str, float]


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
        _draw(measured, figure, fitted(measured))
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
    return by_impulse(IMPULSE, quantity, angle_deg), by_forces(COMPLIANT, quantity, angle_deg)


def by_impulse(law: StrongeImpulse, quantity: str, angle_deg: float) -> float:
    """What an impulse law says."""
    state, along = _arriving(angle_deg)
    after = law.strike(state, ball_clump(BALL).solid, np.array([0.0, 0.0, -BALL.radius_m]), FLAT).after
    return _taken(quantity, after, along)


def by_forces(law: HertzMindlin, quantity: str, angle_deg: float) -> float:
    """What Hertz–Mindlin says."""
    state, along = _arriving(angle_deg)
    return _taken(quantity, law.through(state, ball_clump(BALL), FLAT).after, along)


def _arriving(angle_deg: float) -> tuple[BodyState, float]:
    angle = math.radians(angle_deg)
    along = SPEED_M_S * math.sin(angle)
    return BodyState(np.zeros(3), np.eye(3), np.array([along, 0.0, -SPEED_M_S * math.cos(angle)]), np.zeros(3)), along


def compliant(restitution: float, friction: float) -> HertzMindlin:
    """Hertz–Mindlin for the ball with other constants."""
    return HertzMindlin(BALL.young_pa, BALL.poisson, math.inf, 0.3, restitution, friction)


def fitted(measured: dict[str, Array]) -> list[FittedConstants]:
    """Both models with the constants that are nearest to all points; the published restitution counts as one."""
    return [
        _nearest(IMPULSE.name, measured, lambda e, mu, q, a: by_impulse(StrongeImpulse(e, mu), q, a)),
        _nearest(COMPLIANT.name, measured, lambda e, mu, q, a: by_forces(compliant(e, mu), q, a)),
    ]


def _nearest(model: str, measured: dict[str, Array], said: Callable[[float, float, str, float], float]) -> FittedConstants:
    def off(constants: Array, quantity: str) -> Array:
        e, mu = constants.tolist()
        points = measured[quantity]
        return np.array([said(e, mu, quantity, angle) for angle in points[:, 0].tolist()]) - points[:, 1]

    def residuals(constants: Array) -> Array:
        known = (constants[0] - RESTITUTION) / RESTITUTION_SIGMA
        return np.concatenate([*(off(constants, q) / READING[q] for q in measured), [known]])

    found = least_squares(
        residuals, [RESTITUTION, TEST_4_FRICTION], bounds=([0.5, 0.01], [1.0, 0.5]), diff_step=1e-3, x_scale=[0.1, 0.01], xtol=1e-6
    )
    variance = 2.0 * found.cost / (len(found.fun) - 2)
    sigma = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)) * variance)
    rms = {q: float(np.sqrt(np.mean(off(found.x, q) ** 2))) for q in measured}
    (e, mu), (es, mus) = found.x.tolist(), sigma.tolist()
    return FittedConstants(model, (e, es), (mu, mus), rms)


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


def _draw(measured: dict[str, Array], figure: Path, nearest: list[FittedConstants] | None = None) -> None:
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 - after the backend is chosen

    canvas, axes = plt.subplots(1, len(measured), figsize=(12, 3.6))
    angles = np.linspace(0.5, 62.0, 100)
    for axis, (quantity, points) in zip(axes, measured.items(), strict=True):
        both = np.array([predicted(quantity, angle) for angle in angles.tolist()])
        axis.plot(angles, both[:, 0], color="C0", label=IMPULSE.name)
        axis.plot(angles, both[:, 1], color="C1", label=COMPLIANT.name)
        for colour, label, values in _fitted_curves(nearest or [], quantity, angles):
            axis.plot(angles, values, "--", color=colour, linewidth=1.0, label=label)
        axis.plot(points[:, 0], points[:, 1], "k.", label="measured")
        axis.set_xlabel("angle from the normal, °")
        axis.set_title(QUANTITIES[quantity], fontsize=9)
    axes[0].legend(fontsize=7)
    canvas.tight_layout()
    canvas.savefig(figure, dpi=110, metadata={"Software": None})
    plt.close(canvas)


def _fitted_curves(nearest: list[FittedConstants], quantity: str, angles: Array) -> list[tuple[str, str, Array]]:
    if not nearest:
        return []
    (e, mu), (ec, muc) = ((n.restitution[0], n.friction[0]) for n in nearest)
    impulse = [by_impulse(StrongeImpulse(e, mu), quantity, angle) for angle in angles.tolist()]
    forces = [by_forces(compliant(ec, muc), quantity, angle) for angle in angles.tolist()]
    return [("C0", "the same, fitted", np.array(impulse)), ("C1", "the same, fitted", np.array(forces))]


def main() -> int:
    """Compare and fit; everything else in the result file stays as it is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path, help="CSV of measured oblique impacts")
    arguments = parser.parse_args()
    measured = read_measured(arguments.source)
    nearest = fitted(measured)
    stored = json.loads(RESULT.read_text(encoding="utf-8"))
    stored["measured"] = [asdict(_compare(quantity, points)) for quantity, points in measured.items()]
    stored["fitted"] = [asdict(each) for each in nearest]
    with written_whole(RESULT) as temporary:
        temporary.write_text(json.dumps(stored, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    _draw(measured, FIGURE, nearest)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
