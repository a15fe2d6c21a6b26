"""Impacts, and what is left of a particle that broke, as plain entries of the truth's document."""

from typing import Any

from datasets import state_entries
from datasets.state_entries import Array
from datasets.truth import Impact, Remnant

VECTORS = (
    "x_world",
    "q_world_body",
    "point_world",
    "normal_world",
    "plate_velocity_world",
    "v_before",
    "omega_before",
    "v_after",
    "omega_after",
    "impulse_world",
)
TABLES = ("points_world", "impulses_world")
NUMBERS = ("time_s", "duration_s", "compression_work_J", "normal_work_J", "tangential_work_J", "energy_lost_J", "deepest_m")


def impact_entry(impact: Impact) -> dict[str, Any]:
    """An impact as an entry of a document; ``restitution`` follows from the others and is there for whoever reads it."""
    return {name: getattr(impact, name) for name in (*VECTORS, *TABLES, *NUMBERS, "restitution")}


def impact(entry: dict[str, Any]) -> Impact:
    """The inverse of :func:`impact_entry`."""
    arrays: dict[str, Any] = {name: state_entries.array(entry[name]) for name in VECTORS}
    tables: dict[str, Any] = {name: state_entries.array(entry[name], (3,)) for name in TABLES}
    numbers: dict[str, Any] = {name: float(entry[name]) for name in NUMBERS}
    return Impact(**arrays, **tables, **numbers)


def remnant_entry(remnant: Remnant, mesh: str) -> dict[str, Any]:
    """What is left of a particle as an entry of a document; ``mesh`` is the file of its mesh."""
    return {
        "time_s": remnant.time_s,
        "mesh": mesh,
        "body": state_entries.body_entry(remnant.body),
        "mass_kg": remnant.mass_kg,
        "inertia_kgm2": remnant.inertia_kgm2,
    }


def remnant(entry: dict[str, Any], vertices: Array) -> Remnant:
    """The inverse of :func:`remnant_entry`, with the vertices (v, 3) m of its mesh."""
    moments = state_entries.array(entry["inertia_kgm2"])
    return Remnant(float(entry["time_s"]), vertices, state_entries.body(entry["body"]), float(entry["mass_kg"]), moments)
