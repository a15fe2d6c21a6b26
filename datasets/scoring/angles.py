"""Angles between orientations, exact at equality, and up to the symmetries of a body.

The angle between R_a and R_b is ``2 arcsin(|R_a - R_b|_F / (2 sqrt 2))`` (chordal distance [Hartley et al. 2013, Int. J. Comput.
Vision 103, sec. 4.2]). Unlike the form by the trace it is exactly zero for equal matrices and accurate for small angles; near 180
degrees it loses half of the digits, which no score notices.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.vocabulary.body import Body
from datasets.vocabulary.state import Motion


def rotation_angle(
    R_a: Float[NDArray[np.float64], "*batch 3 3"], R_b: Float[NDArray[np.float64], "*batch 3 3"]
) -> Float[NDArray[np.float64], "*batch"]:
    """Angle (rad, in [0, pi]) between two orientations."""
    chord = np.linalg.norm(R_a - R_b, axis=(-2, -1))
    return np.asarray(2 * np.arcsin(np.clip(chord / (2 * np.sqrt(2)), 0, 1)), dtype=np.float64)


def particle_orientation(motion: Motion, body: Body) -> Float[NDArray[np.float64], "frame 3 3"]:
    """``R_world_particle`` per frame: independent of how the principal axes were named or signed."""
    return np.asarray(Rotation.from_quat(motion.q_world_body).as_matrix() @ body.R_particle_body.T, dtype=np.float64)


def angles_up_to_symmetry(
    R_estimate: Float[NDArray[np.float64], "frame 3 3"],
    R_truth: Float[NDArray[np.float64], "frame 3 3"],
    symmetries: Float[NDArray[np.float64], "symmetry 3 3"],
) -> Float[NDArray[np.float64], " frame"]:
    """Angle (rad) per frame between two particle orientations, for the one symmetry that fits the whole sequence best.

    One symmetry for all frames, since a rigid body cannot change from one to another on its way. The identity is tried without a
    product, so that rounding in the given symmetries cannot make equal orientations differ.
    """
    alternatives = np.array([rotation_angle(R_estimate, R) for R in (R_truth, *(R_truth @ S for S in symmetries))])
    best: NDArray[np.float64] = alternatives[np.argmin(np.median(alternatives, axis=1))]
    return best
