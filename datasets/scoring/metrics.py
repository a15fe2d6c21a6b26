"""What is scored: every metric with its unit, the direction that is better, a tolerance and its meaning.

The velocity metrics exist at two instants, ``middle`` and ``start`` of the sequence; keys begin with the instant. ``tolerance`` is
the error, in the metric's unit, that a single sequence may have and still count as good.
"""

from dataclasses import dataclass
from typing import Literal

INSTANTS = ("middle", "start")
COMPONENTS = ("vx", "vy", "vz", "wx", "wy", "wz")
"""Linear velocity (m/s) and angular velocity (rad/s) in the world frame, in the order of their covariance."""


@dataclass(frozen=True)
class Metric:
    """One column of the table of scores.

    ``components`` are those whose 95% intervals stand behind the metric.
    """

    key: str
    unit: str
    direction: Literal["lower", "higher"]
    tolerance: float
    meaning: str
    components: tuple[str, ...] = ()


METRICS = (
    Metric("middle_in_plane_ms", "m/s", "lower", 0.01, "error of (vx, vy) at mid-sequence", components=("vx", "vy")),
    Metric("middle_out_of_plane_ms", "m/s", "lower", 0.02, "error of vz at mid-sequence", components=("vz",)),
    Metric("middle_angular_rads", "rad/s", "lower", 1.5, "error of omega at mid-sequence", components=("wx", "wy", "wz")),
    Metric("middle_in_plane_percent", "%", "lower", 0.5, "error of (vx, vy) by the true speed, mid-sequence", ("vx", "vy")),
    Metric("middle_out_of_plane_percent", "%", "lower", 1.0, "error of vz by the true speed, mid-sequence", ("vz",)),
    Metric("middle_angular_percent", "%", "lower", 1.0, "error of omega by the true spin, mid-sequence", ("wx", "wy", "wz")),
    Metric("start_in_plane_ms", "m/s", "lower", 0.01, "error of (vx, vy) at the start", components=("vx", "vy")),
    Metric("start_out_of_plane_ms", "m/s", "lower", 0.02, "error of vz at the start", components=("vz",)),
    Metric("start_angular_rads", "rad/s", "lower", 1.5, "error of omega at the start", components=("wx", "wy", "wz")),
    Metric("start_in_plane_percent", "%", "lower", 0.5, "error of (vx, vy) by the true speed, start", ("vx", "vy")),
    Metric("start_out_of_plane_percent", "%", "lower", 1.0, "error of vz by the true speed, start", ("vz",)),
    Metric("start_angular_percent", "%", "lower", 1.0, "error of omega by the true spin, start", ("wx", "wy", "wz")),
    Metric("orientation_median_deg", "deg", "lower", 5.0, "geodesic angle to the true orientation, median over frames"),
    Metric("orientation_max_deg", "deg", "lower", 5.0, "geodesic angle to the true orientation, worst frame"),
    Metric("position_median_mm", "mm", "lower", 1.0, "distance to the true centre of mass, median over frames"),
    Metric("position_max_mm", "mm", "lower", 1.0, "distance to the true centre of mass, worst frame"),
    Metric("middle_mahalanobis2", "1", "lower", 12.59, "squared Mahalanobis distance of (v, omega), chi-square of 6"),
    Metric("start_mahalanobis2", "1", "lower", 12.59, "squared Mahalanobis distance of (v, omega) at the start, chi-square of 6"),
    Metric("middle_sigma_over_bound", "1", "lower", 1.5, "geometric mean of sigma by the bound's sigma, mid-sequence"),
)


def metric(key: str) -> Metric:
    """The metric of that key.

    Raises
    ------
    KeyError
        When there is none.
    """
    found = {entry.key: entry for entry in METRICS}
    if key not in found:
        raise KeyError(f"no metric {key!r}; there are {', '.join(found)}")
    return found[key]
