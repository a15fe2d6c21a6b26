"""A bar that falls nearly flat on a plate: its other end follows, at a time that is known."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from datasets.vocabulary.plate import Plate
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.contact.solid import BodyState, SolidHull, solid_hull_of
from estimator.contact_validation.contacts import nominal
from estimator.contact_validation.laws.point_contact import PointContact
from estimator.contact_validation.measured import MeasuredImpact
from estimator.contact_validation.next_contacts import TOGETHER_S, next_contacts, shared_by_corners
from estimator.contact_validation.spread import draws_of, predicted_covariance
from estimator.contact_validation.validate import Question, single_contacts, validate
from tests.estimator.contact_validation.made_impacts import SIGMAS, made_impacts

LAW = PointContact(0.6, 0.15)
HALF_LENGTH_M, SPEED_MS = 3e-3, 1.5


def bar() -> SolidHull:
    """A double pyramid of 6 mm: its two tips lie on its axis."""
    points = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 0.3, 0], [0, -0.3, 0], [0, 0, 0.3], [0, 0, -0.3]]) * HALF_LENGTH_M
    hull = trimesh.convex.convex_hull(points)
    return solid_hull_of(SurfaceMesh(np.asarray(hull.vertices), np.asarray(hull.faces)), 2650.0)


def falling(slope_deg: float, corner_sigma_m: float = 1e-6, name: str = "bar-e00-r00") -> MeasuredImpact:
    """A bar (without its waist) whose axis makes ``slope_deg`` with a level plate, that falls without spin."""
    particle = bar()
    tips = SolidHull(particle.solid, particle.vertices_body[np.abs(particle.vertices_body[:, 0]) > 0.9 * HALF_LENGTH_M])
    R = Rotation.from_euler("z", slope_deg, degrees=True).as_matrix()
    plate = Plate(np.zeros(3), np.array([0.0, -1.0, 0.0]))
    state = BodyState(np.zeros(3), R, np.array([0.05, SPEED_MS, 0.0]), np.zeros(3))
    rebounding = np.array([0.02, -0.7, 0.01, 30.0, 20.0, -50.0])
    return MeasuredImpact(name, "bar-e00", 0, state, rebounding, np.diag(SIGMAS**2), plate, tips, corner_sigma_m)


def test_the_other_end_follows_when_it_should() -> None:
    impact = falling(0.5)
    first = nominal([impact])
    after = LAW.after_contacts(first)
    followed = next_contacts(first, after, impact.low_corners[None], impact.extent_m)
    clearance = 2.0 * HALF_LENGTH_M * np.sin(np.deg2rad(0.5))
    other = -first.lever[0]
    sinking = -(after[0, :3] + np.cross(after[0, 3:], other)) @ impact.plate.normal_world
    turned = float(np.linalg.norm(after[0, 3:])) * clearance / sinking
    assert followed.struck.tolist() == [True]
    np.testing.assert_allclose(followed.contacts.lever[0], Rotation.from_rotvec(after[0, 3:] * clearance / sinking).apply(other), atol=1e-5)
    assert turned < 0.1
    np.testing.assert_allclose(followed.contacts.v[0], after[0, :3])


def test_an_end_that_comes_later_is_another_impact() -> None:
    impact = falling(20.0)
    assert not shared_by_corners([impact], LAW)[0]
    assert shared_by_corners([falling(0.5)], LAW)[0]


def test_what_may_follow_is_uncertain() -> None:
    """A bar whose other end follows by half of the draws' corners is predicted less surely than one that cannot."""
    slope = next(s for s in np.arange(10.0, 20.0, 0.25) if not shared_by_corners([falling(s)], LAW)[0])
    rng = np.random.default_rng(0)
    edge, clear = (falling(s, corner_sigma_m=3e-5) for s in (slope, slope + 10.0))
    near, far = (np.sqrt(predicted_covariance(i, LAW, draws_of(i, rng))[1, 1]) for i in (edge, clear))
    assert near > 3.0 * far


def test_models_are_not_judged_by_impacts_that_corners_share_and_nothing_is_missing_in_the_others() -> None:
    single = made_impacts(LAW, 5, 31)
    found = validate([*single, falling(0.5, name="flat-e00-r00")], Question(models=("stronge_impulse",)), lambda _: None)
    assert found.shared == ("flat-e00-r00",)
    assert found.spread.shape == (5, 6)
    assert len(found.impacts) == 5
    assert len(found.maps) == 12
    assert found.verdict.kind == "nothing missing"
    assert found.ladder.missing == ()
    assert len(found.contacts) == 6
    assert any("flat-e00-r00" in remark and f"{1e3 * TOGETHER_S:g} ms" in remark for remark in found.verdict.remarks)


def test_all_are_kept_where_too_few_are_single() -> None:
    flat = [falling(0.5, name=f"flat-e00-r0{k}") for k in range(4)]
    impacts, shared = single_contacts([*made_impacts(LAW, 2, 32), *flat], 0)
    assert shared == ()
    assert len(impacts) == 6
