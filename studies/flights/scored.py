"""One flight of the silhouette tier: made, measured from its observation, scored against its truth.

The estimator gets the observation alone. Where the flight has one, the row states the Cramér-Rao bound of the true body
(:mod:`synth.flight_bound`), too.
"""

from collections.abc import Mapping
from typing import Any

from datasets.observation import Observation
from datasets.recipes.recipe import Recipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import VECTORS, score
from datasets.truth import Truth
from estimator.data.configuration import configuration_from_dict
from estimator.measure import measure
from synth.flight_bound import with_bound
from synth.sequence import build_silhouette_sequence

DESCRIBED = ("particle", "irregularity", "speed_ms", "spin_rads", "n_frames", "n_used", "n_views", "n_symmetries", "status", "converged")
"""Columns of a score that say what the flight was like and how its estimate ended."""
SCORED = (
    *("in_plane_ms", "out_of_plane_ms", "angular_rads", "mahalanobis2"),
    *(f"{kind}{quantity}_percent" for kind in ("", "sigma_", "bound_") for quantity in ("in_plane", "out_of_plane", "angular")),
    *(f"ellipsoid95_{name}" for name in VECTORS),
    *(f"{kind}_{component}" for kind in ("pull", "true_bound", "over_true_bound") for component in COMPONENTS),
)
"""Columns of a score at mid-sequence."""


def flight(recipe: Recipe, *, bounded: bool = True, configuration: dict[str, Any] | None = None) -> dict[str, Any]:
    """The payload of a flight; ``bounded``: the true body's bound is computed."""
    return {"recipe": recipe_to_dict(recipe), "bounded": bounded, "configuration": configuration or {}}


def scored_flight(payload: dict[str, Any]) -> list[dict[str, Any]]:
    """Make, measure and score one flight: one row."""
    recipe = recipe_from_dict(payload["recipe"], "case of a study")
    observation, truth = build_silhouette_sequence(recipe, 0)
    if payload["bounded"]:
        truth = with_bound(truth, observation.cameras[0], recipe.noise)
    return [measured_row(observation, truth, payload["configuration"])]


def measured_row(observation: Observation, truth: Truth, configuration: Mapping[str, Any]) -> dict[str, Any]:
    """The score of what is measured of an observation; ``by_samples``: whether its last fit is to samples, with the surface unknown."""
    estimate = measure(observation, configuration_from_dict(configuration))
    row = score(estimate, truth)
    kept = {key: row[key] for key in (*DESCRIBED, "orientation_max_deg")}
    kept |= {key: row[f"middle_{key}"] for key in SCORED if f"middle_{key}" in row}
    return {**kept, "by_samples": "surface" in estimate.statistics, "rms_ete_px": estimate.statistics.get("rms_ete_px", float("nan"))}
