"""Bodies, plates and motions as plain entries of documents and arrays of files."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from datasets.vocabulary.plate import Plate
from datasets.vocabulary.state import Motion

Array = NDArray[np.float64]

MOTION_FIELDS = {"times_s": (), "x_world": (3,), "q_world_body": (4,), "v_world": (3,), "omega_world": (3,)}
"""The arrays of a motion and the shape of each per frame."""


def array(value: Any, tail: tuple[int, ...] = ()) -> Array:
    """``value`` as float64 of shape (n, *tail); the strings for NaN and infinities become those."""
    return np.array(value, dtype=np.float64).reshape(-1, *tail)


def square(value: Any) -> Array:
    """``value`` as a square float64 matrix, (0, 0) when empty."""
    flat = np.array(value, dtype=np.float64)
    return flat.reshape(len(value), len(value))


def body_entry(body: Body) -> dict[str, Any]:
    """A body as an entry of a document."""
    return {"com_particle": body.com_particle, "R_particle_body": body.R_particle_body, "inertia_ratios": body.inertia_ratios}


def body(entry: dict[str, Any]) -> Body:
    """The inverse of :func:`body_entry`."""
    return Body(array(entry["com_particle"]), array(entry["R_particle_body"], (3,)), array(entry["inertia_ratios"]))


def plate_entry(plate: Plate) -> dict[str, Any]:
    """A plate as an entry of a document."""
    return {
        "point_world": plate.point_world,
        "normal_world": plate.normal_world,
        "velocity_world": plate.velocity_world,
        "normal_sigma_rad": plate.normal_sigma_rad,
        "offset_sigma_m": plate.offset_sigma_m,
    }


def plate(entry: dict[str, Any]) -> Plate:
    """The inverse of :func:`plate_entry`; a plate stands still and is known exactly where it does not say otherwise."""
    return Plate(
        array(entry["point_world"]),
        array(entry["normal_world"]),
        array(entry.get("velocity_world", (0, 0, 0))),
        float(entry.get("normal_sigma_rad", 0)),
        float(entry.get("offset_sigma_m", 0)),
    )


def motion_arrays(motion: Motion) -> dict[str, Array]:
    """A motion as named arrays."""
    return {name: np.asarray(getattr(motion, name), dtype=np.float64) for name in MOTION_FIELDS}


def motion(arrays: dict[str, Any]) -> Motion:
    """The inverse of :func:`motion_arrays`, from arrays or nested lists."""
    return Motion(**{name: array(arrays[name], tail) for name, tail in MOTION_FIELDS.items()})


@np.errstate(all="ignore")  # what overflows is refused by its size
def motion_fault(arrays: dict[str, Any]) -> str | None:
    """What is wrong with the arrays of a motion, as expected and came, or ``None``."""
    count = len(arrays["times_s"])
    for name, tail in MOTION_FIELDS.items():
        came = np.shape(arrays[name])
        if came != (count, *tail):
            return f"expected {name} of shape {(count, *tail)}, got {came}"
        if not np.all(np.isfinite(arrays[name])):
            return f"expected finite numbers in {name}, got NaN or infinity"
    if not np.all(np.diff(arrays["times_s"]) > 0):
        return "expected times_s that rise, got times that do not"
    norms = np.linalg.norm(np.reshape(arrays["q_world_body"], (-1, 4)), axis=1)
    if not np.all(np.abs(norms - 1) <= 1e-6):
        return f"expected unit quaternions in q_world_body, got one of length {norms[np.argmax(np.abs(norms - 1))]:.6g}"
    return None
