"""One exposure: sub-frames spread over the time that the shutter is open, averaged; the static background behind; vignetting.

Mitsuba has no motion blur. The exposure is cut into equal parts, and one picture is rendered at a random instant of each (stratified
sampling), with the particle where it is then. Instants before the middle are mirrored after it (antithetic sampling): with each drawn on
its own, the mean instant of eight in 50 µs jitters by 0.64 µs, and the instrument finds that. The picture is
``vignetting * (radiance + (1 - coverage) * background)``.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.rendering.camera import IdealFilm, ThinLens, is_ideal
from synth.rendering.distortion import OVERSAMPLING, bend, ideal_film, needed_window, sample_points
from synth.rendering.light import Lighting, background_radiance
from synth.rendering.scene import Pose
from synth.rendering.tracer import Traced, Tracer
from synth.rendering.window import Window, pixel_grid, whole_picture

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Optics:
    """A camera, its lens, its light, and the share of light that is lost in the corners.

    ``moving``: the picture moves, so every sub-frame comes with a camera of its own.
    """

    intrinsics: Intrinsics
    lens: ThinLens
    light: Lighting
    vignetting: float
    moving: bool = False


def film_of(optics: Optics) -> IdealFilm:
    """The film to trace for these optics."""
    camera = optics.intrinsics
    if _direct(optics):
        return IdealFilm(camera.fx_px, camera.cx_px, camera.cy_px, optics.lens)
    return ideal_film(camera, optics.lens)


def subframe_times(time_s: float, exposure_s: float, subframes: int, rng: np.random.Generator) -> Float[NDArray[np.float64], " subframe"]:
    """One random instant (s) in each of ``subframes`` equal parts of the exposure about ``time_s``, which is their mean."""
    before = (np.arange(subframes // 2) + rng.uniform(size=subframes // 2)) / subframes - 0.5
    middle = np.zeros(subframes % 2)
    return time_s + exposure_s * np.concatenate([before, middle, -before[::-1]])


def expose(
    tracer: Tracer,
    optics: Optics,
    window: Window,
    poses: Sequence[Pose],
    *,
    samples: int,
    seeds: Sequence[int],
    cameras: Sequence[Intrinsics] = (),
    chips: Sequence[Pose] = (),
) -> Traced:
    """The mean over the sub-frames of the particle's light and coverage in a window of the picture.

    ``cameras``, one per sub-frame, are those of a moving picture; ``optics.moving`` says that there are. ``chips``, one per sub-frame, are
    poses of a chip that has broken off.
    """
    if window.empty:
        nothing = np.zeros((max(window.height, 0), max(window.width, 0)))
        return Traced(nothing, nothing)
    through = cameras or (optics.intrinsics,) * len(poses)
    places = zip(poses, chips or (None,) * len(poses), strict=True)
    traced = [
        _trace_real(tracer, replace(optics, intrinsics=camera), window, place, samples=samples, seed=seed, film=film_of(optics))
        for place, seed, camera in zip(places, seeds, through, strict=True)
    ]
    return Traced(
        np.asarray(np.mean([part.radiance for part in traced], axis=0)), np.asarray(np.mean([part.coverage for part in traced], axis=0))
    )


def _direct(optics: Optics) -> bool:
    """Whether the film's picture is the camera's."""
    return is_ideal(optics.intrinsics) and not optics.moving


def _trace_real(
    tracer: Tracer, optics: Optics, window: Window, place: tuple[Pose, Pose | None], *, samples: int, seed: int, film: IdealFilm
) -> Traced:
    pose, chip = place
    if _direct(optics):
        return tracer.trace(window, *pose, samples=samples, seed=seed, chip=chip)
    points = sample_points(window, optics.intrinsics, film)
    fine = needed_window(points)
    finer = max(1, samples // OVERSAMPLING**2)
    return bend(tracer.trace(fine, *pose, samples=finer, seed=seed, chip=chip), fine, points)


def background_light(optics: Optics) -> Float[NDArray[np.float64], "height width"]:
    """Relative light of the whole picture without a particle."""
    whole = whole_picture(optics.intrinsics)
    pixels = pixel_grid(whole)
    radiance = background_radiance(optics.light, optics.intrinsics.normalise(pixels))
    return (radiance * _vignette(optics, pixels)).reshape(whole.height, whole.width)


def compose(optics: Optics, background: Float[NDArray[np.float64], "height width"], window: Window, particle: Traced) -> Array:
    """The picture's relative light: ``background`` with the particle in its ``window``."""
    picture = background.copy()
    if not window.empty:
        vignette = _vignette(optics, pixel_grid(window)).reshape(window.height, window.width)
        picture[window.slices] = background[window.slices] * (1 - particle.coverage) + vignette * particle.radiance
    return picture


def _vignette(optics: Optics, pixels: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], " n"]:
    """``1 - a r²``, with ``r`` the distance from the principal point, 1 in the farthest corner."""
    camera = optics.intrinsics
    centre = np.array([camera.cx_px, camera.cy_px])
    far = np.maximum(centre, np.array([camera.width_px - 1, camera.height_px - 1]) - centre)
    return 1 - optics.vignetting * ((pixels - centre) ** 2).sum(axis=1) / float(far @ far)
