"""Reference numbers of contact models: rigid impacts with friction, and elastic Hertz–Mindlin spheres on a plate.

They were computed independently of this code (30 digits, or DOP853 integration) or come from public verification suites of the discrete
element method [Chung & Ooi 2011]. Axes: x and y along the plate, z its normal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.contact.clump import Clump
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReferenceImpact:
    """``m_kg``; ``inertia`` (xx, yy, zz, xy, xz, yz) 1e-12 kg m²; ``r_mm``; v m/s; ω rad/s; constants; v and ω after."""

    name: str
    m_kg: float
    inertia: tuple[float, ...]
    r_mm: tuple[float, ...]
    v: tuple[float, ...]
    omega: tuple[float, ...]
    restitution: float
    friction: float
    v_after: tuple[float, ...]
    omega_after: tuple[float, ...]

    @property
    def solid(self) -> Solid:
        """The body, in the axes of the plate."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return Solid(self.m_kg, 1e-9, 1e-12 * np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))

    @property
    def lever(self) -> Array:
        """The contact (3,) m from the centre of mass."""
        return 1e-3 * np.array(self.r_mm)

    @property
    def state(self) -> BodyState:
        """The state before, centre of mass at the origin."""
        return BodyState(np.zeros(3), np.eye(3), np.array(self.v), np.array(self.omega))


FULL_CASES = (
    ReferenceImpact(
        "slips throughout",
        6.48e-6,
        (1.95, 1.72, 1.78, 0.08, 0.15, 0.59),
        (0.132, 0.535, -0.854),
        (1.07, -1.4, -0.94),
        (218, 25, -120),
        0.63,
        0.3,
        (0.91001366252, -1.31684692778, -0.32064697990),
        (1535.489948389, 96.022915278, 96.988446276),
    ),
    ReferenceImpact(
        "sticks in compression",
        8.04e-6,
        (3.23, 1.95, 2.99, 0.34, 0.16, -0.89),
        (0.118, -0.671, -0.824),
        (-0.21, 0.26, -2.89),
        (-129, 89, 118),
        0.56,
        0.9,
        (-0.40242117809, 1.70011643063, 0.07746168662),
        (-2093.686828256, -315.287167573, 212.555219085),
    ),
    ReferenceImpact(
        "sticks in restitution",
        3.752e-5,
        (27.56, 27.55, 29.08, 0.17, -0.54, -0.52),
        (-0.055, -0.052, -1.317),
        (-1.25, -0.19, -1.52),
        (11, -230, 188),
        0.67,
        0.15,
        (-0.89547845254, -0.06394478788, 1.06730914762),
        (56.729540210, -672.207883314, 195.782119553),
    ),
    ReferenceImpact(
        "reversal along a ray",
        5.62e-6,
        (2.32, 0.79, 2.62, 0.76, -0.07, 0.16),
        (-0.677, 1.384, -0.829),
        (-0.18, -0.77, -1.71),
        (160, 178, -191),
        0.52,
        0.6,
        (-0.10253801945, -0.84072688800, -1.34502067723),
        (1098.990133937, 601.557570142, -319.033573926),
    ),
    ReferenceImpact(
        "jam, then stick",
        2.74e-6,
        (0.77, 0.53, 0.55, -0.17, -0.11, -0.32),
        (-0.203, -0.573, -1.289),
        (-1.3, -1.31, -1.19),
        (-233, -73, -8),
        0.8,
        1.2,
        (-0.78471172956, -0.02328080975, 1.51821254535),
        (-4.090941141, -671.303381543, -140.660260474),
    ),
)


@dataclass(frozen=True)
class EnergyRatio:
    """Kinetic energy after over before under Newton's, Poisson's and Stronge's restitution, without spin before.

    ``digits``: how many decimals each of the three is known to. ``u_after``: tangential (x) and normal velocity after, Stronge's, if known.
    """

    name: str
    solid: Solid
    lever: tuple[float, ...]
    v: tuple[float, ...]
    restitution: float
    friction: float
    ratios: tuple[float, ...]
    digits: tuple[int, ...]
    u_after: tuple[float, ...] = ()

    @property
    def state(self) -> BodyState:
        """The state before, centre of mass at the origin."""
        return BodyState(np.zeros(3), np.eye(3), np.array(self.v), np.zeros(3))


def _ellipsoid() -> tuple[Solid, tuple[float, ...]]:
    """Semi-axes 1.5, 0.6, 0.8 mm, long axis turned by +57° about y, and its lowest point; the mass does not matter for ratios."""
    axes = 1e-3 * np.array([1.5, 0.6, 0.8])
    R = Rotation.from_euler("y", 57, degrees=True).as_matrix()
    down = -R[2]
    lowest = R @ (axes**2 * down / np.linalg.norm(axes * down))
    squares = axes**2
    inertia = 0.2 * (R * (squares.sum() - squares)) @ R.T
    return Solid(1.0, 4.0 / 3.0 * np.pi * axes.prod(), 0.5 * (inertia + inertia.T)), tuple(lowest.tolist())


HALF = float(np.sqrt(0.5))
ROD = Solid(1.0, 1.0, np.eye(3) / 3.0)
ELLIPSOID, LOWEST = _ellipsoid()
ENERGY_RATIOS = (
    EnergyRatio("rod at 45°, μ 0.8", ROD, (HALF, 0, -HALF), (-0.5, 0, -1), 0.9, 0.8, (1.08, 0.873450, 0.901221429), (2, 6, 9)),
    EnergyRatio(
        "rod at 45°, μ 0.4",
        ROD,
        (HALF, 0, -HALF),
        (-0.5, 0, -1),
        0.9,
        0.4,
        (0.954836565, 0.833216, 0.859293584),
        (9, 6, 9),
        (0.293689931, 0.736021739),
    ),
    EnergyRatio("ellipsoid", ELLIPSOID, LOWEST, (-0.6, 0, -1), 0.95, 0.3, (1.067651, 0.878710, 0.907393), (6, 6, 6)),
)


@dataclass(frozen=True)
class ElasticSphere:
    """Two equal spheres, or a sphere on a rigid or elastic plane; e = 1, head on. SI units; ``approach_m_s`` is the relative speed.

    ``plate_young_pa`` infinite: rigid plane. Two equal spheres are the sphere of half the radius and half the mass on a plane of theirs.
    """

    name: str
    young_pa: float
    poisson: float
    mass_kg: float
    radius_m: float
    approach_m_s: float
    plate_young_pa: float
    plate_poisson: float
    depth_m: float
    force_n: float
    contact_s: float


def ball_clump(case: "ElasticSphere") -> Clump:
    """The sphere of a case as a clump of one."""
    moment = 0.4 * case.mass_kg * case.radius_m**2
    return Clump(Solid(case.mass_kg, 4.0 / 3.0 * np.pi * case.radius_m**3, moment * np.eye(3)), np.zeros((1, 3)), np.array([case.radius_m]))


def _ball(density: float, radius: float) -> float:
    return 4.0 / 3.0 * np.pi * density * radius**3


RIGID = float("inf")
ELASTIC_SPHERES = (
    ElasticSphere("1 glass, two spheres", 48e9, 0.2, _ball(2800, 0.01) / 2, 0.005, 20.0, 48e9, 0.2, 2.7411270e-4, 10696.889, 4.0339456e-5),
    ElasticSphere(
        "1 limestone, two spheres", 20e9, 0.25, _ball(2500, 0.01) / 2, 0.005, 20.0, 20e9, 0.25, 3.6830403e-4, 7108.2413, 5.4201005e-5
    ),
    ElasticSphere("2 aluminium, rigid plane", 70e9, 0.3, _ball(2699, 0.1), 0.1, 0.2, RIGID, 0.3, 4.9717175e-5, 11369.858, 7.3165664e-4),
    ElasticSphere("2 magnesium, rigid plane", 40e9, 0.35, _ball(1800, 0.1), 0.1, 0.2, RIGID, 0.3, 5.2123288e-5, 7232.6810, 7.6706591e-4),
    ElasticSphere(
        "3/4 alumina, rigid plane", 380e9, 0.23, _ball(4000, 2.5e-3), 2.5e-3, 3.9, RIGID, 0.3, 8.0888083e-6, 615.35157, 6.1045099e-6
    ),
    ElasticSphere("diamond on steel", 1143e9, 0.069, _ball(3515, 1e-3), 1e-3, 2.0, 210e9, 0.30, 2.4174358e-6, 30.452923, 3.5575894e-6),
)


@dataclass(frozen=True)
class ObliqueSphere:
    """Test 4: alumina of :data:`ELASTIC_SPHERES`, μ 0.092, e 1, 3.9 m/s at an angle from the normal; what comes out."""

    angle_deg: float
    tangential_ratio: float
    spin_rad_s: float


TEST_4_FRICTION = 0.092
TEST_4 = (
    ObliqueSphere(5, 0.955776, 15.0321),
    ObliqueSphere(10, 0.700769, 202.6478),
    ObliqueSphere(20, 0.619799, 507.1417),
    ObliqueSphere(25, 0.636752, 598.7093),
    ObliqueSphere(45, 0.816000, 507.4198),
)
CLAMPED_RESTITUTION = ((0.1, 0.25273), (0.5, 0.55028), (0.7, 0.71820), (0.9, 0.90203))
"""What the unclamped damping formula's e gives when the force is kept from pulling."""
