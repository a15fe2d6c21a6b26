"""What the calibrated views, the clock and gravity say together, before any fit: pair errors, the fall, and the promised accuracy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from datasets.errors import InputError
from datasets.observation import Observation
from estimator.data.configuration import Configuration
from estimator.impacts.impact_search import wobble_of
from estimator.outlines.behind_plate import beside_plate
from estimator.outlines.recording import view_outlines_of
from estimator.outlines.result import OutlineTrack
from estimator.particle.particle import Particle, particle_of
from estimator.readiness import Fall, Inspection, Promise, depth_of, fall_of, promise_of
from tumble.checking.findings import Finding
from tumble.checking.table import Row

ODD_FALL = 3.0
"""Standard deviations by which a fall may differ from the stated gravity; three is chance in one of 370."""
LARGE_ETE_PX = 1.5
"""Error of pairs up to which the paper found its velocities right in most cases."""


@dataclass(frozen=True)
class Geometry:
    """Figures and findings of an observation's views, and the promise where one can be made.

    ``views``: the outlines of the calibrated views; ``errors_px``: RMS ETE of each against the others, by its number.
    """

    rows: tuple[Row, ...]
    findings: tuple[Finding, ...]
    views: OutlineTrack | None = None
    errors_px: Mapping[int, float] = field(default_factory=dict)


def geometry_of(observation: Observation, inspections: Sequence[Inspection]) -> Geometry:
    """What views, clock and gravity say; ``looks``: at every camera.

    Views that do not belong together are a finding, not an error.
    """
    if not observation.views:
        return Geometry((("calibrated views", "none"),), (Finding(True, "there are no calibrated views: nothing can be measured."),))
    configuration = Configuration()
    try:
        views = view_outlines_of(observation.view_recording, observation.views, name=f"{observation.name}, calibrated views")
        particle = particle_of(views.outlines, observation.views, configuration, observation.made)
    except InputError as error:
        return Geometry((("calibrated views", str(len(observation.views))),), (Finding(True, str(error)),))
    rows, findings = _views(particle, len(observation.views))
    errors = dict(zip(particle.report.numbers.tolist(), particle.report.rms_px.tolist(), strict=True))
    inspection = inspections[0]
    if observation.companion is not None or len(inspection.path.frame) == 0:
        return Geometry(tuple(rows), tuple(findings), views, errors)
    depth = depth_of(particle, inspection, observation.cameras[0].intrinsics)
    rows.append(("distance, from the outlines' size", f"{depth:.4g} m"))
    wobble = wobble_of(particle, np.random.default_rng(configuration.seed))
    fall = fall_of(inspection, observation.cameras[0], observation.gravity_world, depth_m=depth, wobble_m=wobble)
    if fall is not None:
        rows.append(("the centre falls with, of the stated gravity", f"{fall.share:.2f} ± {fall.sigma:.2f}"))
        findings += _odd_fall(fall)
    tracks = tuple(beside_plate(each.track, observation, number) for number, each in enumerate(inspections))
    promise = promise_of(observation, tracks, inspection, particle, configuration)
    return Geometry((*rows, *_promised(promise)), tuple(findings), views, errors)


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
