"""What the calibrated views, the clock and gravity say together, before any fit: pair errors, the fall, and the promised accuracy."""

from dataclasses import dataclass

import numpy as np

from datasets.errors import InputError
from datasets.observation import Observation
from estimator.configuration import Configuration
from estimator.particle import Particle
from estimator.pipeline import observed_particle, tracks_of
from estimator.readiness import Fall, Look, Promise, depth_of, fall_of, promise_of, wobble_of
from tumble.checking.findings import Finding
from tumble.checking.table import Row

ODD_FALL = 3.0
"""Standard deviations by which a fall may differ from the stated gravity; three is chance in one of 370."""
LARGE_ETE_PX = 1.5
"""Error of pairs up to which the paper found its velocities right in most cases."""


@dataclass(frozen=True)
class Geometry:
    """Figures and findings of an observation's views, and the promise where one can be made."""

    rows: tuple[Row, ...]
    findings: tuple[Finding, ...]


def geometry_of(observation: Observation, look: Look) -> Geometry:
    """What views, clock and gravity say; ``look`` is that at the first camera.

    Views that do not belong together are a finding, not an error.
    """
    if not observation.views:
        return Geometry((("calibrated views", "none"),), (Finding(True, "there are no calibrated views: nothing can be measured."),))
    configuration = Configuration()
    try:
        particle = observed_particle(observation, configuration)
    except InputError as error:
        return Geometry((("calibrated views", str(len(observation.views))),), (Finding(True, str(error)),))
    rows, findings = _views(particle, len(observation.views))
    if observation.companion is not None or len(look.path.frame) == 0:
        return Geometry(tuple(rows), tuple(findings))
    depth = depth_of(particle, look, observation.cameras[0].intrinsics)
    rows.append(("distance, from the outlines' size", f"{depth:.4g} m"))
    wobble = wobble_of(particle, np.random.default_rng(configuration.seed))
    fall = fall_of(look, observation.cameras[0], observation.gravity_world, depth_m=depth, wobble_m=wobble)
    if fall is not None:
        rows.append(("the centre falls with, of the stated gravity", f"{fall.share:.2f} ± {fall.sigma:.2f}"))
        findings += _odd_fall(fall)
    promise = promise_of(observation, tracks_of(observation), look, particle, configuration)
    return Geometry((*rows, *_promised(promise)), tuple(findings))


def _views(particle: Particle, count: int) -> tuple[list[Row], list[Finding]]:
    among = particle.disagreement
    worst = int(np.argmax(particle.report.rms_px))
    rows = [
        ("calibrated views used", f"{len(particle.calibrated)} of {count}"),
        ("pair errors of views (ETE), RMS", f"{among.rms_px:.3f} px; the outlines' noise explains {among.expected_px:.3f} px"),
        ("the view that fits worst", f"{int(particle.report.numbers[worst])} ({particle.report.rms_px[worst]:.2f} px)"),
        ("particle's largest extent", f"{1e3 * particle.extent_m:.3f} mm"),
    ]
    said = particle.sentence
    bad = among.rms_px > LARGE_ETE_PX or len(particle.calibrated) < count
    return rows, [Finding(bad, f"{said[0].upper()}{said[1:]}")] if said else []


def _odd_fall(fall: Fall) -> list[Finding]:
    """The fall is not that of the stated gravity: which frame rate would make it so, or gravity turned round."""
    if abs(fall.share - 1.0) < ODD_FALL * fall.sigma:
        return []
    if fall.share > 0.0:
        cause = f"the times would have to be {np.sqrt(fall.share):.2g} times as long as they are stated (a wrong frame rate)"
    else:
        cause = "it falls against it (gravity's sign, or rows counted upwards)"
    return [
        Finding(
            True,
            f"the centre falls with {fall.share:.2f} ± {fall.sigma:.2f} of the stated gravity: {cause}, or focal length, gravity or the "
            "particle's size is wrong, or it does not fly freely.",
        )
    ]


def _promised(promise: Promise | None) -> list[Row]:
    if promise is None:
        return []
    across = float(np.sqrt(np.mean(promise.v_ms[:2] ** 2)))
    omega = float(np.sqrt(np.mean(promise.omega_rads**2)))
    return [
        ("promised: v across the picture", f"± {1e3 * across:.2g} mm/s (it moves at {promise.speed_ms:.3g} m/s)"),
        ("promised: v in depth", f"± {1e3 * float(promise.v_ms[2]):.2g} mm/s"),
        ("promised: each component of omega", f"± {omega:.2g} rad/s (taken to spin at {promise.turn_rads:.3g} rad/s)"),
    ]
