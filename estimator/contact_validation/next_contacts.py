"""Does another corner strike the plate right after the first? Then what is measured after the impact is not the work of one contact.

After a contact the body flies on, and turns: ``h(t) = h + v·n t + (exp(ω t) r)·n`` is the height of each corner, the lever r measured
at the contact. Gravity is left out, within the time that counts, :data:`TOGETHER_S`, it moves a corner by a micrometre. Contacts that
near one another overlap (stiff grains of millimetres stay in contact for 20 to 200 µs [Hertz 1882]) or are one impact to a camera.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.contact_validation.contacts import Contacts, nominal
from estimator.contact_validation.laws.point_contact import PointContact
from estimator.contact_validation.measured import MeasuredImpact

Array = NDArray[np.float64]
TOGETHER_S = 5e-4
"""Within which contacts of two corners are one impact (notebook 21)."""
TIMES = np.geomspace(2e-6, TOGETHER_S, 24)
"""Instants (s) after a contact at which the heights of other corners are looked at."""
APART_SHARE = 0.05
"""Corners nearer than this part of the extent are one place: hulls of many views have many (notebook 21)."""


@dataclass(frozen=True)
class NextContacts:
    """Which of n contacts another corner follows: ``struck`` (n,), and of those that do (k) the ``contacts`` that follow."""

    struck: Bool[NDArray[np.bool_], " n"]
    contacts: Contacts


def next_contacts(first: Contacts, after: Array, corners: Array, extent_m: float) -> NextContacts:
    """What follows ``first`` (n) contacts that left bodies with ``after`` (n, 6); ``corners`` (n, c, 3) m from the centres, at contact."""
    v, omega = after[:, :3] - first.plate_velocity, after[:, 3:]
    turns = Rotation.from_rotvec((TIMES[:, None] * omega[:, None, :]).reshape(-1, 3)).as_matrix().reshape(len(v), -1, 3, 3)
    normal = first.axes[:, 2]
    seen_from_body = np.einsum("ntij,ni->ntj", turns, normal)
    rise = TIMES * np.einsum("ni,ni->n", v, normal)[:, None] - np.einsum("ni,ni->n", first.lever, normal)[:, None]
    heights = np.einsum("ntj,ncj->ntc", seen_from_body, corners) + rise[:, :, None]
    near = np.linalg.norm(corners - first.lever[:, None, :], axis=2) <= APART_SHARE * extent_m
    heights[np.broadcast_to(near[:, None, :], heights.shape)] = np.inf
    under = heights.min(axis=2) < 0.0
    struck = under.any(axis=1)
    rows = np.flatnonzero(struck)
    when = under[rows].argmax(axis=1)
    turn = turns[rows, when]
    lever = np.einsum("nij,nj->ni", turn, corners[rows, heights[rows, when].argmin(axis=1)])
    return NextContacts(
        struck,
        Contacts(
            axes=first.axes[rows],
            lever=lever,
            turning=turn @ first.turning[rows] @ np.swapaxes(turn, 1, 2),
            v=after[rows, :3],
            omega=after[rows, 3:],
            plate_velocity=first.plate_velocity[rows],
        ),
    )


def shared_by_corners(impacts: Sequence[MeasuredImpact], law: PointContact) -> Bool[NDArray[np.bool_], " impact"]:
    """Impacts in which, if ``law`` is nature's, another corner strikes right after the first."""
    firsts = [nominal([impact]) for impact in impacts]
    followed = [next_contacts(c, law.after_contacts(c), i.low_corners[None], i.extent_m) for i, c in zip(impacts, firsts, strict=True)]
    return np.array([bool(each.struck[0]) for each in followed])
