"""What one sequence consists of before anything is observed: the particle, the rig, the camera, the flight."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.observation import CalibratedView
from datasets.truth import Impact, Remnant
from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.state import Motion
from synth.contact.chipping import Chip
from synth.effects import EffectsInForce
from synth.plate_setting import PlateSetting

Array = NDArray[np.float64]


class Flight(Protocol):
    """A motion known at every instant, for sub-frames of an exposure as well as for frame times."""

    def at(self, times_s: Float[NDArray[np.float64], " n"]) -> Motion:
        """The motion at ``times_s`` (s), which may lie half an exposure outside the frame times."""
        ...


@dataclass(frozen=True)
class SequencePlan:
    """Everything that decides one sequence, noise apart; both tiers are made from it.

    ``vertices`` (v, 3) m in the particle frame, ``faces`` (f, 3) outward. ``inertia_kgm2`` (3,) principal moments, ascending.
    ``motion`` is ``flight`` at ``true_times_s``, under the time stamps of ``clock``. ``gravity_world`` (3,) m/s². ``symmetries``
    (s, 3, 3) in the particle frame, about the centre of mass of the uniform body.

    ``stated_views``, ``hsv``, ``clock`` and ``gravity_world`` are what the observation states; the calibrated views were taken where
    ``views`` are. Where ``effects`` are in force, nature differs:
    frames are taken at ``true_times_s`` (frame,) s with ``true_camera``; ``vertices``, ``body``, mass and moments are those of the
    body that flies, ``view_vertices`` (v, 3) m those that the calibrated views show.

    ``further``: the same sequence as each further high-speed camera films it, with camera, clock, times, motion and effects of its own.
    ``clock_error``: offset (s) and rate by which the clock of such a camera is off.

    ``setting``: the plate, where there is one; ``impacts`` on it; ``hidden_in_contact``: its physics
    besides the plain law; ``remnant``: what is left where the particle broke, and the ``chip`` that is not.
    """

    name: str
    vertices: Float[NDArray[np.float64], "v 3"]
    view_vertices: Float[NDArray[np.float64], "v 3"]
    faces: NDArray[np.int64]
    body: Body
    mass_kg: float
    inertia_kgm2: Float[NDArray[np.float64], "3"]
    material: str
    views: tuple[CalibratedView, ...]
    stated_views: tuple[CalibratedView, ...]
    hsv: HsvCamera
    true_camera: Intrinsics
    clock: Clock
    true_times_s: Float[NDArray[np.float64], " frame"]
    motion: Motion
    flight: Flight
    gravity_world: Float[NDArray[np.float64], "3"]
    symmetries: Float[NDArray[np.float64], "s 3 3"]
    descriptors: dict[str, float] = field(default_factory=dict)
    effects: EffectsInForce = field(default_factory=EffectsInForce)
    setting: PlateSetting | None = None
    impacts: tuple[Impact, ...] = ()
    hidden_in_contact: dict[str, dict[str, float]] = field(default_factory=dict)
    remnant: Remnant | None = None
    chip: Chip | None = None
    particle_name: str = ""
    notes: dict[str, str | int] = field(default_factory=dict)
    further: tuple["SequencePlan", ...] = ()
    clock_error: tuple[float, float] = (0.0, 0.0)

    @property
    def by_camera(self) -> tuple["SequencePlan", ...]:
        """The plan as each high-speed camera films it."""
        return (self, *self.further)


def particle_poses_in_camera(
    body: Body, motion: Motion, camera: HsvCamera
) -> tuple[Float[NDArray[np.float64], "frame 3 3"], Float[NDArray[np.float64], "frame 3"]]:
    """``R_cam_particle``, ``t_cam_particle`` (m) of every time of ``motion``: particle coordinates to camera coordinates."""
    R_world_particle = Rotation.from_quat(motion.q_world_body).as_matrix() @ body.R_particle_body.T
    t_world_particle = motion.x_world - R_world_particle @ body.com_particle
    R_cam_particle = camera.R_cam_world @ R_world_particle
    return R_cam_particle, t_world_particle @ camera.R_cam_world.T + camera.t_cam_world
