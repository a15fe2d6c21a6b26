"""The last fit of one particle's motion: once more to every outline sample, from where tangents led and with the surface as an unknown."""

from collections.abc import Sequence
from dataclasses import replace

from datasets.estimate import Estimate
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask
from estimator.fitting.problem import Fact, M
from estimator.fitting.refinement import Refined
from estimator.fitting.weighed_tangencies import linearise
from estimator.motion.flight import Motion
from estimator.particle.particle import Particle
from estimator.surface.joint import JointFit, beside_the_surface, joint_fit
from estimator.surface.told import surface_sentence, surface_statistics


def on_all_samples(
    motion: M, task: FitTask, particle: Particle, configuration: Configuration, facts: Sequence[Fact[M]] = ()
) -> JointFit[M]:
    """The motion fitted once more, to every outline sample and with the surface as an unknown; ``facts``: what else is known of it."""
    huber, seed = configuration.huber, configuration.seed
    return joint_fit(particle, task.sightings, motion, beside_the_surface(task.prior, facts), huber=huber, seed=seed)


def with_joint(refined: Refined[M], joint: JointFit[M]) -> Refined[M]:
    """The motion of the joint fit in place of the refined one; its tangency errors are those there."""
    at = linearise(refined.at.task, joint.motion, refined.at.settings)
    return replace(refined, flight=joint.motion, covariance=joint.covariance, bound=joint.bound, settled=joint.settled, at=at)


def with_surface(estimate: Estimate, joint: JointFit[Motion]) -> Estimate:
    """The estimate with what the fit says of its surface."""
    message = " ".join(part for part in (estimate.message, surface_sentence(joint)) if part)
    return replace(estimate, message=message, statistics={**estimate.statistics, "surface": surface_statistics(joint)})
