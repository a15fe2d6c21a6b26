"""One picture to one outline: departure from the background, the particle's patch, occupancy, sub-pixel edge.

Works on a window of the picture; everything in the result is in the whole picture's coordinates.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from datasets.vocabulary.outline import Outline
from estimator.outlines.pictures.background import Background
from estimator.outlines.pictures.beyond import ACROSS_PX, before_scenery, share_beyond
from estimator.outlines.pictures.component import Place, particle_mask, place_of
from estimator.outlines.pictures.contour import PIXEL_VARIANCE, Edge, Points, edge_blur, half_level_contour, refined, roughness
from estimator.outlines.pictures.occupancy import Departure, departure_from, occupancy_of, plain_occupancy
from estimator.outlines.result import FrameOutline, FrameStatus, in_part, left_out
from estimator.outlines.settings import OutlineSettings

Picture = Float[NDArray[np.float32], "height width"]
Mask = Bool[NDArray[np.bool_], "height width"]
Window = tuple[int, int, int, int]
"""Left, top, right, bottom in px; right and bottom excluded."""

WIDTH_10_90 = 2.5631
"""10-90% width of a Gaussian edge in standard deviations."""
_RING_PX = 8
"""Width of a window's border that shows the background."""
_SHARP_PX = 0.5
"""Blur that an edge is taken to have at least when the particle's own level is read inside of it."""


@dataclass(frozen=True)
class Sighting:
    """What one window of one picture shows; ``place`` is ``None`` where there is no particle."""

    seen: FrameOutline
    place: Place | None
    blur_px: float


def whole(shape: tuple[int, int]) -> Window:
    """The window that is the whole picture of ``shape`` (height, width)."""
    return (0, 0, shape[1], shape[0])


def look(
    picture: NDArray[np.uint16], background: Background, window: Window, settings: OutlineSettings, *, expected: Place | None = None
) -> Sighting:
    """Measure the outline in ``window`` of ``picture`` (DN); ``expected`` is where the particle should be, if known."""
    left, top, right, bottom = window
    part, level = picture[top:bottom, left:right].astype(np.float32), background.level[top:bottom, left:right]
    departure = departure_from(part, background, level, _ring(part.shape, window == whole(picture.shape)))
    least = max(settings.detection_sigmas * departure.noise_dn, settings.least_contrast * background.range_dn)
    if departure.peak < least:
        return _nothing(_why_nothing(picture, background))
    covered = departure.amount > max(least, settings.detection_level * departure.peak)
    inner = None if expected is None else replace(expected, centre_px=expected.centre_px - (left, top))
    mask = particle_mask(covered, settings, expected=inner)
    if isinstance(mask, FrameStatus):
        return _nothing(mask)
    place = place_of(mask, (left, top))
    if _touches(place.box, picture.shape, settings.edge_margin_px):
        return Sighting(left_out(FrameStatus.CUT_OFF), place, float("nan"))
    return _measured(departure, mask, place, (window, background, settings))


def _measured(departure: Departure, mask: Mask, place: Place, context: tuple[Window, Background, OutlineSettings]) -> Sighting:
    window, background, settings = context
    start = _half_level(departure, mask)
    if start is None:
        return Sighting(left_out(FrameStatus.NO_EDGE), place, float("nan"))
    contour, blur, occupancy, contrast = start
    edge = refined(contour, occupancy, blur_px=blur, spacing_px=settings.spacing_px, rounds=settings.refinements)
    seen = _reported(edge, window, departure.noise_dn / contrast, contrast / background.full_scale)
    least = max(settings.beyond_sigmas * departure.noise_dn, settings.beyond_contrast * contrast)
    left, top, right, bottom = window
    level = background.level[top:bottom, left:right]
    scenery = before_scenery(edge, level, len(ACROSS_PX)) if background.bright else np.zeros(len(edge.points_px), dtype=bool)
    if share_beyond(edge, departure, least, scenery) > settings.beyond_share:
        seen = replace(seen, status=FrameStatus.UNEVENLY_LIT)
    if scenery.any():
        seen = in_part(seen, before_scenery(edge, level), FrameStatus.BEFORE_SCENERY, most_px=settings.most_before_scenery_px)
    return Sighting(seen, place, edge.blur_px)


def _half_level(departure: Departure, mask: Mask) -> tuple[Points, float, Picture, float] | None:
    """Half-level contour, its blur (px), the occupancy and the contrast (DN).

    How wide the edge is decides how deep inside the particle's own level can be read, so that comes first, from the whole inside.
    """
    plain = plain_occupancy(departure, mask)
    rough = half_level_contour(plain)
    if rough is None:
        return None
    blur = max(edge_blur(rough, plain), _SHARP_PX)
    occupancy, contrast = occupancy_of(departure, mask, blur)
    contour = half_level_contour(occupancy)
    return None if contour is None else (contour, edge_blur(contour, occupancy), occupancy, contrast)


def _reported(edge: Edge, window: Window, noise: float, contrast: float) -> FrameOutline:
    return FrameOutline(
        outline=Outline(edge.points_px + np.array(window[:2], dtype=np.float64)),
        status=FrameStatus.USED,
        edge_width_px=WIDTH_10_90 * float(np.sqrt(edge.blur_px**2 + PIXEL_VARIANCE)),
        contrast=contrast,
        noise=noise,
        sigma_px=max(edge.noise_gain * noise, roughness(edge.points_px)),
        misfit=edge.misfit,
    )


def _ring(shape: tuple[int, int], everything: bool) -> Mask:
    """Pixels that show the background: the border of a window, a sparse grid of a whole picture."""
    ring = np.zeros(shape, dtype=bool)
    if everything:
        ring[::4, ::4] = True
        return ring
    ring[:_RING_PX], ring[-_RING_PX:], ring[:, :_RING_PX], ring[:, -_RING_PX:] = True, True, True, True
    return ring


def _touches(box: Window, shape: tuple[int, int], margin: int) -> bool:
    return box[0] < margin or box[1] < margin or box[2] > shape[1] - margin or box[3] > shape[0] - margin


def _why_nothing(picture: NDArray[np.uint16], background: Background) -> FrameStatus:
    """Why nothing departs from the background: is there a picture at all."""
    sparse = picture[::4, ::4]
    if float(np.median(sparse)) >= background.full_scale and background.typical < background.full_scale:
        return FrameStatus.OVEREXPOSED
    dark = 0.25 * background.typical if background.bright else 0.0
    return FrameStatus.BLACK if float(sparse.max()) <= dark else FrameStatus.ABSENT


def _nothing(status: FrameStatus) -> Sighting:
    return Sighting(left_out(status), None, float("nan"))
