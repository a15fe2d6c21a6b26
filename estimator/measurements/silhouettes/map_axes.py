"""What residuals on outlines are mapped over: frame, place in the picture, direction, place on the body, speed, spin phase, view."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.model_errors import SequenceTask
from estimator.diagnosis.residual_maps import DIRECTIONS, Axis, even, phase
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, SequenceEquations
from estimator.geometry.sphere import fibonacci_sphere

Array = NDArray[np.float64]
Index = NDArray[np.int64]
BODY_CELLS, GRID = 16, 4
"""Cells of the sphere of normals, and along each side of the picture, of which a map tells. By judgement."""


@dataclass(frozen=True)
class Axes:
    """All axes, and ``velocity_direction`` (r, 2), in which the particle of each residual flies in the picture."""

    axes: tuple[Axis, ...]
    velocity_direction: Array


def axes_of(campaign: Campaign, fit: CampaignFit) -> Axes:
    """The axes of a campaign of tangency errors; residuals in the order of sequences, sightings, views and tangencies."""
    common = outline_axes(campaign, fit)
    view = np.concatenate([np.nonzero(each.errors.seen)[1] for each in fit.equations])
    return replace(common, axes=(*common.axes, _views(view.astype(np.int64))))


def outline_axes(campaign: Campaign, fit: CampaignFit) -> Axes:
    """The axes of residuals at ``places`` of outlines, whichever they are; residuals in the order of sequences, sightings and places."""
    parts = [_of_sequence(sequence, each) for sequence, each in zip(campaign.sequences, fit.equations, strict=True)]
    c = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    radius = np.linalg.norm(c["point"] - c["principal"], axis=1)
    axes = (
        even("time", "time", "frame", c["frame"]),
        _grid(c["point"]),
        even("radius", "distance from the principal point", "px", radius),
        _directions("outline_direction", "direction of the outline's normal in the picture", c["angle"]),
        _cells(c["body"]),
        even("speed", "speed", "m/s", c["speed"]),
        phase(c["turned"]),
    )
    return Axes(axes, c["flying"])


def _of_sequence(sequence: SequenceTask, each: SequenceEquations) -> dict[str, Array]:
    """Everything that residuals of one sequence are mapped over."""
    places, sightings, prediction = each.errors.places, sequence.task.sightings, each.errors.prediction
    seen = each.errors.seen.reshape(places.radius_px.shape)
    row, u = np.nonzero(seen)[0], places.normal[seen]
    order = np.argsort(sightings.times_s, kind="stable")
    spin = np.linalg.norm(prediction.omega, axis=1)[order]
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (spin[1:] + spin[:-1]) * np.diff(sightings.times_s[order]))])
    angle = np.empty(len(order))
    angle[order] = np.degrees(turned)
    return {
        "frame": sightings.frame[row].astype(np.float64),
        "point": places.point_px[seen],
        "principal": sightings.seen.principal_px[row],
        "angle": np.degrees(np.arctan2(u[:, 1], u[:, 0])) % 360.0,
        "body": places.normal_body[seen],
        "speed": np.linalg.norm(prediction.velocity, axis=1)[row],
        "turned": angle[row],
        "flying": _flying(sequence, each)[row],
    }


def _flying(sequence: SequenceTask, each: SequenceEquations) -> Array:
    """Unit direction (n, 2) in the picture in which the particle flies in each sighting."""
    sightings, prediction = sequence.task.sightings, each.errors.prediction
    R = sightings.R_cam_world
    v = np.einsum("nij,nj->ni", R, prediction.velocity)
    x = np.einsum("nij,nj->ni", R, prediction.poses.centre[:, 0]) + sightings.t_cam_world
    moving = v[:, :2] - x[:, :2] / x[:, 2:] * v[:, 2:]
    return np.asarray(moving / np.maximum(np.linalg.norm(moving, axis=1, keepdims=True), 1e-12))


def _grid(points: Array) -> Axis:
    """A grid over the part of the picture that was used."""
    low, high = points.min(axis=0), points.max(axis=0)
    place = np.clip(((points - low) / np.maximum(high - low, 1e-9) * GRID).astype(np.int64), 0, GRID - 1)
    middles = low[:, None] + (high - low)[:, None] * (np.arange(GRID) + 0.5) / GRID
    x, y = np.meshgrid(middles[0], middles[1])
    return Axis("place", "place in the picture", "px", place[:, 1] * GRID + place[:, 0], x.ravel(), second=y.ravel())


def _directions(name: str, title: str, degrees: Array) -> Axis:
    """Bins around the circle."""
    width = 360.0 / DIRECTIONS
    number = (np.round(degrees / width).astype(np.int64)) % DIRECTIONS
    return Axis(name, title, "°", number, width * np.arange(DIRECTIONS, dtype=np.float64), displaces=False)


def _cells(normals: Array) -> Axis:
    """Cells of the sphere of directions, body axes: longitude and latitude (°) of each."""
    middles = fibonacci_sphere(BODY_CELLS)
    number = np.argmax(normals @ middles.T, axis=1).astype(np.int64)
    longitude = np.degrees(np.arctan2(middles[:, 1], middles[:, 0]))
    latitude = np.degrees(np.arcsin(np.clip(middles[:, 2], -1.0, 1.0)))
    return Axis("body_direction", "direction on the particle", "°", number, longitude, second=latitude, displaces=False)


def _views(view: Index) -> Axis:
    """Each calibrated view of its own."""
    return Axis("view", "calibrated view", "number", view, np.arange(int(view.max()) + 1, dtype=np.float64), displaces=False)
