"""Estimates made from the truth, so that the application can be tested without an estimator."""

import numpy as np

from datasets.estimate import Estimate, FrameReport, Status, VelocityEstimate
from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, Recipe, RigRecipe
from datasets.truth import Truth

CAMPAIGN_OF_A_SET = """
[[campaigns]]
name = "drag"
measured = "positions"
seed = 13
flights = 3
rows = 30
hidden = { quadratic_drag = { per_length = 0.5 } }
"""


def small_recipe(*, sequences: int = 1, frames: int = 6, drops: int = 1) -> Recipe:
    return Recipe(name="small", seed=3, sequences=sequences, motion=MotionRecipe(frames=frames), rig=RigRecipe(drops=drops))


def velocity_at(truth: Truth, index: int, *, off: float) -> VelocityEstimate:
    covariance = np.diag([1e-3, 1e-3, 2e-3, 0.1, 0.2, 0.3]) ** 2
    shift = off * np.sqrt(np.diag(covariance))
    motion = truth.motion
    return VelocityEstimate(
        float(motion.times_s[index]), motion.v_world[index] + shift[:3], motion.omega_world[index] + shift[3:], covariance, covariance / 2
    )


def made_up_estimate(observation: Observation, truth: Truth, *, status: Status = Status.CONVERGED, off: float = 0.5) -> Estimate:
    count = len(truth.motion.times_s)
    frames = tuple(
        FrameReport(0, k, k != 2, "" if k != 2 else "cut off by the picture's edge", 0.21 + 0.01 * k, 1.0 + 0.02 * k) for k in range(count)
    )
    return Estimate(
        name=observation.name,
        status=status,
        message="",
        body=truth.body,
        motion=truth.motion,
        start=velocity_at(truth, 0, off=off),
        middle=velocity_at(truth, count // 2, off=off),
        parameters=("v_x", "v_y"),
        values=np.array([1.25, -0.5]),
        covariance=np.diag([1e-6, 4e-6]),
        bound=np.diag([1e-6, 4e-6]),
        frames=frames,
        statistics={"starts": 12, "competing_minima": [{"rms_ete_px": 0.2, "apart_deg": 0.0}, {"rms_ete_px": 0.9, "apart_deg": 171.5}]},
        configuration={"pose": {"starts": 100}, "robust": True},
        versions={"numpy": np.__version__},
    )
