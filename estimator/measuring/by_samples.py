"""The last fit of one particle's motion: once more to every outline sample, from where tangents led and with the surface as an unknown."""

from collections.abc import Sequence
from dataclasses import replace

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.data.configuration import ALWAYS, Configuration
from estimator.data.fit_task import FitTask
from estimator.fitting.adequacy import misfit
from estimator.fitting.calibration_share import CalibrationShare, calibration_share
from estimator.fitting.problem import Fact, M
from estimator.fitting.refinement import Refined
from estimator.fitting.weighed_tangencies import linearise
from estimator.motion.flight import Motion
from estimator.motion.rigid_body import RanAway
from estimator.particle.particle import Particle
from estimator.search.candidate_flights import MOST_MEAN_SQUARE
from estimator.search.rival_flights import few_views
from estimator.surface.calibration import calibration_share_of
from estimator.surface.joint import JointFit, beside_the_surface, joint_fit
from estimator.surface.told import LEFT, is_noisy, noisy_sentence, surface_sentence, surface_statistics

OF_TANGENTS = "the estimate is that of tangents."
NO_SURFACE = (
    "the calibrated views disagree, and no surface meets them, however each is moved, beside the frames of this flight: its poses may be "
    "wrong ones that meet the tangents by chance; more views, or a better calibration, would decide."
)


def left_out(configuration: Configuration) -> str | None:
    """Why a flight is not fitted to all outline samples, in words; ``None`` where it is. Nothing to say where that is not asked for."""
    if not configuration.surface_fit:
        return ""
    if configuration.focal_prior > 0.0:
        return f"the focal length is measured; {OF_TANGENTS}"
    return None


def left_out_beside_contacts(particle: Particle, configuration: Configuration) -> str | None:
    """The same of flights with impacts and of pairs, which have not been measured where few views show the particle."""
    if 0 < configuration.surface_fit < ALWAYS and few_views(particle):
        return f"fits to all outline samples were not measured beside contacts with {len(particle.calibrated)} views; {OF_TANGENTS}"
    return left_out(configuration)


def on_all_samples(
    led: Refined[M], task: FitTask, particle: Particle, configuration: Configuration, facts: Sequence[Fact[M]] = ()
) -> tuple[JointFit[M] | None, str]:
    """The motion fitted once more, to every outline sample and with the surface as an unknown; ``facts``: what else is known of it.

    ``None`` where the tangents that ``led`` there do not fit, or where no surface is found, and what to remark. What a motion lacks is
    alike along outlines and from picture to picture, as noise may be, and a fit that finds how large noise is takes it for that. Tangents
    know beforehand how noisy they are: where they show slow errors and the fit is noisy, they have the last word.
    """
    if led.noise.mean_square > MOST_MEAN_SQUARE:
        return None, ""
    huber, seed = configuration.huber, configuration.seed
    try:
        joint = joint_fit(particle, task.sightings, led.flight, beside_the_surface(task.prior, facts), huber=huber, seed=seed)
    except RanAway:
        return None, f"{LEFT}; {OF_TANGENTS}"
    missed = surface_sentence(joint) if joint.settled else "The fit to all outline samples did not settle"
    if not missed and is_noisy(joint) and _shows_slow_errors(led, facts):
        missed = "The fit to all outline samples takes for noise what tangents do not fit"
    return (None, f"{missed}; {OF_TANGENTS}") if missed else (joint, noisy_sentence(joint))


def _shows_slow_errors(led: Refined[M], facts: Sequence[Fact[M]]) -> bool:
    tangents = misfit(led, facts)
    return tangents is not None and tangents.slowly_off


def with_joint(refined: Refined[M], joint: JointFit[M]) -> Refined[M]:
    """The motion of the joint fit in place of the refined one; its tangency errors are those there."""
    at = linearise(refined.at.task, joint.motion, refined.at.settings)
    return replace(refined, flight=joint.motion, covariance=joint.covariance, bound=joint.bound, settled=joint.settled, at=at)


def unless_left(judged: tuple[Status, str], particle: Particle, remark: str) -> tuple[Status, str]:
    """What was ``judged``, unless no surface meets views that disagree, however they are moved: that a wrong pose would explain, too."""
    if judged[0] in (Status.CONVERGED, Status.SECOND_CONTACT) and particle.disagreement.beyond_noise and remark.startswith(LEFT):
        return Status.AMBIGUOUS, NO_SURFACE
    return judged


def share_of(refined: Refined[M], joint: JointFit[M] | None, task: FitTask, stated: Observation) -> CalibrationShare | None:
    """What the stated calibration adds to the uncertainty of the motion that has the last word."""
    if joint is None:
        return calibration_share(refined.flight, refined.at, refined.inverse, stated)
    return calibration_share_of(joint, task, stated)


def with_surface(estimate: Estimate, joint: JointFit[Motion] | None, remark: str, *, said: str | None = None) -> Estimate:
    """The estimate with what the fit says of its surface, and what is to ``remark`` of it; ``said``: why it was :func:`left_out`."""
    estimate = replace(estimate, message=" ".join(part for part in (estimate.message, remark) if part))
    if joint is None:
        return replace(estimate, statistics={**estimate.statistics, "surface_left_out": said}) if said else estimate
    surface = SurfaceMesh(joint.surface.vertices, joint.surface.sphere.mesh.faces)
    return replace(estimate, statistics={**estimate.statistics, "surface": surface_statistics(joint)}, surface=surface)
