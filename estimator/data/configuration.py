"""What a user may set of the estimator, with defaults that were measured to work."""

import dataclasses
import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from datasets.errors import InputError


@dataclass(frozen=True)
class Configuration:
    """The estimator's settings.

    ``offset_prior_px`` and ``frame_offset_prior_px``: standard deviation of the boundary offset of outlines given as such and of outlines
    measured in pictures. ``com_prior`` (share of the largest extent), ``inertia_prior`` and ``inertia_products_prior`` (relative, moments
    and products): how far the visual hull's mass properties may be off; measured on scanned bodies with 60 views, and more for a body with
    hollows, which the hull fills. ``floor_px``: tangent
    noise that the outlines do not show; ``body_noise_px``: the part of the error that stays with a place on the body, where no other
    sequence of the particle shows how large it is. ``huber``: standard deviations beyond which an error's influence stays constant.
    ``within_pairs``: largest number of pairs within the sequence in the last refinement, 0 leaves them out. ``bias_pairs``: pairs of draws
    from which the bias of an outline given as such is predicted for the last refinement, a fixed number of drawn pictures where it comes
    from one; 0 compares views in the camera's likeness instead.
    ``momentum_starts``: angular velocities drawn when tracking fails, within ``largest_spin_rads``. ``focal_prior``: relative standard
    deviation of the high-speed camera's focal length; 0 means that it is known, otherwise it is measured with the flight, from the camera's
    as a start. ``minimum_frames``: fewer usable frames give no measurement. ``keep_out_of_plate``: 1 requires that the
    particle does not reach into the plate it falls on; ``estimate_plate``: 1 measures the plate's plane with the flight, from what is
    stated of it or from the impacts alone. ``surface_fit``: 1 fits flights, free or with impacts, once more, to all outline samples with
    the surface as an unknown (decision 53), where no focal length is measured, and beside contacts where views are many; 2 does so with few
    views, too; 0 leaves it at tangents.
    ``campaign_surface_fit``: the same of campaigns (decision 64), where views are many. ``seed`` feeds the drawn starts and the drawn
    noise of the views' likeness.
    """

    hull_resolution: int = 64
    directions: int = 600
    pose_starts: int = 48
    pose_candidates: int = 8
    trajectory_candidates: int = 3
    momentum_starts: int = 100
    largest_spin_rads: float = 400.0
    minimum_frames: int = 8
    ambiguity: float = 1.1
    offset_prior_px: float = 0.02
    frame_offset_prior_px: float = 0.1
    com_prior: float = 0.0025
    inertia_prior: float = 0.015
    inertia_products_prior: float = 0.003
    floor_px: float = 0.04
    body_noise_px: float = 0.05
    focal_prior: float = 0.0
    huber: float = 4.0
    within_pairs: int = 600
    bias_pairs: int = 8
    foreign_view_ratio: float = 4.0
    keep_out_of_plate: int = 0
    estimate_plate: int = 0
    surface_fit: int = 1
    campaign_surface_fit: int = 1
    seed: int = 0


SWITCHES = {"keep_out_of_plate": 1, "estimate_plate": 1, "surface_fit": 2, "campaign_surface_fit": 2}
"""Settings that are one of a few numbers from 0 on, and the last of them."""
ALWAYS = 2
"""The ``surface_fit`` and ``campaign_surface_fit`` of who wants it of campaigns and beside contacts with few views, too."""


def configuration_from_dict(values: Mapping[str, Any]) -> Configuration:
    """A configuration from plain values; names that are left out keep their default.

    Raises
    ------
    InputError
        Where a name is unknown, a type is wrong, a number is negative or a switch is none of its numbers.
    """
    fields = {field.name: field for field in dataclasses.fields(Configuration)}
    checked: dict[str, Any] = {}
    for name, value in values.items():
        if name not in fields:
            near = difflib.get_close_matches(name, fields, n=3)
            raise InputError(
                f"estimator configuration: expected one of its settings, got {name!r}"
                + (f"; did you mean {', '.join(near)}?" if near else "")
            )
        wanted = type(getattr(Configuration(), name))
        if isinstance(value, bool) or not isinstance(value, int | float) or (wanted is int and int(value) != value):
            raise InputError(f"estimator configuration: expected {name} to be of type {wanted.__name__}, got {value!r}")
        if value < 0:
            raise InputError(f"estimator configuration: expected {name} >= 0, got {value!r}")
        if value > SWITCHES.get(name, value):
            said = " or ".join(str(each) for each in range(SWITCHES[name] + 1))
            raise InputError(f"estimator configuration: expected {name} to be {said}, got {value!r}")
        checked[name] = wanted(value)
    return Configuration(**checked)
