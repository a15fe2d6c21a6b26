"""Real impacts: tosses of a cube on to a board, segmented, their impacts measured, and contact models judged by them, whatever comes out.

``python -m scripts.real.real_impacts --tosses FOLDER`` writes ``docs/results/real_impacts.json`` and, from it, the page and picture in
``docs/studies``. FOLDER holds ``cube_tosses.npz`` (Pfrommer, Halm and Posa 2020). Estimates are kept in ``--work`` and not made again.
``--page`` writes the page alone.

The first pass takes the tracked point for the centre of mass; its impacts say where that is, and the next pass uses it.
"""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import spearmanr

from datasets.estimate import Estimate
from datasets.estimate_files import read_estimate, write_estimate
from estimator.contact.hertz_mindlin import Integration
from estimator.contact_validation.fitting import fit
from estimator.contact_validation.held_out import judge
from estimator.contact_validation.laws.force_models import PARAMETERS, Materials, hertz_mindlin_at_corner
from estimator.contact_validation.laws.models import RIGID, ContactModel
from estimator.contact_validation.measured import MeasuredImpact
from estimator.contact_validation.quantities import Contact
from estimator.contact_validation.spread import prepared
from estimator.contact_validation.validate import Question, Validation, validate, values_of
from estimator.measurements.trajectories.impacts import measure_impacts
from scripts.real.real_impacts_cube import (
    HALF_WIDTH_M,
    MASS_KG,
    Cube,
    CubeImpact,
    board_impacts,
    clearances,
    kind,
    mass_of,
    measured,
    rounding_of,
    scale_of,
    whole_tosses,
)
from scripts.real.real_impacts_page import page
from scripts.real.real_tosses import RATE_HZ, free_flights
from scripts.real.toss_study import DOCS, TossStudy, toss_command
from studies.reporting.figures import COLOURS, figure
from tumble.result_files import estimate_path

Array = NDArray[np.float64]
ACRYLIC_ON_WOOD = Materials(3.2e9, 0.37, 11e9, 0.3)
PASSES = 3
ONE_CONTACT = ("frictionless", "sphere_equivalent", "stronge_impulse", "hertz_mindlin")
QUIET_S = 0.03
"""How long no sphere of the clump has to touch for an impact to be over, where several contacts count as one impact."""


def estimates_of(path: Path, centre: Array, folder: Path) -> list[Estimate]:
    """Every toss measured, or read where it has been."""
    tosses = whole_tosses(path, centre)
    files = [estimate_path(folder, t.name) for t in tosses]
    if not all(f.exists() for f in files):
        folder.mkdir(parents=True, exist_ok=True)
        for estimate, file in zip(measure_impacts(tosses), files, strict=True):
            write_estimate(estimate, file)
    return [read_estimate(file) for file in files]


def several_contacts(cube: Cube) -> ContactModel:
    """Hertz–Mindlin on the eight spheres of the rounded cube, until no sphere has touched for ``QUIET_S``; gravity is left out."""
    integration = Integration(quiet_s=QUIET_S)

    def predict(impacts: Sequence[MeasuredImpact], values: Array) -> Array:
        law = ACRYLIC_ON_WOOD.law(*values.tolist())
        after = [law.through(i.state, cube.clump, i.plate, integration).after for i in impacts]
        return np.array([np.concatenate([a.v_world, a.omega_world]) for a in after])

    return ContactModel("rounded_cube", "Hertz–Mindlin, rounded cube", PARAMETERS, predict)


def passes(path: Path, work: Path) -> tuple[list[dict[str, Any]], Cube, list[Estimate], list[CubeImpact]]:
    """What each pass says of the cube, the cube of the last, its estimates and impacts with the board."""
    told, centre = [], np.zeros(3)
    for number in range(PASSES):
        estimates = estimates_of(path, centre, work / f"pass_{number + 1}")
        impacts = board_impacts(estimates, centre)
        clear = [i for i in impacts if i.clear]
        radius, height, rms = rounding_of(clear, centre)
        mass = mass_of(clear, Cube(radius, 1.0, centre))
        cube = Cube(radius, mass.kappa_m2, centre)
        told.append(
            {
                "centre_m": centre.tolist(),
                "noise": next(e.statistics["noise"] for e in estimates if e.statistics["noise"]),
                "rounding_m": radius,
                "board_m": height,
                "height_rms_m": rms,
                "kappa_m2": mass.kappa_m2,
                "kappa_sigma_m2": mass.kappa_sigma_m2,
                "shift_m": mass.shift.tolist(),
                "shift_sigma_m": mass.shift_sigma.tolist(),
                "agreement": mass.agreement,
            }
        )
        centre = centre + mass.shift
    return told, cube, estimates, impacts


def falling(path: Path, centre: Array) -> dict[str, float]:
    """Median and scatter (1.48 median deviations) over tosses of the downward acceleration (m/s²) of a point of the flying cube."""
    found = []
    for x, q in free_flights(path):
        point = scale_of(path) * x[:, 2] + Rotation.from_quat(q).as_matrix()[:, 2] @ centre
        t = np.arange(len(x)) / RATE_HZ
        found.append(-2.0 * np.polynomial.polynomial.polyfit(t - t.mean(), point, 2)[2])
    median = float(np.median(found))
    return {"median_ms2": median, "scatter_ms2": 1.4826 * float(np.median(np.abs(np.array(found) - median)))}


def at_rest(path: Path) -> dict[str, float]:
    """Scatter of the height (m) of the cube's middle in the last rows, and the RMS tilt (°) of its tracked axes against the board."""
    with np.load(path) as archive:
        last = archive["data"][archive["offsets"][1:] - 1]
    upward = np.abs(Rotation.from_quat(last[:, [4, 5, 6, 3]]).as_matrix()[:, 2]).max(axis=1)
    tilt = float(np.sqrt(np.mean(np.degrees(np.arccos(np.minimum(upward, 1.0))) ** 2)))
    return {"height_sigma_m": scale_of(path) * float(last[:, 2].std()), "tilt_deg": tilt}


def centre_of_free_flight() -> float:
    """What the study of free flight named for the centre of mass along the third axis (m), lengths as measured."""
    stored = json.loads((DOCS / "results" / "real_tosses.json").read_text(encoding="utf-8"))
    values = stored["explained"]["values"]
    return float(next(v["value"] for v in values if v["effect"] == "centre_of_mass" and v["parameter"] == "c3"))


def impact_entry(cube: Cube, impact: CubeImpact, contact: Contact | None) -> dict[str, Any]:
    """One impact: what the instrument says, what touched, what the contact was like."""
    record, state = impact.record, measured(cube, impact).state
    before, after = (0.5 * (v.v_world @ v.v_world + cube.kappa_m2 * v.omega_world @ v.omega_world) for v in (record.before, record.after))
    entry = {
        "toss": impact.toss,
        "number": impact.number,
        "time_s": record.time_s,
        "time_sigma_s": record.time_sigma_s,
        "spread_s": impact.spread_s,
        "rows_in_contact": impact.rows_in_contact,
        "clear": impact.clear,
        "kind": kind(cube, impact),
        "next_corner_m": float(clearances(cube, impact)[1]),
        "speed_ms": float(np.linalg.norm(state.v_world)),
        "spin_rads": float(np.linalg.norm(state.omega_world)),
        "energy_lost": 1.0 - after / before,
        "sigma_v_after_ms": float(np.sqrt(np.diag(record.after.covariance)[:3].mean())),
        "sigma_omega_after_rads": float(np.sqrt(np.diag(record.after.covariance)[3:].mean())),
    }
    if contact is None:
        return entry
    return {
        **entry,
        "restitution": list(contact.restitution),
        "impulse_ratio": list(contact.ratio),
        "normal_impulse_ms": list(contact.normal_impulse),
        "approach_ms": -float(contact.u_before[2]),
        "sliding_ms": float(np.hypot(*contact.u_before[:2])),
        "point_body_m": contact.point_body.tolist(),
        "angle_deg": float(np.degrees(contact.angle_rad)),
        "one_contact_p": contact.one_contact_p,
    }


def errors(residuals: Array) -> dict[str, float]:
    """Root mean square and median error of v (m/s) and omega (rad/s), from residuals (n, 6)."""
    v, omega = np.linalg.norm(residuals[:, :3], axis=1), np.linalg.norm(residuals[:, 3:], axis=1)
    return {
        "v_rms": float(np.sqrt(np.mean(v**2))),
        "omega_rms": float(np.sqrt(np.mean(omega**2))),
        "v_median": float(np.median(v)),
        "omega_median": float(np.median(omega)),
    }


def model_entries(found: Validation, others: Sequence[MeasuredImpact], kinds: Sequence[str]) -> list[dict[str, Any]]:
    """Each model: values, held-out errors on the impacts it is judged by, of these ``kinds``, and errors of the same values on others."""
    entries = []
    for ranked in found.ranking:
        judged, model = ranked.judged, ranked.model
        entries.append(
            {
                "model": model.title,
                "values": [[name, value, sigma] for name, value, sigma, _ in values_of(judged.fitted)],
                "scatter": judged.fitted.scatter,
                "held_out_cost": judged.cost,
                "median_distance2": float(np.median(judged.distances2)),
                "behind": None if ranked.behind is None else [ranked.behind.total, ranked.behind.low, ranked.behind.high],
                "held_out": errors(judged.residuals),
                "by_kind": {k: errors(judged.residuals[[i for i, x in enumerate(kinds) if x == k]]) for k in sorted(set(kinds))},
                "several_contacts": errors(after_of(others) - model.predict(others, judged.fitted.values)),
            }
        )
    return entries


def after_of(impacts: Sequence[MeasuredImpact]) -> Array:
    """Measured v and omega (n, 6) after impacts."""
    return np.stack([i.after for i in impacts])


def trends(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """How restitution and impulse ratio go with what is known before an impact: rank correlation and its p."""
    rows = []
    for quantity in ("restitution", "impulse_ratio"):
        for axis in ("approach_ms", "sliding_ms", "next_corner_m", "number", "angle_deg"):
            rank, p = spearmanr([e[axis] for e in entries], [e[quantity][0] for e in entries])
            rows.append({"quantity": quantity, "axis": axis, "rank": float(rank), "p": float(p)})
    return rows


def study(path: Path, work: Path) -> dict[str, Any]:
    """All figures."""
    told, cube, estimates, impacts = passes(path, work)
    clear, others = [i for i in impacts if i.clear], [i for i in impacts if not i.clear]
    ready, rest = [measured(cube, i) for i in clear], [measured(cube, i) for i in others]
    found = validate(ready, Question(ONE_CONTACT, ACRYLIC_ON_WOOD), lambda step: print(f"  {step}", flush=True))
    judged = [m.name not in found.shared for m in ready]
    entries = [impact_entry(cube, i, c) | {"judged": j} for i, c, j in zip(clear, found.contacts, judged, strict=True)]
    firsts = {i.toss: i for i in reversed(impacts)}
    return {
        "tosses": len(estimates),
        "statuses": dict(Counter(e.status.value for e in estimates)),
        "refused": [{"toss": n, "message": e.message} for n, e in enumerate(estimates) if not e.impacts],
        "flights": sum(len(e.segments) for e in estimates),
        "impacts": len(impacts),
        "not_at_the_board": sum(len(e.impacts) for e in estimates) - len(impacts),
        "clear_impacts": len(clear),
        "tosses_with_impact": len({i.toss for i in impacts}),
        "tosses_with_clear_impact": len({i.toss for i in clear}),
        "first_impact_clear": sum(i.clear for i in firsts.values()),
        "scale": scale_of(path),
        "mass_kg": MASS_KG,
        "half_width_m": HALF_WIDTH_M,
        "passes": told,
        "falls": [falling(path, np.array(p["centre_m"])) for p in told],
        "centre_of_free_flight_m": centre_of_free_flight(),
        "rest": at_rest(path),
        "clear": entries,
        "unclear": [impact_entry(cube, i, None) for i in others],
        "trends": trends(entries),
        "judged_impacts": sum(judged),
        "models": model_entries(found, rest, [e["kind"] for e in entries if e["judged"]]),
        "all": judged_on_all(cube, impacts),
        "changes": {
            "judged": errors(jumps([i for i, j in zip(clear, judged, strict=True) if j])),
            "clear": errors(jumps(clear)),
            "several_contacts": errors(jumps(others)),
        },
        "ladder": [
            {
                "added": rung.added,
                "accepted": rung.accepted,
                "gain": None if rung.gained is None else [rung.gained.total, rung.gained.low, rung.gained.high, rung.gained.chance],
                "values": [[name, value, sigma] for name, value, sigma, _ in values_of(rung.judged.fitted)],
            }
            for rung in found.ladder.rungs
        ],
        "verdict": {"sentence": found.verdict.sentence, "remarks": list(found.verdict.remarks)},
        "maps": [{"axis": m.axis, "kind": m.kind, "rank": m.rank_correlation, "p": m.p} for m in found.maps if m.telling],
    }


def judged_on_all(cube: Cube, impacts: Sequence[CubeImpact]) -> list[dict[str, Any]]:
    """Models fitted to clear impacts and others alike, and their held-out errors on both."""
    together = prepared([measured(cube, i) for i in impacts], Question().seed)
    clear = np.array([i.clear for i in impacts])
    entries = []
    for model in (RIGID, hertz_mindlin_at_corner(ACRYLIC_ON_WOOD), several_contacts(cube)):
        judged = judge(together, fit(together, model))
        entries.append(
            {
                "model": model.title,
                "values": [[name, value, sigma] for name, value, sigma, _ in values_of(judged.fitted)],
                "held_out_cost": judged.cost,
                "clear": errors(judged.residuals[clear]),
                "several_contacts": errors(judged.residuals[~clear]),
            }
        )
    return entries


def jumps(impacts: Sequence[CubeImpact]) -> Array:
    """Changes (n, 6) of v and omega at impacts."""
    return np.stack([i.jump for i in impacts])


def drawn(result: dict[str, Any]) -> Figure:
    """Restitution over speed, impulse ratio over sliding speed, angular over linear impulse errors of each model."""
    canvas, axes = figure(1, 3, (12.0, 3.6))
    left, middle, right = axes[0]
    entries = result["clear"]
    for axis, across, quantity, label in (
        (left, "approach_ms", "restitution", "Stronge's e"),
        (middle, "sliding_ms", "impulse_ratio", "tangential over normal impulse"),
    ):
        for name, colour in zip(("corner", "edge"), COLOURS, strict=False):
            rows = [e for e in entries if e["kind"] == name]
            axis.errorbar(
                [e[across] for e in rows],
                [e[quantity][0] for e in rows],
                yerr=[1.96 * e[quantity][1] for e in rows],
                fmt="o",
                markersize=3.5,
                linewidth=0.8,
                color=colour,
                label=name,
            )
        axis.set_ylabel(label)
        axis.legend(fontsize=8)
    left.set_xlabel("normal speed of the contact point, m/s")
    left.set_ylim(0.0, 0.7)
    middle.set_xlabel("its sliding speed, m/s")
    middle.set_ylim(0.0, 0.3)
    names = [m["model"] for m in result["models"]]
    place = np.arange(len(names))
    for off, key, label in ((0.2, "v_rms", "v"), (-0.2, "omega_rms", "ω")):
        whole = result["changes"]["judged"][key]
        right.barh(place + off, [100 * m["held_out"][key] / whole for m in result["models"]], 0.38, label=label)
    right.set_yticks(place, [name.replace(" + ", "\n+ ") for name in names], fontsize=7)
    right.invert_yaxis()
    right.set_xlabel("held-out error, % of the change")
    right.legend(fontsize=8)
    canvas.tight_layout()
    return canvas


def main() -> int:
    """Run, or take the result that is there, and write page and picture."""
    return toss_command(TossStudy("real_impacts", "the estimates are kept", study, drawn, page), __doc__)


if __name__ == "__main__":
    raise SystemExit(main())
