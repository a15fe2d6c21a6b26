"""What may be tuned in the way from frames to outlines; every length is in pixels."""

from dataclasses import dataclass


@dataclass(frozen=True)
class OutlineSettings:
    """Thresholds of detection and rejection.

    ``least_contrast``: share of the full brightness difference (background to black, or to full scale for a dark
    background) below which nothing counts as a particle. ``detection_sigmas``: the same in standard deviations of the
    noise. ``detection_level``: share of the particle's contrast at which a pixel counts as covered; low, so that light
    leaking through a transparent particle does not open its rim. ``least_area_px2``: smaller things are dust.
    ``rival_share``: with nothing known before, a second object of at least this share of the largest one's area makes
    the picture undecidable. ``edge_margin_px``: nearer to the picture's edge the particle counts as cut off.
    ``widest_edge``: out of focus when the 10-90% edge width exceeds this multiple of the sequence's sharpest quarter
    (and ``least_blur_px``), or ``widest_edge_share`` of the particle's diameter. ``beyond_sigmas``, ``beyond_contrast``,
    ``beyond_share``: unevenly lit when just beyond this share of the outline the picture departs from the background by so many standard
    deviations of a pixel and by this share of the particle's contrast. ``most_before_scenery_px``: length of outline (px) just beyond which
    the background may be dark; a plate's edge is blurred, and moves the half level of what comes near it.
    """

    least_contrast: float = 0.05
    detection_sigmas: float = 7.0
    detection_level: float = 0.12
    least_area_px2: int = 40
    rival_share: float = 0.3
    edge_margin_px: int = 2
    widest_edge: float = 2.0
    least_blur_px: float = 4.0
    widest_edge_share: float = 0.25
    beyond_sigmas: float = 3.0
    beyond_contrast: float = 0.004
    beyond_share: float = 0.1
    most_before_scenery_px: float = 2.0
    crop_margin_px: int = 16
    background_samples: int = 24
    spacing_px: float = 1.0
    refinements: int = 2
