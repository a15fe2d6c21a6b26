"""The figures of a look, as rows of a table for people."""

import numpy as np
from numpy.typing import NDArray

from estimator.readiness import Inspection
from tumble.checking.findings import left_out, numbers_text

Row = tuple[str, str]


def rows_of(inspection: Inspection) -> list[Row]:
    """Name and text of every figure of one camera's recording."""
    seen = [frame for frame in inspection.track.frames if frame.seen]
    rows = [("frames used", f"{int(inspection.track.used.sum())} of {len(inspection.track)}")]
    rows += [(f"left out: {reason}", numbers_text(numbers)) for reason, numbers in left_out(inspection).items()]
    rows.append(("size", _spread(inspection.extent_px, "px", 1)))
    if any(np.isfinite(frame.contrast) for frame in seen):
        rows += [
            ("contrast (share of full scale)", _spread(np.array([frame.contrast for frame in seen]), "", 3)),
            ("noise of a pixel (share of the contrast)", _spread(np.array([frame.noise for frame in seen]), "", 4)),
            ("width of edges, 10-90%", _spread(np.array([frame.edge_width_px for frame in seen]), "px", 2)),
            ("noise of an outline's points", _spread(np.array([frame.sigma_px for frame in seen]), "px", 3)),
            ("pictures unlike their outlines (share of the contrast)", _spread(np.array([frame.misfit for frame in seen]), "", 3)),
            ("pixels at full scale", _spread(100.0 * inspection.saturated, "%", 2)),
        ]
    rows.append(("motion from frame to frame", _number(inspection.step_px, "px", 3)))
    if inspection.smear_px is not None:
        rows.append(("motion during an exposure", _number(inspection.smear_px, "px", 3)))
    if inspection.kinks:
        rows.append(("kinks of the path (impacts?) at frames", ", ".join(f"{kink:.1f}" for kink in inspection.kinks)))
        rows.append(
            (
                "longest flight between them",
                f"frames {inspection.free.frame[0]} to {inspection.free.frame[-1]}" if len(inspection.free.frame) else "none",
            )
        )
    rows.append(("centres from a parabola, RMS", _number(inspection.bend_px, "px", 4)))
    if inspection.times_s is not None and len(inspection.times_s) > 1:
        gap = float(np.median(np.diff(inspection.times_s)))
        lasts = 1e3 * float(inspection.times_s[-1] - inspection.times_s[0])
        rows.append(("time between frames", f"{1e6 * gap:.3f} us ({1 / gap:.6g} Hz), {lasts:.4g} ms in all"))
    return rows


def _spread(values: NDArray[np.float64], unit: str, digits: int) -> str:
    """Median and range of what is finite."""
    known = values[np.isfinite(values)]
    if len(known) == 0:
        return "none"
    low, middle, high = (f"{value:.{digits}f}" for value in (known.min(), np.median(known), known.max()))
    return f"{middle} {unit}".strip() + f" ({low} to {high})"


def _number(value: float, unit: str, digits: int) -> str:
    return f"{value:.{digits}f} {unit}" if np.isfinite(value) else "none"
