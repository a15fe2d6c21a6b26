"""Every reference number of the contact models, what came, and the difference: ``python -m scripts.acceptance.contact_reference``.

Prints the table and with ``--result`` writes it; ends with exit code 1 where a number is off by more than is allowed. The page is
written by ``python -m scripts.acceptance.contact_reference_page``. With LAMMPS installed (``make lammps``) its numbers stand beside ours.
With ``--measured FILE`` measured oblique impacts of alumina spheres [Kharaz, Gorham & Salman 2001] are compared with both models.
"""

import argparse
import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from datasets.atomic_files import written_whole
from estimator.contact.clump_generator import directions_around, generated_clump, outline_error
from estimator.contact.hertz_mindlin import HertzMindlin, clamped_restitution
from estimator.contact.solid import BodyState
from estimator.contact.stronge_impulse import StrongeImpulse
from estimator.contact.velocity_impulse import NewtonImpulse, PoissonImpulse
from scripts.acceptance.contact_measured import Comparison, compared, fitted, read_measured
from scripts.benchmarks.contact_speeds import (
    DIAMOND_ON_STEEL,
    FLAT,
    SMALLEST_RADIUS_M,
    clump_seconds,
    contacts_per_second,
    impulses_per_second,
    random_contacts,
    stone,
)
from tests.reference.contact_lammps import Throw, available, thrown
from tests.reference.contact_reference_cases import (
    CLAMPED_RESTITUTION,
    ELASTIC_SPHERES,
    ENERGY_RATIOS,
    FULL_CASES,
    TEST_4,
    TEST_4_FRICTION,
    ball_clump,
)

RANDOM = 10_000
SPHERES = (1, 2, 5, 10, 20, 50, 100)
SIDES = ("x", "y", "z")


@dataclass(frozen=True)
class Row:
    """One number: what was expected, what came, by how much it may be off, over the expected one or ``absolute``; LAMMPS's number.

    ``at_most``: what came may lie below what was expected as far as it likes.
    """

    group: str
    name: str
    expected: float
    came: float
    allowed: float
    absolute: bool = False
    lammps: float | None = None
    at_most: bool = False

    @property
    def off(self) -> float:
        """Difference, over the expected number unless absolute."""
        difference = self.came - self.expected
        return (max(0.0, difference) if self.at_most else abs(difference)) / (1.0 if self.absolute else abs(self.expected))

    @property
    def kept(self) -> bool:
        """Whether it is off by no more than allowed."""
        return self.off <= self.allowed


def full_cases() -> list[Row]:
    """The five full impacts: velocity and spin after."""
    rows = []
    for case in FULL_CASES:
        after = StrongeImpulse(case.restitution, case.friction).strike(case.state, case.solid, case.lever, FLAT).after
        for what, expected, came in (("v", case.v_after, after.v_world), ("ω", case.omega_after, after.omega_world)):
            rows += [
                Row("impulse", f"{case.name}: {what}_{k}", *pair, 1e-8) for k, *pair in zip(SIDES, expected, came.tolist(), strict=True)
            ]
    return rows


def energy_ratios() -> list[Row]:
    """Energy after over before under three restitutions, to the digits printed."""
    rows = []
    for case in ENERGY_RATIOS:
        for law, ratio, digits in zip((NewtonImpulse, PoissonImpulse, StrongeImpulse), case.ratios, case.digits, strict=True):
            found = law(case.restitution, case.friction).strike(case.state, case.solid, np.array(case.lever), FLAT)
            came = found.after.energy_j(case.solid) / case.state.energy_j(case.solid)
            rows.append(
                Row("energy ratio", f"{case.name}, {law.__name__.removesuffix('Impulse')}", ratio, came, 0.51 * 10.0**-digits, True)
            )
        for name, expected, came in zip(("u_x", "u_z"), case.u_after, found.u_after[[0, 2]].tolist(), strict=False):
            rows.append(Row("energy ratio", f"{case.name}, {name} after", expected, came, 0.51e-9, True))
    return rows


def random_impacts() -> list[Row]:
    """The worst of 10,000 random impacts, e from 0 to 1 and μ from 0 to 1.5: energy gained, friction cone, work of restitution."""
    rng, worst = np.random.default_rng(11), np.full(3, -np.inf)
    for _ in range(RANDOM // 100):
        e, mu = float(rng.uniform(0.0, 1.0)), float(rng.uniform(0.0, 1.5))
        K, u = random_contacts(rng, 100)
        found = StrongeImpulse(e, mu).follow(K, u)
        energy = 0.5 * np.einsum("ni,nij,nj->n", u, np.linalg.inv(K), u)
        gained = 0.5 * np.einsum("ni,ni->n", u + found.velocity_after, found.impulse) / energy
        outside = np.linalg.norm(found.impulse[:, :2], axis=1) / found.impulse[:, 2] - mu
        work = np.abs(found.normal_j - (1 - e**2) * found.compression_j) / energy
        worst = np.maximum(worst, [gained.max(), outside.max(), work.max()])
    names = ("energy gained, over what there was", "|P_t|/Pₙ beyond μ", "W − (1 − e²) W_c, over the energy")
    return [
        Row("10,000 random impacts", f"largest {name}", 0.0, float(w), 1e-9, absolute=True, at_most=True)
        for name, w in zip(names, worst, strict=True)
    ]


def elastic_spheres() -> list[Row]:
    """Depth, force and time of contact of elastic spheres."""
    rows = []
    for case in ELASTIC_SPHERES:
        law = HertzMindlin(case.young_pa, case.poisson, case.plate_young_pa, case.plate_poisson, 1.0, 0.0)
        state = BodyState(np.zeros(3), np.eye(3), np.array([0.0, 0.0, -case.approach_m_s]), np.zeros(3))
        ours = law.through(state, ball_clump(case), FLAT)
        theirs = thrown(Throw.of(case), law, case.contact_s) if available() else None
        for name, expected, came, other in (
            ("depth, m", case.depth_m, ours.deepest_m, theirs and theirs.depth_m),
            ("force, N", case.force_n, _force(law, ours.deepest_m, case.radius_m), theirs and _force(law, theirs.depth_m, case.radius_m)),
            ("contact, s", case.contact_s, ours.duration_s, theirs and theirs.contact_s),
        ):
            rows.append(Row("elastic sphere", f"{case.name}: {name}", expected, came, 1e-6, lammps=other))
    return rows


def _force(law: HertzMindlin, depth_m: float, radius_m: float) -> float:
    return law.elastic_force_n(depth_m, radius_m)


def oblique_spheres() -> list[Row]:
    """Test 4: what an elastic alumina sphere does at five angles."""
    rows, ball = [], ELASTIC_SPHERES[4]
    law = HertzMindlin(ball.young_pa, ball.poisson, math.inf, 0.3, 1.0, TEST_4_FRICTION)
    for case in TEST_4:
        angle = math.radians(case.angle_deg)
        along, down = 3.9 * math.sin(angle), 3.9 * math.cos(angle)
        state = BodyState(np.zeros(3), np.eye(3), np.array([along, 0.0, -down]), np.zeros(3))
        ours = law.through(state, ball_clump(ball), FLAT).after
        theirs = thrown(Throw.of(ball, along, down), law, ball.contact_s / math.cos(angle) ** 0.2) if available() else None
        name = f"{case.angle_deg:g}° from the normal"
        ratio, other = float(ours.v_world[0]) / along, theirs and theirs.along_m_s / along
        rows.append(Row("test 4", f"{name}: v_t′/v_t", case.tangential_ratio, ratio, 5e-3, lammps=other))
        rows.append(
            Row("test 4", f"{name}: ω′, rad/s", case.spin_rad_s, float(ours.omega_world[1]), 5e-3, lammps=theirs and theirs.spin_rad_s)
        )
    return rows


def restitutions() -> list[Row]:
    """What clamping makes of the damping formula's e, and whether the e asked for is delivered."""
    rows = []
    for unclamped, delivered in CLAMPED_RESTITUTION:
        beta = -math.log(unclamped) / math.hypot(math.log(unclamped), math.pi)
        rows.append(Row("restitution", f"damping for {unclamped:g}, clamped", delivered, clamped_restitution(beta), 0.51e-5, True))
    for e in (0.1, 0.3, 0.5, 0.7, 0.9):
        law = HertzMindlin(1143e9, 0.069, 210e9, 0.30, e, 0.0)
        state = BodyState(np.zeros(3), np.eye(3), np.array([0.0, 0.0, -2.0]), np.zeros(3))
        came = float(law.through(state, ball_clump(ELASTIC_SPHERES[5]), FLAT).after.v_world[2]) / 2.0
        rows.append(Row("restitution", f"{e:g} asked for, delivered", e, came, 1e-6))
    return rows


def speeds() -> dict[str, float]:
    """Speeds on one core: processor time, compilation not counted."""
    return {
        "whole impacts per second, impulse model": impulses_per_second(np.random.default_rng(1)),
        "contacts per second in one call, impulse model": contacts_per_second(np.random.default_rng(2)),
        "seconds for one impact of a clump of 50 spheres": clump_seconds(np.random.default_rng(3)),
    }


def clump_errors() -> list[dict[str, float]]:
    """Outline error of clumps of a stone of about 2 mm against their number of spheres."""
    body, seen, rows = stone(np.random.default_rng(3)), directions_around(3000), []
    for count in SPHERES:
        clump = generated_clump(body, count, smallest_radius_m=SMALLEST_RADIUS_M)
        error = outline_error(clump, body.vertices_body, seen)
        rows.append({"spheres": len(clump.radii), "rms_um": 1e6 * error.rms_m, "largest_um": 1e6 * error.largest_m})
    return rows


def main() -> int:
    """Compute, print, write; exit code 1 where a number is off by more than allowed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--result", type=Path, help="write the numbers here")
    parser.add_argument("--measured", type=Path, help="CSV of measured oblique impacts")
    parser.add_argument("--figure", type=Path, help="picture of the measured impacts beside both models")
    arguments = parser.parse_args()
    rows = full_cases() + energy_ratios() + random_impacts() + elastic_spheres() + oblique_spheres() + restitutions()
    measured: list[Comparison] = compared(arguments.measured, arguments.figure) if arguments.measured else []
    result = {
        "rows": [asdict(row) | {"off": row.off, "kept": row.kept} for row in rows],
        "speeds": speeds(),
        "clump": clump_errors(),
        "measured": [asdict(entry) for entry in measured],
        "fitted": [asdict(entry) for entry in fitted(read_measured(arguments.measured))] if arguments.measured else [],
        "law_of_the_clump": asdict(DIAMOND_ON_STEEL),
    }
    _say(rows, result["speeds"])
    if arguments.result:
        with written_whole(arguments.result) as temporary:
            temporary.write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return int(not all(row.kept for row in rows))


def _say(rows: list[Row], found: object) -> None:
    table = Table("group", "number", "expected", "came", "off", "allowed", "LAMMPS", box=None, pad_edge=False)
    for row in rows:
        other = "" if row.lammps is None else f"{row.lammps:.10g}"
        verdict = "" if row.kept else " missed"
        table.add_row(
            row.group, row.name, f"{row.expected:.12g}", f"{row.came:.12g}", f"{row.off:.1e}{verdict}", f"{row.allowed:.1e}", other
        )
    console = Console(width=180)
    console.print(table)
    console.print(found)


if __name__ == "__main__":
    raise SystemExit(main())
