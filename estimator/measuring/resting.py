"""Whether a particle that no free flight fits lies or rolls on something: its centroid then does not fall as gravity says.

The acceleration of the outline's centroid along the gravity seen in the picture, over the longest stretch without a kink, is compared
with gravity; the picture's scale is that of the particle's extent. A particle that rests has none of it, one that rolls down a slope of
30° less than a quarter. Only asked after a fit has left larger errors than outlines have: the wobble of a spinning body is too much like
a force to refuse a sequence by that alone. What drags hardly falls either, or what a stated gravity is wrong for; but a particle that lies
stays where it is, and one that rolls is no faster than its rim, which a particle in flight mostly is.
"""

import numpy as np
from numpy.typing import NDArray

from estimator.impacts.chains import Seen
from estimator.impacts.impact_search import CentroidPath, Kink, centroid_path, wobble_of

Array = NDArray[np.float64]
LEAST_FRAMES = 12
"""Below which nothing is said of whether a particle falls. By judgement."""
FASTER_THAN_RIM = 1.5
"""Speed over that of the rim, above which nothing rolls."""
LEAST_MOVED = 0.5
"""Of its extent: what moves less in a recording may lie still."""
MOST_SHARE = 0.5
"""Of gravity along itself: a particle that is held by something."""
LEAST_SAG_PX, MOST_WOBBLE = 1.0, 4.0
"""What is missing of the distance that gravity would bend the path by: at least so many px, and times the wobble, to say anything."""
SURE = 2.0
"""Standard deviations of what a slow wobble bends the path by, beyond which a fall is missing: one chance in 40. Lying and rolling stones
in 60 frames miss three of them."""


def resting_sentence(seen: Seen, kinks: list[Kink], rng: np.random.Generator, omega_rads: float | None = None) -> str | None:
    """What to say of a particle that does not fall, or ``None`` where it does or nothing can be told.

    ``rng`` of the orientations in which its outline's centre may miss that of mass; ``omega_rads``: how fast it turns, where a fit says so.
    """
    camera_number = int(np.argmax([int(t.used.sum()) for t in seen.tracks]))
    path = longest_stretch(centroid_path(seen.tracks[camera_number]), kinks)
    if len(path.frame) < LEAST_FRAMES:
        return None
    share, sag_px, wobble_px = fall(seen, path, camera_number)
    wobble_m = wobble_of(seen.particle, rng)
    bent_px = np.pi**2 / 8.0 * wobble_m * _pixels_per_metre(seen, camera_number)  # sag of half a turn in the recording
    if abs(share) > MOST_SHARE or (1.0 - share) * sag_px < max(LEAST_SAG_PX, MOST_WOBBLE * wobble_px, SURE * bent_px):
        return None
    if omega_rads is not None and _flies(seen, path, camera_number, omega_rads):
        return None
    first, last = int(path.frame[0]), int(path.frame[-1])
    return (
        f"from frame {first} to {last} the particle falls with {100 * share:.0f}% of gravity: it rests or rolls on something, "
        "and neither a free flight nor impacts describe that. Cut the recording before it."
    )


def _flies(seen: Seen, path: CentroidPath, camera_number: int, omega_rads: float) -> bool:
    """Whether it is too fast to roll, and does not stay where it is."""
    times = seen.observation.clock_of(camera_number).times_s[path.frame]
    moved = float(np.linalg.norm(path.c[-1] - path.c[0])) / _pixels_per_metre(seen, camera_number)
    extent = seen.particle.extent_m
    return moved > LEAST_MOVED * extent and moved / float(np.ptp(times)) > FASTER_THAN_RIM * omega_rads * 0.5 * extent


def longest_stretch(path: CentroidPath, kinks: list[Kink]) -> CentroidPath:
    """The longest part of a path between kinks."""
    number = np.searchsorted([k.frame for k in kinks], path.frame)
    rows = number == np.argmax(np.bincount(number))
    return CentroidPath(path.frame[rows], path.c[rows])


def fall(seen: Seen, path: CentroidPath, camera_number: int) -> tuple[float, float, float]:
    """Acceleration along the gravity seen in the picture, as a share of it, and by how much (px) gravity would bend the path.

    And what the path wobbles about its parabola (px, RMS).
    """
    camera = seen.observation.cameras[camera_number]
    times = seen.observation.clock_of(camera_number).times_s[path.frame]
    pull = (camera.R_cam_world @ seen.observation.gravity_world)[:2] * _pixels_per_metre(seen, camera_number)
    strength = float(np.linalg.norm(pull))
    if strength == 0.0:
        return 1.0, 0.0, 0.0
    t = times - times.mean()
    along = path.c @ (pull / strength)
    parabola = np.polyfit(t, along, 2)
    wobble = float(np.sqrt(np.mean((along - np.polyval(parabola, t)) ** 2)))
    return 2.0 * float(parabola[0]) / strength, strength * float(np.ptp(t)) ** 2 / 8.0, wobble


def _pixels_per_metre(seen: Seen, camera_number: int) -> float:
    """From the largest outline, which shows about the particle's extent."""
    used = [f.outline.points_px for f in seen.tracks[camera_number].frames if f.used]
    return max(float(np.linalg.norm(np.ptp(points, axis=0))) for points in used) / (np.sqrt(2.0) * seen.particle.extent_m)
