"""Everything that a check says of one recording, and where it comes from."""

from dataclasses import dataclass, replace
from typing import Any

from datasets.observation import Observation, Recording
from estimator.readiness import Inspection, inspect_recording
from tumble.checking.findings import Finding, findings_of
from tumble.checking.geometry import Geometry, geometry_of
from tumble.checking.table import Row, rows_of
from tumble.importing.request import Missing, Value


@dataclass(frozen=True)
class CameraCheck:
    """One camera: its recording, what was seen, the figures and what speaks against it."""

    name: str
    recording: Recording
    inspection: Inspection
    rows: tuple[Row, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class Check:
    """A recording's check; ``geometry``: what views, clock and gravity say together, where they are known.

    ``values``, ``missing``, ``remarks``: what an import knows; nothing for an observation that is there.
    """

    name: str
    cameras: tuple[CameraCheck, ...]
    geometry: Geometry | None = None
    values: tuple[Value, ...] = ()
    missing: tuple[Missing, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of all cameras, those that are bad first."""
        found = [finding for camera in self.cameras for finding in camera.findings]
        found += self.geometry.findings if self.geometry is not None else ()
        return tuple(sorted(found, key=lambda finding: not finding.bad))

    @property
    def good(self) -> bool:
        """Whether nothing speaks against a measurement."""
        return not any(finding.bad for finding in self.findings)


def camera_check(name: str, recording: Recording, inspection: Inspection) -> CameraCheck:
    """The check of one camera from its look."""
    return CameraCheck(name, recording, inspection, tuple(rows_of(inspection)), findings_of(inspection))


def check_observation(observation: Observation) -> Check:
    """Check an observation.

    Raises
    ------
    datasets.errors.InputError
        Where a picture is damaged.
    """
    cameras = []
    for camera, recording, clock in zip(observation.cameras, observation.recordings, observation.clocks, strict=True):
        size = (camera.intrinsics.width_px, camera.intrinsics.height_px)
        name = f"{observation.name}, camera {camera.name}"
        inspection = inspect_recording(recording, size, times_s=clock.times_s, exposure_s=clock.exposure_s, name=name)
        if observation.companion is not None:
            inspection = replace(inspection, odd_steps=())  # which of two particles an outline is of changes from frame to frame
        cameras.append(camera_check(camera.name, recording, inspection))
    return Check(observation.name, tuple(cameras), geometry_of(observation, [each.inspection for each in cameras]))


def plain_check(check: Check) -> dict[str, Any]:
    """A check as JSON-compatible values: figures by camera, what speaks against it, and where values are from."""
    return {
        "name": check.name,
        "good": check.good,
        "figures": {
            **{f"camera {camera.name}": dict(camera.rows) for camera in check.cameras},
            **({} if check.geometry is None else {"geometry": dict(check.geometry.rows)}),
        },
        "findings": [{"bad": finding.bad, "sentence": finding.sentence} for finding in check.findings],
        "remarks": list(check.remarks),
        "values": [{"name": v.name, "value": v.shown, "origin": v.origin.value, "note": v.note} for v in check.values],
    }
