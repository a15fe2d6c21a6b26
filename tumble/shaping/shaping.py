"""``tumble shape``: drops -> sets -> merged views -> solid, checks, and what is made once -> a particle file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from datasets.errors import InputError
from datasets.made_files import Arrays
from datasets.observation import CalibratedView
from datasets.particle_files import ParticleFile
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.data.configuration import Configuration
from estimator.merging.fitted import MergeSettings
from estimator.merging.leaving_out import sets_again
from estimator.merging.merge import Merged, merge
from estimator.merging.prediction import largest_gap, predicted_views
from estimator.merging.solid import Solid, solid_figures, ways_of_looking
from estimator.merging.view_set import ViewSet, view_set
from estimator.outlines.recording import view_outlines_of
from estimator.outlines.result import EMPTY
from estimator.particle.made_once import arrays_of, digest_of
from estimator.particle.particle import MINIMUM_VIEWS, Particle, particle_of
from tumble.shaping.drops import Drop

WANTED_EXCESS = 0.01
"""Share of the volume by which a hull may be too large before more views are asked for: what acceptance of volume and inertia needs."""


@dataclass(frozen=True)
class Shaped:
    """A particle file with its surface (m), and what is kept beside it: the digest of what it was made from, and the arrays."""

    particle: ParticleFile
    surface: SurfaceMesh
    made: tuple[str, Arrays]


def shape(drops: Sequence[Drop], name: str, *, mass_kg: float | None, advance: Callable[[], None] = lambda: None) -> Shaped:
    """Merge ``drops`` and make everything that recordings of this particle share.

    Raises
    ------
    InputError
        Where too few drops or views are left, or they do not agree.
    """
    found, unusable = _sets(drops)
    sets = [one for one, _ in found]
    settings = MergeSettings(foreign_view_ratio=Configuration().foreign_view_ratio, floor_px=Configuration().floor_px)
    merged = merge(sets, settings, advance) if len(sets) > 1 else None
    outlines, views = _all_views(sets[0], posed=found[0][1].posed) if merged is None else (merged.outlines, merged.views)
    outlines = view_outlines_of(outlines, views, name=name).outlines
    particle = particle_of(outlines, views, Configuration())
    rng, exact = np.random.default_rng(Configuration().seed), particle.casting_hull if particle.has_exact_hull else None
    solid = solid_figures(particle.outlines, particle.calibrated, rng, hull=exact)
    checks = _checks(sets, (merged, settings), (particle, solid))
    notes = [*unusable, *([] if merged is None else _left_out_words(merged)), *([particle.sentence] if particle.sentence else [])]
    weighed = mass_kg if mass_kg is not None else next((d.mass_kg for d in drops if d.mass_kg is not None), None)
    told = ParticleFile(
        name=name,
        views=tuple(views),
        outlines=outlines,
        mass_kg=weighed,
        merging=None if merged is None else _merging(sets, merged),
        shape=_figures(solid, particle),
        checks=checks,
        notes=tuple([*notes, *_few_views_words(checks, excess_known=bool(np.isfinite(solid.volume_sigma_m3)))]),
    )
    return Shaped(told, solid.surface, (digest_of(outlines, views, Configuration()), arrays_of(particle.once(Configuration()))))


def _sets(drops: Sequence[Drop]) -> tuple[list[tuple[ViewSet, Drop]], list[str]]:
    """The sets that have a hull, each with its drop, and in words what could not be used."""
    sets: list[tuple[ViewSet, Drop]] = []
    said: list[str] = []
    seen: dict[bytes, str] = {}
    for drop in drops:
        said += [f"{drop.name}: view {k} left out: {reason}." for k, reason in drop.faults.items()]
        outlines, again = _seen_first(drop, seen)
        said += again
        if all(outline.empty for outline in outlines):
            said.append(f"{drop.name}: left out: expected a view with a usable outline, got none of {len(outlines)}.")
            continue
        try:
            sets.append((view_set(drop.name, outlines, drop.views), drop))
        except InputError as error:
            said.append(f"{drop.name}: left out: {error}.")
    if not sets:
        raise InputError(f"{drops[0].path}: expected drops whose views show one body, got none. {' '.join(said)}")
    return sets, said


def _seen_first(drop: Drop, seen: dict[bytes, str]) -> tuple[list[Outline], list[str]]:
    """The drop's outlines, empty where one is that of a view in an earlier drop to the last digit, and this in words; adds to ``seen``.

    The same picture given twice tells nothing new but would count twice in every uncertainty. No two pictures give the same outline.
    """
    keys = [outline.points_px.tobytes() for outline in drop.outlines]
    twice = {k: seen[key] for k, key in enumerate(keys) if not drop.outlines[k].empty and key in seen}
    seen |= {key: f"{drop.name}, view {k}" for k, key in enumerate(keys) if k not in twice}
    outlines = [EMPTY if k in twice else outline for k, outline in enumerate(drop.outlines)]
    return outlines, [f"{drop.name}: view {k} left out: its outline is that of {other} to the last digit." for k, other in twice.items()]


def _all_views(one: ViewSet, *, posed: bool) -> tuple[tuple[Outline, ...], tuple[CalibratedView, ...]]:
    """Those of a single set: in its frame where that is a particle's (``posed``), else with the origin in the middle of its hull."""
    if posed:
        return one.outlines, one.views
    return one.outlines, tuple(replace(v, t_cam_particle=v.t_cam_particle + v.R_cam_particle @ one.centre) for v in one.views)


def _left_out_words(merged: Merged) -> list[str]:
    return [f"{out.name}{'' if out.view is None else f', view {out.view}'}: left out: {out.reason}." for out in merged.left_out]


def _merging(sets: Sequence[ViewSet], merged: Merged) -> dict[str, Any]:
    at = merged.joint.placements
    placed = [
        {
            "name": sets[number].name,
            "views": len(sets[number]),
            "rms_ete_px": round(float(rms), 4),
            "loops": sum(edge.votes for pair, edge in merged.consensus.edges.items() if number in pair),
            "R_set_particle": at.R[k],
            "t_set_particle": at.t[k],
        }
        for k, (number, rms) in enumerate(zip(merged.placed, merged.set_rms_px, strict=True))
    ]
    views = [
        {"set": sets[int(s)].name, "view": int(v), "rms_ete_px": round(float(rms), 4)}
        for s, v, rms in zip(merged.set_of, merged.view_of, merged.view_rms_px, strict=True)
    ]
    return {
        "sets": placed,
        "views": views,
        "covariance": merged.joint.covariance,
        "mean_square": merged.joint.mean_square,
        "settled": merged.joint.settled,
        "calibration_px": merged.calibration_px,
        "rig": [{"camera": camera, "moved_m": row[:3], "turned_rad": row[3:]} for camera, row in merged.rig.items()],
        "left_out": [vars(out) for out in merged.left_out],
    }


def _figures(solid: Solid, particle: Particle) -> dict[str, Any]:
    return {
        "volume_m3": solid.volume_m3,
        "volume_sigma_m3": solid.volume_sigma_m3,
        "hull_volume_excess": solid.excess,
        "com_particle": solid.body.com_particle,
        "com_sigma_m": solid.com_sigma_m,
        "R_particle_body": solid.body.R_particle_body,
        "inertia_ratios": solid.body.inertia_ratios,
        "inertia_ratios_sigma": solid.inertia_sigma,
        "extent_m": particle.extent_m,
        "hollow": particle.hollow,
    }


def _checks(sets: Sequence[ViewSet], merging: tuple[Merged | None, MergeSettings], found: tuple[Particle, Solid]) -> dict[str, Any]:
    (merged, settings), (particle, solid) = merging, found
    predicted = predicted_views(particle.outlines, particle.calibrated, particle.body.com_particle)
    gap = largest_gap(particle.calibrated)
    count = int(ways_of_looking(particle.calibrated, particle.body.com_particle).max()) + 1
    wanted = int(np.ceil(count * solid.excess / WANTED_EXCESS)) if np.isfinite(solid.volume_sigma_m3) else 2 * MINIMUM_VIEWS
    return {
        "views_left_out": sorted({*particle.report.left_out, *particle.report.without_outline}),
        "views_contradict": particle.contradictory,
        "views_predicted_from_the_others": None
        if predicted is None
        else {"excess_px": predicted.excess_px, "outside_px": predicted.outside_px},
        "sets_placed_by_the_others": [] if merged is None else [vars(again) for again in sets_again(sets, merged, settings)],
        "largest_gap_deg": gap.gap_deg,
        "largest_gap_direction": gap.direction,
        "further_views_wanted": 0 if particle.contradictory else max(wanted - count, 0),
    }


def _few_views_words(checks: dict[str, Any], *, excess_known: bool) -> list[str]:
    more = checks["further_views_wanted"]
    if not more:
        return []
    x, y, z = checks["largest_gap_direction"]
    large = (
        f"The hull is larger than the body by more than {WANTED_EXCESS:.0%} of its volume: some {more} further views would do."
        if excess_known
        else f"How much larger than the body the hull is can only be told from {2 * MINIMUM_VIEWS} directions on, here by {more} more."
    )
    return [
        f"{large} No view looks within {checks['largest_gap_deg']:.0f} degrees of the direction ({x:.2f}, {y:.2f}, {z:.2f}), particle "
        "frame: let the particle lie so that one does."
    ]
